"""The mechanical time constant of an axis, where strokes do not tell it.

A strongly damped axis answers as one that is late: of mass and lag, strokes tell little but the sum
of `mass / viscous` and `lag`. The mass that explains them best may then be one that no loop of this
period can be right for, or none at all.
"""

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
    """Parameters with a time constant that the period is short enough for, if strokes allow it.

    The likeliest ones under `mass >= feasible.PERIODS dt viscous`: what moves the mass moves lag
    and friction by what they have in common with it.

    Parameters
    ----------
    mean : ndarray, shape (p,)
        What strokes show.
    covariance : ndarray, shape (p, p)
        Of these.
    names : Sequence[str]
        Of these; with mass, viscous and lag.
    within : float
        Standard errors in half of an interval.
    dt : float
        Control period, s.

    Returns
    -------
    ndarray, shape (p,)
        As they are where they meet that, or where strokes tell that none do.
    """
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
    """Is the time constant one that strokes tell, not the shortest that the period allows?

    Parameters
    ----------
    axis : Axis
        As found.
    dt : float
        Control period, s.

    Returns
    -------
    bool
        False: the machine may be quicker.
    """
    return axis.mass > _MARGIN**2 * feasible.PERIODS * dt * axis.viscous
