"""An axis with optional spring and dead zone, under the names by which `sprung_fit` knows it."""

from __future__ import annotations

import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.models.mass import Axis, motion, step

Sprung = Axis

__all__ = ["Sprung", "simulate", "step"]


def simulate(
    p: Axis, force: npt.ArrayLike, dt: float, x: float = 0.0, v: float = 0.0, lag: float = 0.0
) -> tuple[Array, Array]:
    """Free simulation: positions and speeds under a force."""
    places, speeds = motion(p._replace(lag=p.lag + lag), force, dt, x, v)
    return places, speeds
