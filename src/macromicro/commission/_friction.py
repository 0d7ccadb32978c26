"""Breakaway force along the travel, both ways."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.commission._probing import Direction, Ends, go, started
from macromicro.commission.stand import Caution, Stand

PLACES = 7
_LEAST_SPREAD = 0.01  # of the mean: seven places do not show every speck
_LOWER = 0.8  # friction elsewhere may be that much lower than where it was felt first


class FrictionMap(NamedTuple):
    places: tuple[float, ...]  # from the low end, m
    forward: tuple[float, ...]  # least effort that started it there, V
    backward: tuple[float, ...]  # NaN where it could not be tried
    slid: float = 0.0  # speed at which it slid under those efforts, m/s: part of them is viscous

    @property
    def sides(self) -> list[Array]:
        """Known breakaway efforts of each direction, V."""
        every = (np.array(side) for side in (self.forward, self.backward))
        return [known for side in every if len(known := side[~np.isnan(side)])]

    @property
    def mean(self) -> float:
        """Mean of both directions, V, which cancels a constant force."""
        return float(np.mean([side.mean() for side in self.sides]))

    def breakaway(self, viscous: float) -> float:
        """The mean less viscous friction at the detection speed."""
        return max(self.mean - viscous * self.slid, 0.5 * self.mean)

    @property
    def spread(self) -> float:
        """Standard deviation along the travel, V; at least a hundredth of the mean."""
        found = [float(side.std(ddof=1)) for side in self.sides if len(side) > 1]
        return max([*found, _LEAST_SPREAD * self.mean])

    @property
    def ripple(self) -> float:
        """Excess of the worst position over a direction's mean, V."""
        return max(float(side.max() - side.mean()) for side in self.sides)


def mapped(stand: Stand, found: Direction, ends: Ends, caution: Caution) -> FrictionMap:
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
