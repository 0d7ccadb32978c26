"""scipy's least squares, which ends at its best point when the user asks for an end."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import numpy as np

from macromicro.arrays import Array

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
