"""An axis with elastic friction as the search sees it: scaled parameters, bounds, pieces."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.identify._choose import held_out, no_better, typical
from macromicro.identify._engine import Fit, Pieces, Space, fit
from macromicro.identify._moved_mass import Model, located
from macromicro.identify._moved_mass import pieces as cut
from macromicro.identify._moved_mass import space as mass_space
from macromicro.identify.presliding import REACHES, Presliding, simulated
from macromicro.identify.runs import Run
from macromicro.models.mass import Axis

RIGID = "rigid"
ELASTIC = "elastic friction"
NODES = (1, 3, 5, 9, 17)  # tried along the travel
FLOOR = 1e-3  # of the level: the least that is allowed
_BEGINS = (0.05, 0.3, 1.5, 4.0)  # circular frequencies of the stuck mass times the sample time
_STIFFEST = 2.0 * math.pi  # of these
_REST = 0.02  # of the greatest speed: less is rest
_GOES = 0.1  # of it: the axis slides
_SLID = 0.02  # of the travel: so far from where it turned, friction is at its level
_PIECES = 12
_WIDE = 4.0  # of the logarithm of shares
_SMALL = 0.01  # of the mean square of a typical piece: what less is, is no better
# Lowest and highest value, and scale, of each parameter as the search sees it.
_LIMITS = {
    "mass": (0.05, 20.0, 1.0),
    "viscous": (0.0, 50.0, 1.0),
    "offset": (-5.0, 5.0, 1.0),
    "stiffness": (math.log(1e-4), math.log(_STIFFEST), 10.0),
    "settling": (0.0, 1e4, 10.0),
    "asymmetry": (-20.0, 20.0, 1.0),
    "stribeck": (0.0, 20.0, 1.0),
    "stribeck_speed": (-4.0, 4.0, 2.5),
}


class Elastic(NamedTuple):
    """Free parameters, relative to those of a rigid axis."""

    friction: str
    names: tuple[str, ...]  # of the scalars; levels and shares follow
    nodes: int
    rigid: Axis
    dt: float
    low: float  # range of the places
    high: float
    fastest: float  # greatest measured speed

    @property
    def coulomb(self) -> float:
        return max(self.rigid.coulomb + self.rigid.stribeck, 1e-12)

    def model(self, z: Array) -> Presliding:
        own = dict(zip(self.names, z.tolist(), strict=False))
        rigid = self.rigid
        levels, shares = self._parts(z)
        mass = rigid.mass * own["mass"]
        speed = rigid.stribeck_speed if rigid.stribeck > 0.0 else self.fastest / 20.0
        return Presliding(
            mass=mass,
            viscous=rigid.viscous * own["viscous"],
            offset=self.coulomb * own["offset"],
            asymmetry=rigid.viscous * own.get("asymmetry", 0.0),
            stribeck=self.coulomb * own.get("stribeck", 0.0),
            stribeck_speed=speed * math.exp(own.get("stribeck_speed", 0.0)),
            stiffness=mass * (math.exp(own["stiffness"]) / self.dt) ** 2,
            settling=own["settling"] * self.dt,
            shares=shares,
            levels=levels * self.coulomb,
            low=self.low,
            high=self.high,
            creep=_REST * self.fastest,
        )

    def simulated(self, z: Array, pieces: Pieces) -> Array:
        return simulated(self.model(z), pieces)

    def _parts(self, z: Array) -> tuple[Array, Array]:
        """Levels by the scale, and shares of the elements."""
        count = len(self.names)
        levels = np.ascontiguousarray(z[count : count + self.nodes])
        if self.friction == "lugre":
            return levels, np.empty(0)
        odds = np.exp(np.concatenate([[0.0], z[count + self.nodes :]]))
        return levels, odds / odds.sum()

    def space(self, unit: float, states: tuple[float, float]) -> Space:
        rows = [_LIMITS[name] for name in self.names] + [(FLOOR, 50.0, 1.0)] * self.nodes
        names = (*self.names, *(f"level {k}" for k in range(1, self.nodes + 1)))
        if self.friction == "gms":
            rows += [(-_WIDE, _WIDE, 1.0)] * (len(REACHES) - 1)
            names += tuple(f"odds {k}" for k in range(2, len(REACHES) + 1))
        low, high, scale = np.array(rows).T
        return Space(names, scale, low / scale, high / scale, states, unit)

    def parameters(self, z: Array) -> dict[str, float]:
        """The parameters one by one: scalars, then `share k` and `level k`."""
        model = self.model(z)
        found = {name: float(getattr(model, name)) for name in self.names}
        found |= {f"share {k}": float(share) for k, share in enumerate(model.shares, 1)}
        return found | {f"level {k}": float(level) for k, level in enumerate(model.levels, 1)}

    @property
    def words(self) -> str:
        parts = [self.friction]
        if "stribeck" in self.names:
            parts.append("Stribeck")
        parts.append(f"{self.nodes} nodes" if self.nodes > 1 else "one level")
        return ", ".join(parts)


class Candidate(NamedTuple):
    kind: Elastic
    end: Fit

    def squares(self, measured: Pieces) -> Array:
        # From measured states levels along the travel show, which states of their own take up.
        end = self.end
        return held_out(self.kind.simulated, end.space, end.pieces, end.values, measured)


class Chosen(NamedTuple):
    best: Candidate
    scores: dict[str, float]  # RMS over a typical held-out piece, by what was tried
    reasons: dict[str, str]  # why each one but the last was not taken


def pieces(records: Sequence[Run]) -> Pieces:
    """The records in pieces that begin where friction is at its level."""
    made = cut(records, _PIECES, False, starts=_starts)
    return made._replace(v=np.where(np.abs(made.v) > _REST * np.abs(made.v).max(), made.v, 0.0))


def _starts(x: Array, v: Array, many: int) -> list[int]:
    """Samples near even cuts at which the axis slides, the fastest of each."""
    # A wrong initial state of the friction would shift all that follows, so a piece goes on where
    # no sample slides near its end. A record that slides nowhere is cut where it is fastest, since
    # held-out pieces must differ.
    n, speed = len(x), np.abs(v)
    slides = (speed >= _GOES * speed.max()) & (_gone(x, v) >= _SLID * np.ptp(x))
    cuts, half = np.linspace(0, n, many + 1)[1:-1].astype(int).tolist(), n // many // 3
    fast = np.where(slides, speed, -1.0)
    starts = [0]
    for at in cuts:
        first, last = max(at - half, starts[-1] + half), at + half
        found = first + int(np.argmax(fast[first:last]))
        if not slides[found]:
            first, last = starts[-1] + half, min(at + 3 * half, n - half)
            near = first + np.flatnonzero(slides[first:last])
            if not len(near):
                continue
            found = int(near[np.argmin(np.abs(near - at))])
        starts.append(found)
    if len(starts) == 1:
        starts += [at - half + int(np.argmax(speed[at - half : at + half])) for at in cuts]
    return starts


def _gone(x: Array, v: Array) -> Array:
    """Distance since the last reversal."""
    side = v > 0.0
    turned = np.flatnonzero(np.diff(side, prepend=not side[0]))
    return np.asarray(np.abs(x - np.repeat(x[turned], np.diff(turned, append=len(x)))))


def chosen(
    records: Sequence[Run], rigid: Model, axis: Axis, friction: str, along: int | None
) -> Chosen:
    """The simplest elastic friction that no richer one beats on held-out pieces."""
    parts = pieces(records)
    where = mass_space(rigid, records, axis)
    errors = rigid.simulated(rigid.values(axis), parts) - parts.y
    squares = {RIGID: parts.totals(errors**2) / parts.many}
    # A piece in which next to nothing moves shall not outweigh the others in a mean of logarithms.
    floor = _SMALL * float(np.median(squares[RIGID]))
    squares[RIGID] = squares[RIGID] + floor
    first = _first(records, parts, rigid, axis, where, friction)
    tried = [first]
    if "stribeck" not in first.kind.names:
        more = first.kind._replace(names=(*first.kind.names, "stribeck", "stribeck_speed"))
        begin = np.insert(first.end.values, len(first.kind.names), [0.1, 0.0])
        tried.append(_fitted(more, begin, first.end))
    reasons: dict[str, str] = {}
    for one in tried:
        squares[one.kind.words] = one.squares(parts) + floor
    best = _better(tried[0], tried[1:], squares, reasons)
    for nodes in NODES[1:] if along is None else (along,):
        if nodes == best.kind.nodes:
            continue
        finer = best.kind._replace(nodes=nodes)
        one = _fitted(finer, _refined(best.end.values, best.kind, nodes), best.end)
        squares[finer.words] = one.squares(parts) + floor
        before = best
        best = one if along is not None else _better(best, [one], squares, reasons)
        if best is before and nodes > NODES[1]:
            break
    scores = {name: typical(each) for name, each in squares.items()}
    taken = best.kind.words
    gained = np.log(squares[RIGID] / squares[taken])
    why = no_better(scores[RIGID], scores[taken], gained, RIGID)
    reasons[RIGID if not why else ELASTIC] = why or f"{taken} is better"
    return Chosen(best, scores, reasons)


def _fitted(kind: Elastic, begin: Array, near: Fit) -> Candidate:
    where = kind.space(near.space.unit, near.space.states)
    return Candidate(kind, fit(kind.simulated, where, near.pieces, begin))


def _first(
    records: Sequence[Run], parts: Pieces, rigid: Model, axis: Axis, where: Space, friction: str
) -> Candidate:
    """One level, from the rigid axis; the best of searches from several stiffnesses."""
    fastest = max(float(np.abs(located(r, False)[1]).max()) for r in records)
    low, high = (float(f([f(r.x) for r in records])) for f in (np.min, np.max))
    dt = float(parts.dt[0])
    names, values = ["mass", "viscous", "offset", "stiffness", "settling"], [1.0, 1.0]
    kind = Elastic(friction, tuple(names), 1, axis, dt, low, high, fastest)
    values += [axis.offset / kind.coulomb, 0.0, 2.0]
    if "asymmetry" in rigid.names:
        names.append("asymmetry")
        values.append(axis.asymmetry / axis.viscous)
    if "stribeck" in rigid.names:
        names += ["stribeck", "stribeck_speed"]
        values += [axis.stribeck / kind.coulomb, 0.0]
    kind = kind._replace(names=tuple(names))
    level = max(axis.coulomb / kind.coulomb, FLOOR)
    elements = [0.0] * (len(REACHES) - 1) if friction == "gms" else []
    space = kind.space(where.unit, where.states)
    ends = []
    for stuck in _BEGINS:
        z = np.array([*values, level, *elements])
        z[names.index("stiffness")] = math.log(stuck)
        ends.append(fit(kind.simulated, space, parts, z, most=30))
    return Candidate(kind, min(ends, key=lambda end: end.rms))


def _better(
    best: Candidate, others: list[Candidate], squares: dict[str, Array], reasons: dict[str, str]
) -> Candidate:
    """The best candidate, with reasons against the others."""
    for other in others:
        poor, rich = squares[best.kind.words], squares[other.kind.words]
        why = no_better(typical(poor), typical(rich), np.log(poor / rich), best.kind.words)
        if why:
            reasons[other.kind.words] = why
        else:
            reasons[best.kind.words] = f"{other.kind.words} is better"
            best = other
    return best


def _refined(z: Array, kind: Elastic, nodes: int) -> Array:
    count = len(kind.names)
    old = z[count : count + kind.nodes]
    at = np.linspace(0.0, 1.0, nodes)
    new = np.interp(at, np.linspace(0.0, 1.0, max(kind.nodes, 2)), np.resize(old, max(len(old), 2)))
    return np.concatenate([z[:count], new, z[count + kind.nodes :]])
