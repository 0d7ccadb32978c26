"""Paths in a plane: lines and arcs, rounded corners, and distances of points."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError

MEET = 1e-9  # m; pieces that are nearer than this meet
TURN = 2.0 * math.pi
_SLIGHT = 1e-9  # rad; a smaller turn is none
_BACK = math.pi - 1e-6  # rad; a turn beyond it goes back the same way


class Piece(NamedTuple):
    # x, y: where it begins, m
    x: float
    y: float
    ux: float  # direction there, a unit vector
    uy: float  # a straight piece along an axis has exactly 0 in the other
    curvature: float  # 1/m, positive to the left; 0: straight
    length: float  # m

    def at(self, s: Array | float) -> tuple[Array, Array]:
        s = np.asarray(s, dtype=np.float64)
        if self.curvature == 0.0:
            return self.x + self.ux * s, self.y + self.uy * s
        angle = self.curvature * s
        along, aside = np.sin(angle) / self.curvature, (1.0 - np.cos(angle)) / self.curvature
        x = self.x + along * self.ux - aside * self.uy
        return x, self.y + along * self.uy + aside * self.ux

    def direction(self, s: Array | float) -> tuple[Array, Array]:
        """Unit vectors along the piece."""
        s = np.asarray(s, dtype=np.float64)
        if self.curvature == 0.0:
            return np.full_like(s, self.ux), np.full_like(s, self.uy)
        c, n = np.cos(self.curvature * s), np.sin(self.curvature * s)
        return c * self.ux - n * self.uy, c * self.uy + n * self.ux

    @property
    def end(self) -> tuple[float, float]:
        x, y = self.at(self.length)
        return float(x), float(y)

    @property
    def extent(self) -> tuple[float, float, float, float]:
        s = [0.0, self.length]
        if self.curvature != 0.0:  # an arc goes farthest where its direction is along an axis
            first, quarter = math.atan2(self.uy, self.ux), 0.5 * math.pi
            last = first + self.curvature * self.length
            low, high = min(first, last), max(first, last)
            turns = range(math.ceil(low / quarter), math.floor(high / quarter) + 1)
            s += [(k * quarter - first) / self.curvature for k in turns]
        x, y = self.at(np.array(s))
        return float(x.min()), float(x.max()), float(y.min()), float(y.max())

    def nearest(self, x: Array, y: Array) -> Array:
        dx, dy = x - self.x, y - self.y
        if self.curvature == 0.0:
            return np.clip(dx * self.ux + dy * self.uy, 0.0, self.length)
        sign, radius = math.copysign(1.0, self.curvature), 1.0 / abs(self.curvature)
        # From the centre, in the frame of the beginning: out of the circle, and along the way.
        out = radius + sign * (dx * self.uy - dy * self.ux)
        turned = np.mod(np.arctan2(dx * self.ux + dy * self.uy, out), TURN)
        angle = self.length / radius
        after = turned - angle  # beyond its end by so much, before its beginning by the rest
        beyond = np.where(after < 0.5 * (TURN - angle), angle, 0.0)
        return np.where(after <= 0.0, turned, beyond) * radius


def line(begin: tuple[float, float], end: tuple[float, float]) -> Piece:
    dx, dy = end[0] - begin[0], end[1] - begin[1]
    length = math.hypot(dx, dy)
    return Piece(begin[0], begin[1], dx / length, dy / length, 0.0, length)


def arc(begin: tuple[float, float], centre: tuple[float, float], angle: float) -> Piece:
    dx, dy = begin[0] - centre[0], begin[1] - centre[1]
    radius, sign = math.hypot(dx, dy), math.copysign(1.0, angle)
    ux, uy = -sign * dy / radius, sign * dx / radius
    return Piece(begin[0], begin[1], ux, uy, sign / radius, radius * abs(angle))


def turning(before: Piece, after: Piece) -> float:
    ux, uy = (float(u) for u in before.direction(before.length))
    return math.atan2(ux * after.uy - uy * after.ux, ux * after.ux + uy * after.uy)


def round_corners(points: Sequence[tuple[float, float]], radius: float, where: str) -> list[Piece]:
    """Straight pieces through points, each corner replaced by a tangent arc."""
    legs = []
    for k, (begin, end) in enumerate(itertools.pairwise(points), 2):
        if math.dist(begin, end) <= MEET:
            raise ProblemError(f"{where}, point {k}", "the same as the point before")
        legs.append(line(begin, end))
    turns = [turning(a, b) for a, b in itertools.pairwise(legs)]
    cuts = [0.0]
    for k, turn in enumerate(turns, 2):
        if abs(turn) > _BACK:
            accepted = "Choose corners that do not turn back, or an exact stop."
            raise ProblemError(f"{where}, point {k}", "a turn by 180 deg", accepted)
        cuts.append(radius * math.tan(0.5 * abs(turn)) if abs(turn) > _SLIGHT else 0.0)
    cuts.append(0.0)
    for k, leg in enumerate(legs):
        if cuts[k] + cuts[k + 1] > leg.length * (1.0 + 1e-9):
            most = radius * leg.length / (cuts[k] + cuts[k + 1])
            found = f"{1e3 * radius:.6g} mm"
            accepted = f"at most {1e3 * most:.6g} mm between points {k + 1} and {k + 2}"
            raise InputError(f"{where}, rounding", found, accepted)
    pieces: list[Piece] = []
    for k, leg in enumerate(legs):
        x, y = (float(u) for u in leg.at(cuts[k]))
        left = leg.length - cuts[k] - cuts[k + 1]
        if left > MEET:
            pieces.append(leg._replace(x=x, y=y, length=left))
        if cuts[k + 1] > 0.0:
            x, y = (float(u) for u in leg.at(leg.length - cuts[k + 1]))
            bend = math.copysign(1.0 / radius, turns[k])
            pieces.append(Piece(x, y, leg.ux, leg.uy, bend, radius * abs(turns[k])))
    return pieces
