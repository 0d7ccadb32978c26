"""Coverage factors: half-width of an interval with given probability, in standard errors.

JCGM 100:2008, 2.3.6. For 95 % of normal errors 1.96; of few independent ones more.
"""

from __future__ import annotations

import math

import numpy as np

from macromicro.arrays import Array

SHARES = (0.6827, 0.95)  # that the intervals are to hold
NORMAL = (1.0, 1.96)  # standard errors to each side, of normal errors
_AS_NORMAL = 0.1  # of a factor: less than that is alike


def normal(count: int) -> Array:
    """Factors of so many parameters with normal errors, shape (2, count)."""
    return np.repeat(np.array(NORMAL)[:, None], count, axis=1)


def errors(covariance: Array, slopes: Array) -> Array:
    found = []
    for row in slopes:
        at = np.flatnonzero(row)
        variance = float(row[at] @ covariance[np.ix_(at, at)] @ row[at])
        found.append(math.sqrt(variance) if variance >= 0.0 else math.nan)
    return np.array(found)


def is_normal(factor: float) -> bool:
    """Whether a 95 % factor is about that of normal errors."""
    return math.isnan(factor) or abs(factor / NORMAL[1] - 1.0) <= _AS_NORMAL
