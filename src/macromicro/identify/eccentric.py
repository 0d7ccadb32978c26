"""Eccentric load of a rotary axis: its torque, and the angle at which it hangs."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np

from macromicro.arrays import Array
from macromicro.identify import clusters
from macromicro.identify.axis_inverse import ECCENTRIC
from macromicro.models.mass import Axis

NAMES = ("unbalance", "hangs")


class Eccentric(NamedTuple):
    """A torque of unbalance sin(x - hangs) towards lower angles."""

    unbalance: float  # greatest torque, N m
    hangs: float  # angle at which the load hangs, rad, from -pi to pi


def of(axis: Axis) -> Eccentric:
    return Eccentric(math.hypot(axis.sine, axis.cosine), math.atan2(-axis.cosine, axis.sine))


class Known(Protocol):
    @property
    def names(self) -> tuple[str, ...]:
        """What was fitted."""

    @property
    def axis(self) -> Axis:
        """The parameters."""

    @property
    def covariance(self) -> Array:
        """Of those that were fitted."""


def gravity_terms(found: Known) -> tuple[Array, Array]:
    table = slopes(found)
    if not len(table):
        return np.empty(0), np.empty(0)
    return np.array(of(found.axis)), clusters.errors(found.covariance, table)


def slopes(found: Known) -> Array:
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
