"""Least squares: searches within bounds that the user can end, slopes, and long linear tables."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array

Flags = npt.NDArray[np.bool_]
Missed = Callable[[Array], Array]  # free run less measured, (n,) of (p,)

NUDGE = 1e-3  # by which slopes are taken, of a value or of 1
_SETTLED = 1e-5
_END = 1e-3  # of a range: what is so near to its bound has reached it
_ROWS = 100_000  # at a time: long tables are not copied as a whole

_wanted: ContextVar[Callable[[], object]] = ContextVar("wanted", default=lambda: False)


class _Ended(Exception):
    pass


@contextmanager
def until(wanted: Callable[[], object]) -> Iterator[None]:
    """Searches within end as soon as `wanted` returns true; later ones only judge their start."""
    before = _wanted.set(wanted)
    try:
        yield
    finally:
        _wanted.reset(before)


def halt(*_: object) -> None:
    """Callback of `scipy.optimize.minimize`: ends at the best point as soon as it is wanted."""
    if _wanted.get()():
        raise StopIteration


def least_squares(missed: Callable[[Array], Array], begin: Any, *given: Any, **options: Any) -> Any:
    """The result of `scipy.optimize.least_squares`; status 0 where the search was cut short."""
    from scipy.optimize import least_squares as solve

    wanted = _wanted.get()
    best, least = np.asarray(begin, dtype=float), np.inf

    def watched(at: Array) -> Array:
        nonlocal best, least
        if wanted():
            raise _Ended
        found = missed(at)
        if (cost := float(found @ found)) < least:
            best, least = at.copy(), cost
        return found

    try:
        return solve(watched, begin, *given, **options)
    except _Ended:
        return solve(missed, best, *given, **{**options, "max_nfev": 1})


class Bounds(NamedTuple):
    low: Array
    high: Array
    # steps by which slopes are taken; 0 for a thousandth of a value, or of 1 where it is smaller
    nudge: Array


def minimum(
    missed: Missed, begin: Array, bounds: Bounds, rounds: int, settled: float = _SETTLED
) -> Any:
    """The minimum next to a starting point, by a trust region with central differences."""
    return least_squares(
        missed,
        np.clip(begin, bounds.low + 1e-9, bounds.high - 1e-9),
        lambda z: slopes(missed, z, bounds),
        bounds=(bounds.low, bounds.high),
        x_scale="jac",
        ftol=settled,
        xtol=settled,
        max_nfev=rounds,
    )


def best(
    missed: Missed, begins: Iterable[Array], bounds: Bounds, rounds: int, keep: int
) -> list[Array]:
    """Where the best of several searches end, the best one first."""
    ends = [minimum(missed, z, bounds, rounds) for z in begins]
    ends.sort(key=lambda end: float(end.cost))
    return [end.x for end in ends[:keep]]


def slopes(made: Missed, z: Array, bounds: Bounds) -> Array:
    nudge = np.where(bounds.nudge > 0.0, bounds.nudge, NUDGE * np.maximum(1.0, np.abs(z)))
    return central(made, z, nudge, bounds.low, bounds.high)


def central(
    made: Missed,
    at: Array,
    nudge: Array,
    low: Array,
    high: Array,
    less: Missed = np.asarray,
    mapped: Callable[..., Iterable[Array]] = map,
) -> Array:
    """Central differences within bounds, of what `less` leaves of a change.

    `mapped` is `map`, or the same in threads.
    """
    columns = []
    for k in range(len(at)):
        up, down = at.copy(), at.copy()
        up[k], down[k] = min(at[k] + nudge[k], high[k]), max(at[k] - nudge[k], low[k])
        above, below = mapped(made, (up, down))
        columns.append(less(above - below) / (up[k] - down[k]))
    return np.stack(columns, axis=1)


def at_bounds(z: Array, bounds: Bounds, within: Array | None = None) -> tuple[Flags, Flags]:
    """Values at their lower and at their upper bound, by a share of a range."""
    width = _END * (bounds.high - bounds.low if within is None else within)
    return z <= bounds.low + width, z >= bounds.high - width


def solve_scaled(table: Array, right: Array) -> Array:
    """Least squares by columns of equal size; 0 for a column of zeros."""
    size = np.linalg.norm(table, axis=0)
    size[size == 0.0] = 1.0
    found = np.linalg.lstsq(table / size, right, rcond=None)[0]
    return np.asarray((found.T / size).T)


def triangle(tables: Iterable[Array]) -> Array:
    """R of a QR decomposition of stacked tables, computed stretch by stretch."""
    found: Array | None = None
    for table in tables:
        for stretch in stretches(table):
            both = stretch if found is None else np.concatenate([found, stretch])
            found = np.asarray(np.linalg.qr(both, mode="r"))
    assert found is not None
    return found


def stretches(table: Array) -> Iterator[Array]:
    for first in range(0, max(len(table), 1), _ROWS):
        yield table[first : first + _ROWS]
