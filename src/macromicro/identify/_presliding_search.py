"""Searches for an axis with elastic friction: scaled parameters, bounds, output error."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.identify._axis_pieces import Index, Pieces, cut, settled
from macromicro.identify._axis_slopes import slopes
from macromicro.identify._choose import turn
from macromicro.identify.axis_inverse import Estimate, Rows
from macromicro.identify.presliding import Presliding
from macromicro.identify.search import least_squares

_STIFFEST = 2.0 * math.pi  # of the stuck mass' circular frequency times the sample time
_PIECES, _LEAST = 12, 400  # pieces of all records that judge; samples in one
_GOES = 0.1  # of the greatest speed, five times what counts as rest: the axis slides
_SLID = 0.02  # of the travel: so far from where it turned, friction is at its level
_SLOPE, _FINE = 2e-3, 0.1  # of a parameter's scale: for slopes; of that in the last search
_WIDE = 4.0  # of the logarithm of shares
FLOOR = 1e-3  # of the level: the least that is allowed


class Shape(NamedTuple):
    friction: str
    names: tuple[str, ...]  # of the scalars
    nodes: int


class Problem(NamedTuple):
    """Pieces of records and scales of the parameters."""

    pieces: list[Pieces]
    rigid: Estimate
    dt: float
    low: float
    high: float
    fastest: float  # greatest measured speed

    @property
    def coulomb(self) -> float:
        return max(self.rigid.axis.coulomb + self.rigid.axis.stribeck, 1e-12)

    def model(self, z: Array, shape: Shape) -> Presliding:
        own = dict(zip(shape.names, z.tolist(), strict=False))
        a = self.rigid.axis
        levels, shares = _parts(z, shape)
        mass = a.mass * own["mass"]
        speed = a.stribeck_speed if "stribeck_speed" in self.rigid.names else self.fastest / 20.0
        return Presliding(
            mass=mass,
            viscous=a.viscous * own["viscous"],
            offset=self.coulomb * own["offset"],
            asymmetry=a.viscous * own.get("asymmetry", 0.0),
            stribeck=self.coulomb * own.get("stribeck", 0.0),
            stribeck_speed=speed * math.exp(own.get("stribeck_speed", 0.0)),
            stiffness=mass * (math.exp(own["stiffness"]) / self.dt) ** 2,
            settling=own["settling"] * self.dt,
            shares=shares,
            levels=levels * self.coulomb,
            low=self.low,
            high=self.high,
        )

    def missed(self, z: Array, shape: Shape) -> list[Array]:
        """Measured less simulated, of each record."""
        model = self.model(z, shape)
        return [settled(p, model).error for p in self.pieces]

    def slopes(self, z: Array, shape: Shape, fine: bool = False) -> Array:
        low, _, scale = bounds(z, shape)
        nudge = nudges(z, scale, fine)
        limits = (low, np.full(len(z), math.inf))
        return slopes(self.pieces, lambda at: self.model(at, shape), z, nudge, limits)


def _parts(z: Array, shape: Shape) -> tuple[Array, Array]:
    """Levels by the scale, and shares of the elements."""
    count = len(shape.names)
    levels = np.ascontiguousarray(z[count : count + shape.nodes])
    if shape.friction == "lugre":
        return levels, np.empty(0)
    odds = np.exp(np.concatenate([[0.0], z[count + shape.nodes :]]))
    return levels, odds / odds.sum()


def problem_of(rows: list[Rows], rigid: Estimate) -> Problem:
    total = sum(len(r.v) for r in rows)
    pieces = pieces_of(rows, max(total // _PIECES, _LEAST))
    every = [r.run.x for r in rows]
    low, high = min(float(x.min()) for x in every), max(float(x.max()) for x in every)
    fastest = max(float(np.abs(r.v).max()) for r in rows)
    return Problem(pieces, rigid, rows[0].run.dt, low, high, fastest)


def pieces_of(rows: list[Rows], length: int, free: bool = False) -> list[Pieces]:
    """Pieces of about that length that begin at high speed, where friction is at its level."""
    made = []
    for p in cut(rows, length, free):
        starts = _begins(p.rows, p.starts, int(p.lengths.min()) // 3)
        lengths = np.diff(np.append(starts, len(p.rows.v)))
        made.append(p._replace(starts=starts, lengths=lengths, rests=True))
    return made


def _begins(rows: Rows, cuts: Index, half: int) -> Index:
    """The fastest samples within `half` of the cuts."""
    # The axis has to slide there; otherwise the nearest sliding sample before the next cut is used,
    # or the piece continues: a wrong initial friction state would shift all that follows. A record
    # that slides nowhere inside is cut where it is fastest, since held-out pieces must differ.
    speed = np.abs(rows.v)
    slides = (speed >= _GOES * speed.max()) & (_gone(rows) >= _SLID * np.ptp(rows.run.x))
    fast = np.where(slides, speed, -1.0)
    starts = [0]
    for at in cuts[1:].tolist():
        first, last = max(at - half, starts[-1] + half), at + half
        found = first + int(np.argmax(fast[first:last]))
        if not slides[found]:
            first, last = starts[-1] + half, min(at + 3 * half, len(speed) - half)
            near = first + np.flatnonzero(slides[first:last])
            if not len(near):
                continue
            found = int(near[np.argmin(np.abs(near - at))])
        starts.append(found)
    if len(starts) == 1:
        starts += [at - half + int(np.argmax(speed[at - half : at + half])) for at in cuts[1:]]
    return np.array(starts, np.int64)


def _gone(rows: Rows) -> Array:
    """Distance since the last reversal."""
    side, x = rows.v > 0.0, rows.run.x
    turned = np.flatnonzero(np.diff(side, prepend=not side[0]))
    return np.asarray(np.abs(x - np.repeat(x[turned], np.diff(turned, append=len(x)))))


def searched(
    problem: Problem,
    z: Array,
    shape: Shape,
    most: int,
    held: int | None = None,
    fine: bool = False,
) -> Any:
    low, high, _ = bounds(z, shape)
    kept = _weights(problem, held)
    size = math.sqrt(sum(float(np.sum(w)) for w in kept)) * problem.fastest * problem.dt

    weight = np.concatenate(kept) / size

    def missed(at: Array) -> Array:
        return weight * np.concatenate(problem.missed(at, shape))

    begin = np.clip(z, low + 1e-6, high - 1e-6)
    return least_squares(
        missed,
        begin,
        lambda at: weight[:, None] * problem.slopes(at, shape, fine),
        bounds=(low, high),
        x_scale="jac",
        ftol=1e-9 if fine else 1e-6,
        xtol=1e-6,
        max_nfev=most,
    )


def _weights(problem: Problem, held: int | None) -> list[Array]:
    """1 for samples of pieces that count, 0 for those held out."""
    made, first = [], 0
    for p in problem.pieces:
        number = first + np.arange(len(p.starts))
        kept = np.ones(len(number)) if held is None else (turn(number) != held)
        made.append(np.repeat(np.asarray(kept, np.float64), p.lengths))
        first += len(number)
    return made


def bounds(z: Array, shape: Shape) -> tuple[Array, Array, Array]:
    limits = {
        "mass": (0.05, 20.0, 0.1),
        "viscous": (0.0, 50.0, 0.2),
        "offset": (-5.0, 5.0, 0.1),
        "stiffness": (math.log(1e-4), math.log(_STIFFEST), 2.0),
        "settling": (0.0, 1e4, 2.0),
        "asymmetry": (-20.0, 20.0, 0.1),
        "stribeck": (0.0, 20.0, 0.2),
        "stribeck_speed": (-4.0, 4.0, 0.5),
    }
    rows = [limits[n] for n in shape.names] + [(FLOOR, 50.0, 0.1)] * shape.nodes
    rows += [(-_WIDE, _WIDE, 1.0)] * (len(z) - len(rows))
    low, high, scale = np.array(rows).T
    return low, high, scale


def nudges(at: Array, scale: Array, fine: bool) -> Array:
    return np.asarray(_SLOPE * (_FINE if fine else 1.0) * np.maximum(scale * 5.0, np.abs(at)))
