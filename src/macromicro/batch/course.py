"""What a macro-stage's step response is judged by, gathered sample by sample.

One form for a single run and for a lane of many: `follow` has no branch that a vector
register could not take, and keeps no sample.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.batch.variants import Metric
from macromicro.kernel import kernel

BAND = 0.02  # share of the step within which it has settled
RISEN = 0.98  # share of the step after which it has risen
ARRIVED = 2.0  # counts; turns of the position count from the first error within it
SMALLEST = 10.0  # counts; a smaller step has no 2 % and begins where it ends

METRICS: tuple[Metric, ...] = (
    Metric("settling_time", "s", "from then on the error stays within 2 % of the step"),
    Metric("rise_time", "s", "98 % of the step lie behind for the first time"),
    Metric("overshoot", "count", "farthest beyond the target"),
    Metric("iae", "count*s", "integral of the absolute error"),
    Metric("final_error", "count", "target minus position at the end"),
    Metric("peak_effort", "V", "largest effort asked for after the first sample"),
    Metric("saturated", "", "samples after the first whose effort the limit cuts"),
    Metric("reversals", "", "turns of the position once within 2 counts of the target"),
)


class Task(NamedTuple):
    """How a step is judged.

    Attributes
    ----------
    sign : float
        Of the step.
    band : float
        Of the error [counts].
    risen : float
        Least way [counts], whole, that has the share `RISEN` of the step behind it.
    """

    sign: float
    band: float
    risen: float


class Course(NamedTuple):
    """What was gathered so far.

    Attributes
    ----------
    outside, early : float
        Samples up to the last one outside the band, and before it has risen.
    far : float
        Greatest way in the step's direction [counts], at least 0.
    sum : float
        Of |error| [counts].
    peak : float
        Largest |effort| asked for [V].
    saturated, turns : float
        Samples with a cut effort, and turns of the position.
    move : float
        The last one [counts], 0: none.
    """

    outside: float
    early: float
    far: float
    sum: float
    peak: float
    saturated: float
    turns: float
    move: float


def task(target: float) -> Task:
    """Tell how a step from 0 is judged.

    Parameters
    ----------
    target : float
        Counts, `SMALLEST` at least in either direction.

    Returns
    -------
    Task
        For `follow`.
    """
    size, sign = abs(target), math.copysign(1.0, target)
    risen = math.floor(RISEN * size) - 1.0
    while risen / size < RISEN:
        risen += 1.0
    return Task(sign, BAND * size, risen)


def begun() -> Course:
    """Begin, before the first sample.

    Returns
    -------
    Course
        Of nothing.
    """
    return Course(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@kernel
def gathered(total: float, error: float) -> float:
    """Add one more sample's error.

    Parameters
    ----------
    total : float
        Sum of |error| [counts].
    error : float
        Of the sample [counts].

    Returns
    -------
    float
        The new sum.
    """
    return total + abs(error)


@kernel
def farther(far: float, sign: float, seen: float) -> float:
    """Take one more sample's position.

    Parameters
    ----------
    far : float
        Greatest way in the step's direction [counts].
    sign : float
        Of the step.
    seen : float
        Position [counts].

    Returns
    -------
    float
        The new greatest way.
    """
    # abs() changes nothing, as in `follow`.
    return abs(max(far, sign * seen))


@kernel
def follow(
    p: Task,
    s: Course,
    number: float,
    seen: float,
    error: float,
    last: float,
    asked: float,
    sent: float,
) -> Course:
    """Take one more sample.

    Parameters
    ----------
    p : Task
        How the step is judged.
    s : Course
        Before it.
    number : float
        Of the sample, from 1.
    seen, error, last : float
        Position, its error, and the error of the sample before [counts].
    asked, sent : float
        Effort without and with its limit [V].

    Returns
    -------
    Course
        After it.
    """
    far = farther(s.far, p.sign, seen)
    went = last - error
    size = abs(error)
    turned = went * s.move
    begins = went if size <= ARRIVED else 0.0
    # abs() changes nothing, but keeps the compiler from storing by mask, for which the next
    # sample's load would have to wait.
    return Course(
        abs(number if size > p.band else s.outside),
        abs(number if far < p.risen else s.early),
        far,
        gathered(s.sum, error),
        abs(max(s.peak, abs(asked))),
        s.saturated + (1.0 if asked != sent else 0.0),
        s.turns + (1.0 if turned < 0.0 else 0.0),
        # Without a product, one of the two is 0: it stands, or has not arrived before.
        went if turned != 0.0 else s.move + begins,
    )


@kernel
def first(s: Course) -> Course:
    """Correct the first sample, whose kick and whose move from nowhere do not count.

    Parameters
    ----------
    s : Course
        After it.

    Returns
    -------
    Course
        Without these.
    """
    return Course(s.outside, s.early, s.far, s.sum, 0.0, 0.0, 0.0, 0.0)


def measured(rows: Array, error: Array, target: Array, samples: int, dt: Array | float) -> Array:
    """Make metrics of what was gathered.

    Parameters
    ----------
    rows : ndarray, shape (8, n)
        As in `Course`.
    error : ndarray, shape (n,)
        At the end [counts].
    target : ndarray, shape (n,)
        Counts.
    samples : int
        In all.
    dt : ndarray, shape (n,), or float
        Sample time [s].

    Returns
    -------
    ndarray, shape (n, 8)
        The values of `METRICS`; NaN: not reached.
    """
    s = Course(*rows)
    out = np.empty((len(error), len(METRICS)))
    out[:, 0] = np.where(s.outside < samples, s.outside * dt, math.nan)
    out[:, 1] = np.where(s.early < samples, s.early * dt, math.nan)
    out[:, 2] = np.maximum(0.0, s.far - np.abs(target))
    out[:, 3] = s.sum * dt
    out[:, 4] = error
    out[:, 5:] = np.stack((s.peak, s.saturated, s.turns), axis=1)
    return out
