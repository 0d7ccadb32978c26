"""Errors of a sprung drive under disturbing forces.

Residuals of an oscillator are neither white nor steady. The force that explains them is modelled
(`force_noise`) and drawn: a parametric bootstrap (B. Efron, R. Tibshirani, An Introduction to the
Bootstrap, chapter 6, with one Gauss-Newton step per refit).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.identify import _counts
from macromicro.identify._force_noise import Shown, binned, drawn, levels
from macromicro.identify._ripple import Ripple, ripple
from macromicro.identify._sprung_search import End
from macromicro.identify.runs import Run
from macromicro.identify.sprung import Sprung, simulate

_BLOCKS = 20.0  # in a swing, or in 2 pi time constants
_LEAST = 100  # blocks in a record
_APART = 0.3  # of the samples: more are no reversals
_STANDS = 0.7  # of the samples: of a record that stands for longer the rest tells too little
_DRAWS, _PHASES = 80, 160  # of noise; of a force that repeats, whose distribution counts, too


class Means(NamedTuple):
    """Residuals and slopes of a record in blocks."""

    residual: Array  # means of the residual
    slopes: Array  # means of the slopes


class Scattered(NamedTuple):
    covariance: Array  # of the parameters
    # their errors as drawn, where a cause is known that makes them other than normal
    draws: Array | None
    # A force that repeats along the way, where most of what disturbs does
    repeats: Ripple | None = None


def blocks(records: Sequence[Run], best: End, used: npt.NDArray[np.intp]) -> list[Means]:
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
    """Covariance by drawn forces, periodic ones in any phase, and sensor noise."""
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
    phases = 2.0 * np.pi * _counts.places(len(records), draws)
    random = np.random.default_rng(0)  # the same data give the same errors
    starts = best.starts.tolist()
    free = [r.x - e for r, e in zip(records, residuals, strict=True)]
    steps = [_counts.pitch(r.x) for r in records]
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
            errors.append(moved - y + _counts.noise(moved, level.sensor, step, random))
        asked.append((back @ np.concatenate(errors)) / size)
    scatter = np.array(asked)
    count = len(best.residual)
    found = np.asarray(scatter.T @ scatter / draws * count / max(count - len(used), 1))
    return Scattered(found, None if cog is None else scatter, cog)


def parted(records: Sequence[Run], rows: Array) -> list[Array]:
    return np.split(rows, np.cumsum([len(r.x) for r in records])[:-1])


def _repeated(
    records: Sequence[Run], pushed: list[Array], told_by: list[npt.NDArray[np.bool_]]
) -> Ripple | None:
    """A periodic force in the residual."""
    every = list(zip(records, pushed, told_by, strict=True))
    places = [r.x[1:-1][at] for r, _, at in every]
    return ripple([w[at, -1] for _, w, at in every], places, [w[at, :-1] for _, w, at in every])


def _pushed(r: Run, every: Array, p: Sprung, speed: bool) -> Array:
    """Force that explains columns of positions or speeds, shape (n - 2, p + 1)."""
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
    """Rows where the residual determines a force, shape (n - 2,)."""
    # Between the reversals of record and free simulation friction differs, and at a reversal its
    # change of sign has no known time; where both stand, friction balances any force.
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
    """Forces less the periodic one where they are known, else interpolated."""
    left = pushed.copy()
    left[:, -1] -= cog.at(r.x[1:-1])
    at = np.arange(len(left))
    return np.stack([np.interp(at, at[told], column[told]) for column in left.T], axis=1)


def _shown(r: Run, pushed: Array, p: Sprung, speed: bool) -> Shown:
    """Periodogram of the force that explains a residual, and the responses."""
    # A held force moves the second difference of a position by the mean of two forces, so |K| =
    # cos(pi f dt); likewise the difference of a speed over two samples.
    h, n = r.dt, len(pushed)
    turn = 2.0 * np.pi * np.arange(n // 2 + 1) / n
    bend, slope = p.mass / (h * h), 0.5 * p.viscous / h
    if speed:
        placed = 0.5 * p.spring * h / np.tan(0.5 * np.maximum(turn, turn[1]))
        response = p.viscous + 1j * (p.mass / h * np.sin(turn) - placed)
    else:
        response = p.spring - 2.0 * bend * (1.0 - np.cos(turn)) + 2j * slope * np.sin(turn)
    return binned(pushed[:, -1], h, np.cos(0.5 * turn) ** 2, np.abs(response) ** 2, pushed[:, :-1])
