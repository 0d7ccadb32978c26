"""Coverage factors: within how many standard errors of an estimate the truth lies, and how often.

An interval that holds 95 % of the errors is a standard error wide times a coverage factor (JCGM
100:2008, 2.3.6): 1.96 where they are normal. Errors that go with the phase of one harmonic have the
distribution of an arcsine, and 1.41 hold 95 % of them; those that go with a place within a count
that of a rectangle, and 1.65. Where errors are drawn, the draws tell (JCGM 101:2008, 7.7).
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
    """Errors of parameters that were drawn.

    Attributes
    ----------
    covariance : ndarray, shape (p, p)
        Of the parameters.
    draws : ndarray, shape (n, p)
        Their errors, a row for each draw.
    """

    covariance: Array
    draws: Array


def normal(covariance: Array, count: int, random: np.random.Generator) -> Array:
    """Normal errors of parameters, whatever their units.

    Parameters
    ----------
    covariance : ndarray, shape (p, p)
        Theirs.
    count : int
        Draws.
    random : np.random.Generator
        Draws.

    Returns
    -------
    ndarray, shape (count, p)
        A row for each draw.
    """
    size = np.sqrt(np.diag(covariance))
    size[size == 0.0] = 1.0
    power, turned = np.linalg.eigh(covariance / np.outer(size, size))
    root = turned * np.sqrt(np.maximum(power, 0.0)) * size[:, None]
    return np.asarray(random.standard_normal((count, len(size))) @ root.T)


def factors(draws: Array | None, slopes: Array) -> Array:
    """Coverage factors of what follows from parameters, to first order.

    Parameters
    ----------
    draws : ndarray, shape (n, p), or None
        Errors of the parameters as they scatter, of any size; None where they are normal.
    slopes : ndarray, shape (q, p)
        Of what follows, by the parameters; a unit matrix for these themselves.

    Returns
    -------
    ndarray, shape (2, q)
        Standard errors to each side that hold `SHARES` of the errors.
    """
    normal = np.repeat(np.array(NORMAL)[:, None], len(slopes), axis=1)
    if draws is None:
        return normal
    draws = draws @ slopes.T
    size = np.sqrt(np.mean(draws**2, axis=0))
    held = np.quantile(np.abs(draws), SHARES, axis=0)
    told = np.isfinite(size) & (size > 0.0)
    return np.where(told, held / np.where(told, size, 1.0), normal)


def positive(value: float, error: float, draws: Array | None) -> Array:
    """Coverage factors of a parameter that is positive and not sure to a few percent.

    Errors of its logarithm are taken for normal, or as they are drawn: it may be twice or half what
    was found, but not less than nothing.

    Parameters
    ----------
    value : float
        As found.
    error : float
        Standard error, to first order.
    draws : ndarray, shape (n,), or None
        Errors as they scatter, to first order; None where they are normal.

    Returns
    -------
    ndarray, shape (2,)
        Standard errors to each side that hold `SHARES` of the errors.
    """
    from scipy.special import ndtri

    if not (math.isfinite(error) and error > 0.0 and value > 0.0):
        return np.array(NORMAL)
    if draws is None:
        draws = error * ndtri((np.arange(_POINTS) + 0.5) / _POINTS)
    ratio = np.clip(draws / value, -_MOST, _MOST)
    held = np.quantile(np.abs(np.expm1(ratio)), SHARES)
    return np.asarray(held * value / error)


def errors(covariance: Array, slopes: Array) -> Array:
    """Standard errors of what follows from parameters, to first order.

    Parameters
    ----------
    covariance : ndarray, shape (p, p)
        Of the parameters.
    slopes : ndarray, shape (q, p)
        As in `factors`; parameters that do not count have no error.

    Returns
    -------
    ndarray, shape (q,)
        NaN where an error is not known.
    """
    found = []
    for row in slopes:
        at = np.flatnonzero(row)
        variance = float(row[at] @ covariance[np.ix_(at, at)] @ row[at])
        found.append(math.sqrt(variance) if variance >= 0.0 else math.nan)
    return np.array(found)


def is_normal(factor: float) -> bool:
    """Whether a factor of 95 % is that of normal errors, as far as draws can tell.

    Parameters
    ----------
    factor : float
        Standard errors to each side.

    Returns
    -------
    bool
        Then a page need not tell the interval beside the error.
    """
    return math.isnan(factor) or abs(factor / NORMAL[1] - 1.0) <= _AS_NORMAL
