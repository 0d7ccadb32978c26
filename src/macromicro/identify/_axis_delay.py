"""Delay of a drive's force, by inverse dynamics and by output error."""

# Under disturbing forces inverse dynamics is ten times as accurate as a free simulation, which
# accumulates them; under position noise it is the reverse. The more accurate result is used.

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from macromicro.arrays import Array
from macromicro.identify._axis_refine import refined
from macromicro.identify._spread import robust_covariance
from macromicro.identify.axis import late
from macromicro.identify.axis_inverse import HELD, STRUCTURES, Estimate, Rows, columns, evened

LATEST = 1000  # samples
_EARLY = 12  # samples by which delays are tried one by one
_PART = 10  # a delay is at most so small a part of the shortest record
ABOUT = "coulomb"  # the friction that a delay is searched by
_ROUNDS, _HALF = 5, 0.5  # of the search for parts of a sample, and its differences, samples


def shifted(force: Array, samples: int) -> Array:
    """A held force delayed by whole samples, or advanced if negative."""
    if samples >= 0:
        return late(force, samples)
    return np.concatenate([force[-samples:], np.full(min(-samples, len(force)), force[-1])])


def delay(rows: list[Rows], least: int = 0) -> int:
    """The delay with the smallest residual force, by a coarse search and its neighbours."""
    most = min(LATEST, min(len(r.v) for r in rows) // _PART)
    tried = [*range(least, min(_EARLY, most) + 1)]
    while tried[-1] < most:
        tried.append(min(tried[-1] + tried[-1] // 4, most))
    best = _best(rows, tried)
    at = tried.index(best)
    low, high = tried[max(at - 1, 0)], tried[min(at + 1, len(tried) - 1)]
    return _best(rows, range(low, high + 1))


def _best(rows: list[Rows], tried: Iterable[int]) -> int:
    parts = [columns(r, STRUCTURES[ABOUT], 1.0, forced=False) for r in rows]
    basis = np.linalg.qr(np.concatenate(parts))[0]

    def left(samples: int) -> float:
        moved = [r._replace(force=shifted(r.force, samples)) for r in rows]
        force = np.concatenate(_forces(moved, 0.0))
        whole = float(force @ force)
        return float(np.sum((force - basis @ (basis.T @ force)) ** 2)) / (whole or 1.0)

    return min(tried, key=left)


def exact(rows: list[Rows], samples: int) -> tuple[float, float]:
    """A delay in fractions of a sample, with its standard error, by least squares of the force."""
    parts = [columns(r, STRUCTURES[ABOUT], 1.0, forced=False) for r in rows]
    found, spread = float(samples), np.nan
    for _ in range(_ROUNDS):
        before = min(found, _HALF)
        first, last = (_forces(rows, found + by) for by in (-before, _HALF))
        more = [(b - a) / (before + _HALF) for a, b in zip(first, last, strict=True)]
        table = np.concatenate([np.c_[p, -m] for p, m in zip(parts, more, strict=True)])
        force = np.concatenate(_forces(rows, found))
        theta = np.linalg.lstsq(table, force, rcond=None)[0]
        ends = np.cumsum([len(p) for p in parts])
        spread = robust_covariance(table, force - table @ theta, ends)[-1, -1]
        found = max(found + float(np.clip(theta[-1], -1.0, 1.0)), 0.0)
    return found, float(np.sqrt(spread))


def _forces(rows: list[Rows], samples: float) -> list[Array]:
    pushed = [late(r.force, HELD + samples) for r in rows]
    return [evened(r, [push], [True])[:, 0] for r, push in zip(rows, pushed, strict=True)]


def pushed(rows: list[Rows], lag: float) -> list[Rows]:
    return [r._replace(force=late(r.force, lag / r.run.dt)) for r in rows]


def under(
    made: Callable[[list[Rows]], Estimate], rows: list[Rows], lag: float, error: float
) -> Estimate:
    """An estimate at a given delay, its errors including that of the delay."""
    found, later = (made(pushed(rows, at)) for at in (lag, lag + error))
    moved = later.values - found.values
    covariance = found.covariance + np.outer(moved, moved)
    return replace(found, covariance=covariance, draws=None, sensed=False)


def refined_late(rows: list[Rows], start: Estimate, lag: float, error: float) -> Estimate:
    free = refined(rows, start, lag)
    if free.std[-1] <= error:
        return free
    found = under(lambda late_rows: refined(late_rows, start), rows, lag, error)
    names = (*found.names, "lag")
    covariance = np.zeros((len(names), len(names)))
    covariance[:-1, :-1] = found.covariance
    covariance[-1, -1] = error**2
    axis = found.axis._replace(lag=lag)
    return replace(found, axis=axis, names=names, covariance=covariance)
