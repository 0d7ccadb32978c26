"""Covariance of least squares by a few clusters, and its degrees of freedom."""

# The model error is shared within a cluster (a stroke, say), so each counts once. A sum of squares
# dominated by a few clusters has few degrees of freedom (R. Bell, D. McCaffrey, Bias reduction in
# standard errors for linear regression with multi-stage samples, Survey Methodology, 2002).

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.identify.coverage import NORMAL, SHARES

_LEAST = 1e-6  # of what a witness leaves unfitted
_FLAT = 1e-12  # of what is told of the best known combination


class Told(NamedTuple):
    covariance: Array  # of the parameters
    freedom: Array  # degrees of freedom of their standard errors
    # of each cluster: its part of the parameters' covariance, were all errors independent
    shares: Array


def told(information: Array, scores: Array) -> Told:
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
    shares = np.asarray(back.T @ shares @ back)
    return Told(np.asarray(parts.T @ parts), degrees(shares, np.eye(len(back))), shares)


def degrees(shares: Array, slopes: Array) -> Array:
    """Degrees of freedom of functions of the parameters, to first order."""
    weights = np.einsum("ij,kjl,il->ki", slopes, shares, slopes) ** 2
    spread = (weights**2).sum(axis=0)
    return np.where(
        spread > 0.0, weights.sum(axis=0) ** 2 / np.where(spread > 0.0, spread, 1.0), 1.0
    )


def factors(shares: Array | None, slopes: Array) -> Array:
    """Student's coverage factors of functions of the parameters for 68 and 95 %, (2, m)."""
    if shares is None:
        return np.repeat(np.array(NORMAL)[:, None], len(slopes), axis=1)
    from scipy.stats import t

    held = 0.5 + 0.5 * np.array(SHARES)
    return np.asarray(t.ppf(held[:, None], degrees(shares, slopes)))


def within(degrees: float) -> float:
    """Half of a 95 % interval in standard errors, for some degrees of freedom."""
    from scipy.stats import t

    return float(t.ppf(0.5 + 0.5 * SHARES[1], degrees))


def freedom(parts: Sequence[tuple[float, float]]) -> float:
    """Degrees of freedom of the root of a sum of squares (Welch 1947, Satterthwaite 1946)."""
    total = sum(error**2 for error, _ in parts) ** 2
    lost = sum(error**4 / degrees for error, degrees in parts)
    return total / lost if lost > 0.0 else float("inf")
