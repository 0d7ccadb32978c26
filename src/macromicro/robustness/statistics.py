"""Shares with confidence intervals, quantiles and rank correlation."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array

CONFIDENCE = 0.95
LEAST = 10  # rows for a rank correlation


class Share(NamedTuple):
    """A share with bounds of the true one; NaN if there are none."""

    # passed, total: so many of how many
    passed: int
    total: int
    # share, low, high: From 0 to 1
    share: float
    low: float
    high: float


def share(passed: int, total: int) -> Share:
    """A share with its exact Clopper-Pearson interval."""
    from scipy.stats import binomtest

    if not 0 <= passed <= total:
        raise ValueError(f"{passed} of {total}")
    if total == 0:
        return Share(0, 0, math.nan, math.nan, math.nan)
    low, high = binomtest(passed, total).proportion_ci(CONFIDENCE, method="exact")
    return Share(passed, total, passed / total, float(low), float(high))


LEVELS = (0.05, 0.25, 0.5, 0.75, 0.95)


class Spread(NamedTuple):
    known: int  # rows that have it
    never: int  # those of them where it is infinite (never settled)
    least: float  # of those that have it, infinity where one is
    # of these at `LEVELS`; a row that is infinite is worse than any other
    quantiles: tuple[float, ...]
    most: float  # NaN if there are none


def spread(values: Array) -> Spread:
    known = np.sort(values[~np.isnan(values)])
    never = int(np.isposinf(known).sum())
    if not len(known):
        nan = math.nan
        return Spread(0, 0, nan, (nan,) * len(LEVELS), nan)
    quantiles = tuple(_quantile(known, level) for level in LEVELS)
    return Spread(len(known), never, float(known[0]), quantiles, float(known[-1]))


def _quantile(known: Array, level: float) -> float:
    """As in numpy, and infinite as soon as an infinite row contributes."""
    place = level * (len(known) - 1)
    low, high = (float(known[k]) for k in (math.floor(place), math.ceil(place)))
    return high if low == high or math.isinf(high) else low + (place % 1.0) * (high - low)


class Rank(NamedTuple):
    """A rank correlation; NaN if undefined."""

    value: float  # from -1 to 1
    p: float  # how often chance alone gives one as large

    def significant(self, of: int = 1) -> bool:
        """Whether it exceeds the largest of `of` random correlations."""
        return self.p * of < 1.0 - CONFIDENCE


def rank_correlation(x: Array, y: Array) -> Rank:
    """Spearman's rank correlation of the rows where `y` is known; infinity ranks highest."""
    from scipy.stats import rankdata, spearmanr

    known = ~np.isnan(y)
    a, b = rankdata(x[known]), rankdata(y[known])
    if known.sum() < LEAST or a[0] == a.mean() == a.max() or b[0] == b.mean() == b.max():
        return Rank(math.nan, math.nan)
    found = spearmanr(a, b)
    return Rank(float(found.statistic), float(found.pvalue))
