"""How sure a sprung drive's parameters are where forces disturb it.

A disturbing force moves the mass for as long as it swings, so what is left of the output is neither
white nor steady. The force that would account for it is taken apart (`force_noise`) and drawn anew:
the scatter of what free runs under drawn forces ask for is the covariance (a parametric bootstrap,
B. Efron, R. Tibshirani, An Introduction to the Bootstrap, chapter 6, with one Gauss-Newton step for
each refit).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.identify import counts
from macromicro.identify.force_noise import Shown, binned, drawn, levels
from macromicro.identify.ripple import Ripple, ripple
from macromicro.identify.runs import Run
from macromicro.identify.sprung import Sprung, simulate
from macromicro.identify.sprung_search import End

_BLOCKS = 20.0  # in a swing, or in 2 pi time constants
_LEAST = 100  # blocks in a record
_APART = 0.3  # of the samples: more are no reversals
_STANDS = 0.7  # of the samples: of a record that stands for longer the rest tells too little
_DRAWS, _PHASES = 80, 160  # of noise; of a force that repeats, whose distribution counts, too


class Means(NamedTuple):
    """A record's residuals and slopes in blocks.

    Attributes
    ----------
    residual : ndarray, shape (m,)
        Means of the residual.
    slopes : ndarray, shape (m, p)
        Means of the slopes.
    """

    residual: Array
    slopes: Array


class Scattered(NamedTuple):
    """How drawn forces and noise scatter the parameters.

    Attributes
    ----------
    covariance : ndarray, shape (p, p)
        Of the parameters.
    draws : ndarray, shape (n, p), or None
        Their errors as drawn, where a cause is known that makes them other than normal.
    repeats : Ripple or None
        A force that repeats along the way, where most of what disturbs does.
    """

    covariance: Array
    draws: Array | None
    repeats: Ripple | None = None


def blocks(records: Sequence[Run], best: End, used: npt.NDArray[np.intp]) -> list[Means]:
    """Residuals and slopes as means over blocks.

    Parameters
    ----------
    records : Sequence[Run]
        The records.
    best : End
        Where the search ended.
    used : ndarray of int, shape (p,)
        Columns of its slopes.

    Returns
    -------
    list[Means]
        One per record.
    """
    p, found, at = best.axis, [], 0
    turn = 1.0 / p.frequency if p.frequency > 0.0 else np.inf
    fall = 2.0 * np.pi * p.mass / p.viscous if p.viscous > 0.0 else np.inf
    for r in records:
        n = len(r.x)
        q = int(min(max(min(turn, fall) / r.dt / _BLOCKS, 1.0), max(n // _LEAST, 1)))
        rows = slice(at, at + n // q * q)
        slopes = best.slopes[rows][:, used].reshape(-1, q, len(used)).mean(axis=1)
        found.append(Means(best.residual[rows].reshape(-1, q).mean(axis=1), slopes))
        at += n
    return found


def scattered(
    records: Sequence[Run],
    best: End,
    used: npt.NDArray[np.intp],
    lag: float,
    *,
    speed: bool,
) -> Scattered:
    """Covariance by drawn forces and noise of the sensor.

    A force that repeats along the way is drawn in any phase.

    Parameters
    ----------
    records : Sequence[Run]
        The records, u a force.
    best : End
        Where the search ended.
    used : ndarray of int, shape (p,)
        Columns of its slopes that move anything.
    lag : float
        Time by which the force acts late, s.
    speed : bool
        Whether the output is the speed.

    Returns
    -------
    Scattered
        Of these columns.
    """
    residuals = parted(records, best.residual)
    slopes = best.slopes[:, used]
    pushed = [
        _pushed(r, np.column_stack([part, e]), best.axis, speed)
        for r, part, e in zip(records, parted(records, slopes), residuals, strict=True)
    ]
    cog = None
    if not speed:
        told_by = [_telling(r, e) for r, e in zip(records, residuals, strict=True)]
        cog = _repeated(records, pushed, told_by)
        if cog is not None:
            pushed = [_rest(*each, cog) for each in zip(records, pushed, told_by, strict=True)]
    shown = [_shown(r, w, best.axis, speed) for r, w in zip(records, pushed, strict=True)]
    draws = _DRAWS if cog is None else _PHASES
    told = levels(shown, draws, max(len(r.x) * r.dt for r in records), records[0].dt)
    phases = 2.0 * np.pi * counts.places(len(records), draws)
    random = np.random.default_rng(0)  # the same data give the same errors
    starts = best.starts.tolist()
    free = [r.x - e for r, e in zip(records, residuals, strict=True)]
    steps = [counts.pitch(r.x) for r in records]
    size = np.linalg.norm(slopes, axis=0)
    back = np.linalg.pinv(slopes / size)
    asked = []
    for level, turned in zip(told, phases, strict=True):
        errors = []
        for r, (x, v), y, step, phase in zip(records, starts, free, steps, turned, strict=True):
            push = r.u + drawn(level, len(r.u), r.dt, random)
            if cog is not None:
                push += cog.at(y, float(phase))
            moved = simulate(best.axis, push, r.dt, x, v, lag)[int(speed)]
            errors.append(moved - y + counts.noise(moved, level.sensor, step, random))
        asked.append((back @ np.concatenate(errors)) / size)
    scatter = np.array(asked)
    count = len(best.residual)
    found = np.asarray(scatter.T @ scatter / draws * count / max(count - len(used), 1))
    return Scattered(found, None if cog is None else scatter, cog)


def parted(records: Sequence[Run], rows: Array) -> list[Array]:
    """What stands for all records in a row, of each one.

    Parameters
    ----------
    records : Sequence[Run]
        The records.
    rows : ndarray, shape (n,)
        A value per sample of all records.

    Returns
    -------
    list[ndarray]
        One per record.
    """
    return np.split(rows, np.cumsum([len(r.x) for r in records])[:-1])


def _repeated(
    records: Sequence[Run], pushed: list[Array], told_by: list[npt.NDArray[np.bool_]]
) -> Ripple | None:
    """A force that repeats along the way, in what is left where it tells one."""
    every = list(zip(records, pushed, told_by, strict=True))
    places = [r.x[1:-1][at] for r, _, at in every]
    return ripple([w[at, -1] for _, w, at in every], places, [w[at, :-1] for _, w, at in every])


def _pushed(r: Run, every: Array, p: Sprung, speed: bool) -> Array:
    """The force that would account for columns of positions or speeds, shape (n - 2, p + 1)."""
    h = r.dt
    bend, slope = p.mass / (h * h), 0.5 * p.viscous / h
    before, now, after = every[:-2], every[1:-1], every[2:]
    if speed:
        rate = 0.5 * p.mass / h
        fallen = np.cumsum(every, axis=0)[1:-1] - 0.5 * now  # the place, by the trapezoidal rule
        return np.asarray(rate * (after - before) + p.viscous * now + p.spring * h * fallen)
    return np.asarray(
        (bend - slope) * before + (p.spring - 2.0 * bend) * now + (bend + slope) * after
    )


def _telling(r: Run, residual: Array) -> npt.NDArray[np.bool_]:
    """Where what is left tells a force: shape (n - 2,).

    Reversals of record and free run are a few samples apart, and friction between them is what a
    disturbance did, not what it was; of a reversal itself no sample says when within it friction
    changed its sign. Where both stand, friction balances whatever there is.
    """
    ways = [np.sign(np.gradient(x)) for x in (r.x, r.x - residual)]
    doubt = ways[0] != ways[1]
    for way in ways:
        doubt |= np.diff(way, prepend=way[0]) != 0.0
    apart = np.convolve(doubt, np.ones(5), "same") > 0.0
    if apart[1:-1].mean() >= _APART:
        apart[:] = False
    told = ~(apart | (ways[1] == 0.0))[1:-1]
    return np.asarray(told if told.mean() > 1.0 - _STANDS else np.ones_like(told))


def _rest(r: Run, pushed: Array, told: npt.NDArray[np.bool_], cog: Ripple) -> Array:
    """Forces without one that repeats; what is left around it stands where they tell none."""
    left = pushed.copy()
    left[:, -1] -= cog.at(r.x[1:-1])
    at = np.arange(len(left))
    return np.stack([np.interp(at, at[told], column[told]) for column in left.T], axis=1)


def _shown(r: Run, pushed: Array, p: Sprung, speed: bool) -> Shown:
    """Periodogram of the force that would account for a residual, and what it answers to.

    A force held for a sample moves the second difference of a position by the mean of two forces,
    so |K| = cos(pi f dt); likewise the difference of a speed over two samples.

    Parameters
    ----------
    r : Run
        The record.
    pushed : ndarray, shape (n, p + 1)
        Forces that would account for slopes of the residual, and for the residual.
    p : Sprung
        As found.
    speed : bool
        Whether the output is the speed.

    Returns
    -------
    Shown
        Of this record.
    """
    h, n = r.dt, len(pushed)
    turn = 2.0 * np.pi * np.arange(n // 2 + 1) / n
    bend, slope = p.mass / (h * h), 0.5 * p.viscous / h
    if speed:
        placed = 0.5 * p.spring * h / np.tan(0.5 * np.maximum(turn, turn[1]))
        response = p.viscous + 1j * (p.mass / h * np.sin(turn) - placed)
    else:
        response = p.spring - 2.0 * bend * (1.0 - np.cos(turn)) + 2j * slope * np.sin(turn)
    return binned(pushed[:, -1], h, np.cos(0.5 * turn) ** 2, np.abs(response) ** 2, pushed[:, :-1])
