"""Coverage factors: half-width of an interval with given probability, in standard errors.

JCGM 100:2008, 2.3.6, and JCGM 101:2008, 7.7. For 95 %: normal 1.96, arcsine (phase of a harmonic)
1.41, rectangle (offset within a count) 1.65.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array

SHARES = (0.6827, 0.95)  # that the intervals are to hold
NORMAL = (1.0, 1.96)  # standard errors to each side, of normal errors
_POINTS = 1000  # of a normal distribution
_MOST = math.log(1e3)  # no parameter is told to be a thousand times what was found, or more
_AS_NORMAL = 0.1  # of a factor: less than that draws may differ by chance


class Drawn(NamedTuple):
    covariance: Array  # of the parameters
    draws: Array  # their errors, a row for each draw


def normal(covariance: Array, count: int, random: np.random.Generator) -> Array:
    size = np.sqrt(np.diag(covariance))
    size[size == 0.0] = 1.0
    power, turned = np.linalg.eigh(covariance / np.outer(size, size))
    root = turned * np.sqrt(np.maximum(power, 0.0)) * size[:, None]
    return np.asarray(random.standard_normal((count, len(size))) @ root.T)


def factors(draws: Array | None, slopes: Array) -> Array:
    """Coverage factors of functions of the parameters, to first order."""
    normal = np.repeat(np.array(NORMAL)[:, None], len(slopes), axis=1)
    if draws is None:
        return normal
    draws = draws @ slopes.T
    size = np.sqrt(np.mean(draws**2, axis=0))
    held = np.quantile(np.abs(draws), SHARES, axis=0)
    told = np.isfinite(size) & (size > 0.0)
    return np.where(told, held / np.where(told, size, 1.0), normal)


def positive(value: float, error: float, draws: Array | None) -> Array:
    """Coverage factors of an uncertain positive parameter, by errors of its logarithm."""
    from scipy.special import ndtri

    if not (math.isfinite(error) and error > 0.0 and value > 0.0):
        return np.array(NORMAL)
    if draws is None:
        draws = error * ndtri((np.arange(_POINTS) + 0.5) / _POINTS)
    ratio = np.clip(draws / value, -_MOST, _MOST)
    held = np.quantile(np.abs(np.expm1(ratio)), SHARES)
    return np.asarray(held * value / error)


def errors(covariance: Array, slopes: Array) -> Array:
    found = []
    for row in slopes:
        at = np.flatnonzero(row)
        variance = float(row[at] @ covariance[np.ix_(at, at)] @ row[at])
        found.append(math.sqrt(variance) if variance >= 0.0 else math.nan)
    return np.array(found)


def is_normal(factor: float) -> bool:
    """Whether a 95 % factor is that of normal errors, within the resolution of draws."""
    return math.isnan(factor) or abs(factor / NORMAL[1] - 1.0) <= _AS_NORMAL
