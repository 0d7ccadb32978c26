"""Covariance of least squares by a few witnesses, and how many their number is worth.

What a model leaves out is alike within a witness (a stroke, say), so each counts once. Some tell
far more of a parameter than others: their residuals are the smaller for it, and a sum of squares
in which a few are nearly all is worth few degrees of freedom (R. Bell, D. McCaffrey, Bias reduction
in standard errors for linear regression with multi-stage samples, Survey Methodology, 2002).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.identify.coverage import SHARES

_LEAST = 1e-6  # of what a witness leaves unfitted
_FLAT = 1e-12  # of what is told of the best known combination


class Told(NamedTuple):
    """What witnesses tell of the errors.

    Attributes
    ----------
    covariance : ndarray, shape (p, p)
        Of the parameters.
    freedom : ndarray, shape (p,)
        Degrees of freedom of their standard errors.
    """

    covariance: Array
    freedom: Array


def told(information: Array, scores: Array) -> Told:
    """Covariance and degrees of freedom of parameters by least squares.

    Parameters
    ----------
    information : ndarray, shape (k, p, p)
        J'J of each witness.
    scores : ndarray, shape (k, p)
        J'e of each, e the residuals.

    Returns
    -------
    Told
        The covariance is without bias where what is left out moves a witness as a whole, as much as
        it moves any other.
    """
    total = information.sum(axis=0)
    unit = np.sqrt(np.diag(total))
    unit = np.where(unit > 0.0, unit, 1.0)
    power, turned = np.linalg.eigh(total / np.outer(unit, unit))
    # What no witness tells of keeps an error that is large, but a number.
    back = (turned / np.sqrt(np.maximum(power, _FLAT * max(power[-1], _FLAT)))).T / unit
    shares = back @ information @ back.T  # of all that is told, by each
    sizes, turns = np.linalg.eigh(shares)
    grown = 1.0 / np.sqrt(np.maximum(1.0 - sizes, _LEAST))
    own = np.einsum(
        "kij,kj->ki", (turns * grown[:, None, :]) @ turns.transpose(0, 2, 1), scores @ back.T
    )
    parts = own @ back  # of each witness in each parameter's error
    weights = np.diagonal(back.T @ shares @ back, axis1=1, axis2=2) ** 2
    spread = (weights**2).sum(axis=0)
    freedom = np.where(
        spread > 0.0, weights.sum(axis=0) ** 2 / np.where(spread > 0.0, spread, 1.0), 1.0
    )
    return Told(np.asarray(parts.T @ parts), np.asarray(freedom))


def within(degrees: float) -> float:
    """Half of a 95 % interval, in standard errors that are worth so many degrees of freedom.

    Parameters
    ----------
    degrees : float
        Infinite of an error that is known.

    Returns
    -------
    float
        Quantile of Student's t.
    """
    from scipy.stats import t

    return float(t.ppf(0.5 + 0.5 * SHARES[1], degrees))


def freedom(parts: Sequence[tuple[float, float]]) -> float:
    """Degrees of freedom of the root of a sum of squares (Welch 1947, Satterthwaite 1946).

    Parameters
    ----------
    parts : Sequence[tuple[float, float]]
        Standard error and its degrees of freedom, of each.

    Returns
    -------
    float
        Infinite where nothing is uncertain.
    """
    total = sum(error**2 for error, _ in parts) ** 2
    lost = sum(error**4 / degrees for error, degrees in parts)
    return total / lost if lost > 0.0 else float("inf")
