"""Covariance of least squares by a few clusters, and its degrees of freedom."""

# The model error is shared within a cluster (a stroke, say), so each counts once. A sum of squares
# dominated by a few clusters has few degrees of freedom (R. Bell, D. McCaffrey, Bias reduction in
# standard errors for linear regression with multi-stage samples, Survey Methodology, 2002).

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.identify.coverage import SHARES

_LEAST = 1e-6  # of what a witness leaves unfitted
_FLAT = 1e-12  # of what is told of the best known combination


class Told(NamedTuple):
    covariance: Array  # of the parameters
    freedom: Array  # degrees of freedom of their standard errors


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
    weights = np.diagonal(back.T @ shares @ back, axis1=1, axis2=2) ** 2
    spread = (weights**2).sum(axis=0)
    freedom = np.where(
        spread > 0.0, weights.sum(axis=0) ** 2 / np.where(spread > 0.0, spread, 1.0), 1.0
    )
    return Told(np.asarray(parts.T @ parts), np.asarray(freedom))


def within(degrees: float) -> float:
    """Half of a 95 % interval in standard errors, for some degrees of freedom."""
    from scipy.stats import t

    return float(t.ppf(0.5 + 0.5 * SHARES[1], degrees))


def freedom(parts: Sequence[tuple[float, float]]) -> float:
    """Degrees of freedom of the root of a sum of squares (Welch 1947, Satterthwaite 1946)."""
    total = sum(error**2 for error, _ in parts) ** 2
    lost = sum(error**4 / degrees for error, degrees in parts)
    return total / lost if lost > 0.0 else float("inf")
