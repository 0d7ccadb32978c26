"""Metrics of a macro-stage's step response, accumulated sample by sample.

The same code serves a single run and a lane of many: `follow` has no branch that vector
registers cannot take.
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
    Metric("settling_time", "s", "time from which the error stays within 2 % of the step"),
    Metric("rise_time", "s", "time of the first 98 % of the step"),
    Metric("overshoot", "count", "largest distance beyond the target"),
    Metric("iae", "count*s", "integral of the absolute error"),
    Metric("final_error", "count", "target minus position at the end"),
    Metric("peak_effort", "V", "largest requested effort after the first sample"),
    Metric("saturated", "", "saturated samples after the first"),
    Metric("reversals", "", "reversals of the position after it is within 2 counts of the target"),
)


class Task(NamedTuple):
    """How a step is judged."""

    sign: float  # of the step
    band: float  # of the error [counts]
    risen: float  # least way [counts], whole, that has the share `RISEN` of the step behind it


class Course(NamedTuple):
    # outside, early: samples up to the last one outside the band, and before it has risen
    outside: float
    early: float
    far: float  # greatest way in the step's direction [counts], at least 0
    sum: float  # of |error| [counts]
    peak: float  # largest |effort| asked for [V]
    # saturated, turns: samples with a cut effort, and turns of the position
    saturated: float
    turns: float
    move: float  # the last one [counts], 0: none


def task(target: float) -> Task:
    """How a step from 0 is judged."""
    size, sign = abs(target), math.copysign(1.0, target)
    risen = math.floor(RISEN * size) - 1.0
    while risen / size < RISEN:
        risen += 1.0
    return Task(sign, BAND * size, risen)


def begun() -> Course:
    return Course(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@kernel
def gathered(total: float, error: float) -> float:
    """Add one sample's error [counts]."""
    return total + abs(error)


@kernel
def farther(far: float, sign: float, seen: float) -> float:
    """Add one sample's position [counts]."""
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
    """Add one sample; positions and errors in counts."""
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
    """Correct the first sample, whose kick and jump do not count."""
    return Course(s.outside, s.early, s.far, s.sum, 0.0, 0.0, 0.0, 0.0)


def measured(rows: Array, error: Array, target: Array, samples: int, dt: Array | float) -> Array:
    """Metrics of the accumulated quantities; `error` in counts."""
    s = Course(*rows)
    out = np.empty((len(error), len(METRICS)))
    out[:, 0] = np.where(s.outside < samples, s.outside * dt, math.nan)
    out[:, 1] = np.where(s.early < samples, s.early * dt, math.nan)
    out[:, 2] = np.maximum(0.0, s.far - np.abs(target))
    out[:, 3] = s.sum * dt
    out[:, 4] = error
    out[:, 5:] = np.stack((s.peak, s.saturated, s.turns), axis=1)
    return out
