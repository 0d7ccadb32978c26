"""An eccentric load that turns, as people know it: how hard gravity pulls, and where it hangs."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np

from macromicro.arrays import Array
from macromicro.identify import coverage
from macromicro.identify.axis import Axis
from macromicro.identify.axis_inverse import ECCENTRIC

NAMES = ("unbalance", "hangs")


class Eccentric(NamedTuple):
    """A torque of unbalance sin(x - hangs) towards lower angles.

    Attributes
    ----------
    unbalance : float
        Greatest torque, N m.
    hangs : float
        Angle at which the load hangs, rad, from -pi to pi.
    """

    unbalance: float
    hangs: float


def of(axis: Axis) -> Eccentric:
    """What its sine and cosine are together.

    Parameters
    ----------
    axis : Axis
        The parameters.

    Returns
    -------
    Eccentric
        Without a torque it hangs at 0.
    """
    return Eccentric(math.hypot(axis.sine, axis.cosine), math.atan2(-axis.cosine, axis.sine))


class Known(Protocol):
    """What is known of an axis by any method."""

    @property
    def names(self) -> tuple[str, ...]:
        """What was fitted."""

    @property
    def axis(self) -> Axis:
        """The parameters."""

    @property
    def covariance(self) -> Array:
        """Of those that were fitted."""


def told(found: Known) -> tuple[Array, Array]:
    """Unbalance and angle of an estimate, and their standard errors to first order.

    Parameters
    ----------
    found : Known
        By any method.

    Returns
    -------
    values : ndarray, shape (0,) or (2,)
        As in `NAMES`; none of an estimate without them.
    std : ndarray, shape (0,) or (2,)
        Of these.
    """
    table = slopes(found)
    if not len(table):
        return np.empty(0), np.empty(0)
    return np.array(of(found.axis)), coverage.errors(found.covariance, table)


def slopes(found: Known) -> Array:
    """Of unbalance and angle by what was fitted.

    Parameters
    ----------
    found : Known
        By any method.

    Returns
    -------
    ndarray, shape (0, p) or (2, p)
        NaN where the load is none.
    """
    if not set(ECCENTRIC) <= set(found.names):
        return np.empty((0, len(found.names)))
    a, b = found.axis.sine, found.axis.cosine
    size = of(found.axis).unbalance
    if not size > 0.0:
        return np.full((2, len(found.names)), math.nan)
    made = np.zeros((2, len(found.names)))
    at = [found.names.index(n) for n in ECCENTRIC]
    made[:, at] = [[a / size, b / size], [b / size**2, -a / size**2]]
    return made
