"""Friction over position: what starts the axis at places along its travel, both ways."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.commission.probing import Direction, Ends, go, started
from macromicro.commission.stand import Caution, Stand

PLACES = 7
_LEAST_SPREAD = 0.01  # of the mean: seven places do not show every speck
_LOWER = 0.8  # friction elsewhere may be that much lower than where it was felt first


class FrictionMap(NamedTuple):
    """Breakaway along the travel.

    Attributes
    ----------
    places : tuple[float, ...]
        From the low end, m.
    forward, backward : tuple[float, ...]
        Least effort that started it there, V; NaN where it could not be tried.
    slid : float, optional
        Speed at which it slid under those efforts, m/s: part of them is viscous.
    """

    places: tuple[float, ...]
    forward: tuple[float, ...]
    backward: tuple[float, ...]
    slid: float = 0.0

    @property
    def sides(self) -> list[Array]:
        """Of each direction that was felt, what is known of it, V."""
        every = (np.array(side) for side in (self.forward, self.backward))
        return [known for side in every if len(known := side[~np.isnan(side)])]

    @property
    def mean(self) -> float:
        """Of both directions, V: a constant force helps one as much as it hinders the other."""
        return float(np.mean([side.mean() for side in self.sides]))

    def breakaway(self, viscous: float) -> float:
        """The mean without what the speed took at which it was seen to slide.

        Parameters
        ----------
        viscous : float
            Slope of the friction and the back-EMF over the speed, V s/m.

        Returns
        -------
        float
            V, half of the mean at least.
        """
        return max(self.mean - viscous * self.slid, 0.5 * self.mean)

    @property
    def spread(self) -> float:
        """Standard deviation along the travel, V; at least a hundredth of the mean."""
        found = [float(side.std(ddof=1)) for side in self.sides if len(side) > 1]
        return max([*found, _LEAST_SPREAD * self.mean])

    @property
    def ripple(self) -> float:
        """By how much the worst place takes more than a direction's mean, V."""
        return max(float(side.max() - side.mean()) for side in self.sides)


def mapped(stand: Stand, found: Direction, ends: Ends, caution: Caution) -> FrictionMap:
    """Ramps of effort at `PLACES` along the travel.

    Parameters
    ----------
    stand : Stand
        The axis.
    found : Direction
        What started it at first.
    ends : Ends
        Where it may go.
    caution : Caution
        What it may not pass; `speed` is that of the creep between places.

    Returns
    -------
    FrictionMap
        A place it did not reach is left out.
    """
    places: list[float] = []
    forward: list[float] = []
    backward: list[float] = []
    speeds: list[float] = []
    for k in range(PLACES):
        place = ends.low + (k + 0.5) / PLACES * ends.travel
        if not go(stand, place, found, caution):
            continue
        places.append(stand.position() - ends.low)
        for kept, way, about in ((forward, 1.0, found.forward), (backward, -1.0, found.backward)):
            one = started(stand, way, caution, found.noise, _LOWER * about)
            kept.append(one.effort)
            if not math.isnan(one.speed):
                speeds.append(one.speed)
    # What went off at once went faster, but its mass took what effort there was.
    slid = sum(speeds) / max(2 * len(places), 1)
    return FrictionMap(tuple(places), tuple(forward), tuple(backward), slid)
