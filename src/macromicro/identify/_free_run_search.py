"""Least squares of free simulations within bounds, from several starting points."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.identify._central import central
from macromicro.identify.search import least_squares

Flags = npt.NDArray[np.bool_]
Missed = Callable[[Array], Array]  # free run less measured, (n,) of (p,)

SLOPE = 1e-3  # by which slopes are taken, of a value or of 1
END = 1e-3  # of a range: what is so near to its bound has reached it
_SETTLED = 1e-5


class Span(NamedTuple):
    # low, high: bounds
    low: Array
    high: Array
    # steps by which slopes are taken; 0 for a thousandth of a value, or of 1 where it is smaller
    nudge: Array


def search(missed: Missed, begin: Array, span: Span, rounds: int, settled: float = _SETTLED) -> Any:
    """The minimum next to a starting point, by a trust region with central differences."""
    return least_squares(
        missed,
        np.clip(begin, span.low + 1e-9, span.high - 1e-9),
        lambda z: slopes(missed, z, span),
        bounds=(span.low, span.high),
        x_scale="jac",
        ftol=settled,
        xtol=settled,
        max_nfev=rounds,
    )


def nearest(
    missed: Missed, begins: Iterable[Array], span: Span, rounds: int, keep: int
) -> list[Array]:
    ends = [search(missed, z, span, rounds) for z in begins]
    ends.sort(key=lambda end: float(end.cost))
    return [end.x for end in ends[:keep]]


def slopes(made: Missed, z: Array, span: Span) -> Array:
    nudge = np.where(span.nudge > 0.0, span.nudge, SLOPE * np.maximum(1.0, np.abs(z)))
    return central(made, z, nudge, span.low, span.high)


def ended(z: Array, low: Array, high: Array, within: Array | None = None) -> tuple[Flags, Flags]:
    width = END * (high - low if within is None else within)
    return z <= low + width, z >= high - width
