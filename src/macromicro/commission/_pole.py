"""Mechanical time constant of an axis where strokes do not determine it."""

# With strong damping, strokes determine only the sum of `mass / viscous` and `lag`. The best mass
# may be too small for any loop at this period, or negative.

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from macromicro.arrays import Array
from macromicro.identify.axis import Axis
from macromicro.machines import feasible

_MARGIN = 1.001  # beyond the shortest time constant that is accepted, for rounding


def possible(
    mean: Array, covariance: Array, names: Sequence[str], within: float, dt: float
) -> Array:
    """Parameters with a feasible time constant for the period, if strokes allow it."""
    # The most likely ones under `mass >= feasible.PERIODS dt viscous`; lag and friction follow by
    # their covariance with the mass.
    mass, viscous, lag = (list(names).index(n) for n in ("mass", "viscous", "lag"))
    shortest = _MARGIN * feasible.PERIODS * dt
    missing = shortest * mean[viscous] - mean[mass]
    if missing <= 0.0:
        return mean
    slope = np.zeros(len(mean))
    slope[mass], slope[viscous] = 1.0, -shortest
    moved = covariance @ slope
    variance = float(slope @ moved)
    if variance <= 0.0 or missing > within * math.sqrt(variance):
        return mean
    found = mean + moved * (missing / variance)
    found[lag] = max(found[lag], 0.0)
    return np.asarray(found)


def told(axis: Axis, dt: float) -> bool:
    return axis.mass > _MARGIN**2 * feasible.PERIODS * dt * axis.viscous
