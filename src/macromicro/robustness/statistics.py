"""Shares with confidence intervals, quantiles and rank correlation."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array

CONFIDENCE = 0.95
LEAST = 10  # rows for a rank correlation


class Share(NamedTuple):
    """A share and bounds of the true one; NaN for none of none.

    Attributes
    ----------
    passed, total : int
        So many of how many.
    share, low, high : float
        From 0 to 1.
    """

    passed: int
    total: int
    share: float
    low: float
    high: float


def share(passed: int, total: int, confidence: float = CONFIDENCE) -> Share:
    """Give a share with its Clopper-Pearson interval: exact, covers the true share at least so
    often.

    Parameters
    ----------
    passed, total : int
        So many of how many.
    confidence : float
        How often, from 0 to 1.

    Returns
    -------
    Share
        NaN for none of none.

    Raises
    ------
    ValueError
        Not 0 <= passed <= total.

    References
    ----------
    C. J. Clopper and E. S. Pearson, Biometrika 26 (1934) 404-413.
    """
    from scipy.stats import binomtest

    if not 0 <= passed <= total:
        raise ValueError(f"{passed} of {total}")
    if total == 0:
        return Share(0, 0, math.nan, math.nan, math.nan)
    low, high = binomtest(passed, total).proportion_ci(confidence, method="exact")
    return Share(passed, total, passed / total, float(low), float(high))


LEVELS = (0.05, 0.25, 0.5, 0.75, 0.95)


class Spread(NamedTuple):
    """How a metric is distributed over the sample.

    Attributes
    ----------
    known : int
        Rows that have it.
    never : int
        Those of them where it is infinite (never settled).
    least, most : float
        Of the finite ones; NaN if there are none.
    quantiles : tuple of float
        Of these at `LEVELS`.
    """

    known: int
    never: int
    least: float
    quantiles: tuple[float, ...]
    most: float


def spread(values: Array) -> Spread:
    """Tell how a metric is distributed.

    Parameters
    ----------
    values : ndarray, shape (n,)
        NaN: not known; infinity: never.

    Returns
    -------
    Spread
        Count, extremes and quantiles.
    """
    finite = values[np.isfinite(values)]
    never = int(np.isposinf(values).sum())
    if not len(finite):
        nan = math.nan
        return Spread(never, never, nan, (nan,) * len(LEVELS), nan)
    quantiles = tuple(float(q) for q in np.quantile(finite, LEVELS))
    return Spread(len(finite) + never, never, float(finite.min()), quantiles, float(finite.max()))


def rank_correlation(x: Array, y: Array) -> float:
    """Give Spearman's rank correlation of the rows where `y` is known; infinity ranks highest.

    Parameters
    ----------
    x, y : ndarray, shape (n,)
        Finite; NaN where it is not known.

    Returns
    -------
    float
        From -1 to 1; NaN for fewer than `LEAST` rows, or where one of them does not vary.
    """
    from scipy.stats import rankdata

    known = ~np.isnan(y)
    if known.sum() < LEAST:
        return math.nan
    a, b = rankdata(x[known]), rankdata(y[known])
    a, b = a - a.mean(), b - b.mean()
    scale = math.sqrt(float(a @ a) * float(b @ b))
    return float(a @ b) / scale if scale > 0.0 else math.nan
