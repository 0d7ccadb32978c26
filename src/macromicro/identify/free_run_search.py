"""Least squares of free runs within bounds, from several begins."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.identify.central import central

Flags = npt.NDArray[np.bool_]
Missed = Callable[[Array], Array]  # free run less measured, (n,) of (p,)

SLOPE = 1e-3  # by which slopes are taken, of a value or of 1
END = 1e-3  # of a range: what is so near to its bound has reached it
_SETTLED = 1e-5


class Span(NamedTuple):
    """Where values may lie.

    Attributes
    ----------
    low, high : ndarray, shape (p,)
        Bounds.
    nudge : ndarray, shape (p,)
        Steps by which slopes are taken; 0 for a thousandth of a value, or of 1 where it is smaller.
    """

    low: Array
    high: Array
    nudge: Array


def search(missed: Missed, begin: Array, span: Span, rounds: int, settled: float = _SETTLED) -> Any:
    """The minimum next to a begin, by a trust region with slopes to both sides.

    Parameters
    ----------
    missed : Callable[[Array], Array]
        Free run less measured, shape (n,), of search values of shape (p,).
    begin : ndarray, shape (p,)
        Where.
    span : Span
        Bounds and steps.
    rounds : int
        Most evaluations beside those of the slopes.
    settled : float, optional
        Share of the cost and of the values by which a step changes no more.

    Returns
    -------
    OptimizeResult
        As of SciPy's `least_squares`; its status is 0 where it has not settled.
    """
    from scipy.optimize import least_squares

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
    """Where the best of short searches end.

    Parameters
    ----------
    missed : Callable[[Array], Array]
        As of `search`.
    begins : Iterable[Array]
        Where searches begin, each of shape (p,).
    span : Span
        Bounds and steps.
    rounds : int
        Of each search.
    keep : int
        How many are returned.

    Returns
    -------
    list[Array]
        The best first.
    """
    ends = [search(missed, z, span, rounds) for z in begins]
    ends.sort(key=lambda end: float(end.cost))
    return [end.x for end in ends[:keep]]


def slopes(made: Missed, z: Array, span: Span) -> Array:
    """Slopes by differences to both sides.

    Parameters
    ----------
    made : Callable[[Array], Array]
        Shape (n,) of shape (p,).
    z : ndarray, shape (p,)
        Where.
    span : Span
        Bounds and steps.

    Returns
    -------
    ndarray, shape (n, p)
        Jacobian.
    """
    nudge = np.where(span.nudge > 0.0, span.nudge, SLOPE * np.maximum(1.0, np.abs(z)))
    return central(made, z, nudge, span.low, span.high)


def ended(z: Array, low: Array, high: Array, within: Array | None = None) -> tuple[Flags, Flags]:
    """Which values a search left at a bound.

    Parameters
    ----------
    z : ndarray, shape (p,)
        Where it ended.
    low, high : ndarray, shape (p,)
        Bounds.
    within : ndarray, shape (p,), optional
        A thousandth of this is near; None: the range between the bounds.

    Returns
    -------
    least, most : ndarray of bool, shape (p,)
        Those at the lower, and at the upper.
    """
    width = END * (high - low if within is None else within)
    return z <= low + width, z >= high - width
