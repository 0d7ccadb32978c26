"""Output error with elastic friction that depends on the position: `presliding_drive`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify import _moved_mass
from macromicro.identify._disturbances import Ripple
from macromicro.identify._moved_mass import Model, locate
from macromicro.identify._moved_mass import pieces as cut
from macromicro.identify._moved_mass import space as mass_space
from macromicro.identify.axis_fit import DriveFit, Driven, drive, runs_of
from macromicro.identify.engine import (
    Fit,
    Pieces,
    Space,
    fit,
    held_out,
    no_better,
    settle_starts,
    simplest,
    typical,
)
from macromicro.identify.notices import ConvergenceWarning, DataWarning, notice
from macromicro.identify.presliding import LUGRE, Presliding, simulate, simulate_pieces
from macromicro.identify.records import rms
from macromicro.identify.runs import Run
from macromicro.identify.search import central
from macromicro.models.mass import Axis

_ELASTIC = ("stiffness", "settling")
_MOST, _PART = 30_000, 5000  # samples; of longer records evenly spread parts are fitted
_RIGID = 2  # parts, of as many samples in all, by which the rigid axis is found
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


@dataclass(frozen=True)
class PreslidingFit:
    """Result of `presliding_drive`; x is the unit of position, and force is `gain` times u."""

    model: Presliding  # the axis
    names: tuple[str, ...]  # its parameters, one by one: scalars, then `level k`
    values: Array
    std: Array  # standard errors; NaN for what the record does not show
    factors: Array  # coverage factors of the 68 and 95 % intervals of these, shape (2, p)
    # RMS of free runs over held-out pieces of a typical piece, by what was tried
    judged: dict[str, float]
    reasons: dict[str, str]  # why each one but the last was not taken
    taken: str  # key of what was taken
    rms: float  # of the free run over all records, unit of x
    # positions of the axis over each whole record, from its fitted start
    free_run: tuple[Array, ...]
    residuals: tuple[Array, ...]  # measured position less free run
    gain: float  # force per unit of u
    delay: int  # samples by which u acts late
    # A force that repeats along the way and is not in the model, where there is one
    repeats: Ripple | None = None
    limit: float | None = None  # u saturates there

    def simulate(self, u: npt.ArrayLike, dt: float, x: float = 0.0, v: float = 0.0) -> Array:
        driven = Driven(self.gain, self.limit, self.delay)
        return simulate(self.model, driven.force(np.asarray(u, np.float64)), dt, x, v)


def presliding_drive(
    t: npt.ArrayLike | Sequence[npt.ArrayLike],
    u: npt.ArrayLike | Sequence[npt.ArrayLike],
    x: npt.ArrayLike | Sequence[npt.ArrayLike],
    *,
    along: int | None = None,
    gain: float = 1.0,
    limit: float | None = None,
    delay: int = 0,
) -> PreslidingFit:
    """Parameters of an axis with LuGre friction, from presliding motion."""
    if along is not None and not 1 <= along <= NODES[-1]:
        raise InputError("along", along, f"nodes along the travel, 1 to {NODES[-1]}")
    driven = Driven(gain, limit, delay)
    runs = runs_of(t, u, x)
    records = [run._replace(u=driven.force(run.u)) for run in runs]
    fitted = records
    if sum(len(r.t) for r in records) > _MOST:
        fitted = _moved_mass.stretches(records, _MOST // _PART, _PART)
        runs = _moved_mass.stretches(runs, _RIGID, _MOST // _RIGID)
    rigid = _rigid(runs, gain=gain, limit=limit, delay=delay)
    names = tuple(n for n in rigid.refined.names if n != "lag")
    found = choose_friction(fitted, Model(names), rigid.axis, along)
    kind, near = found.best
    end = fit(kind.simulated, near.space, near.pieces, near.values)
    if not end.settled:
        notice(ConvergenceWarning, "elastic friction: not settled; the last values are returned")
    model, values = kind.model(end.values), kind.parameters(end.values)
    std, factors, repeats = _errors_of(Candidate(kind, end))
    if ELASTIC in found.reasons:
        notice(
            DataWarning,
            f"{LUGRE} friction predicts held-out pieces no better than rigid friction, within "
            "their scatter: the record does not need it, and its elastic parameters have no "
            "standard errors",
        )
        std[[name.startswith(_ELASTIC) for name in values]] = np.nan
    whole = settle_starts(
        kind.simulated, end.space, _moved_mass.pieces(records, 1, False), end.values
    )
    free = np.split(kind.simulated(end.values, whole), whole.edges[1:-1])
    errors = [r.x - run for r, run in zip(records, free, strict=True)]
    return PreslidingFit(
        model,
        tuple(values),
        np.array(list(values.values())),
        std,
        factors,
        found.scores,
        found.reasons,
        kind.words,
        rms(errors),
        tuple(free),
        tuple(errors),
        float(gain),
        int(delay),
        repeats,
        limit,
    )


def _rigid(runs: list[Run], **options: Any) -> DriveFit:
    columns = [r.t for r in runs], [r.u for r in runs], [r.x for r in runs]
    found = drive(*columns, **options)
    if "coulomb" in found.refined.names:
        return found
    # The friction's give hid its level, which levels along the travel are relative to.
    return drive(*columns, structure="coulomb", **options)


def _errors_of(found: Candidate) -> tuple[Array, Array, Ripple | None]:
    """Standard errors (NaN at a bound), coverage factors and the force that repeats."""
    kind, end = found
    model = kind.model(end.values)
    seen = _moved_mass.Found(end, _moved_mass.spread(end, _moved_mass.edges(end.pieces)))
    repeats = _moved_mass.find_ripple(end, kind.simulated, Axis(model.mass, model.viscous))
    if repeats is not None:
        seen = _moved_mass.under(seen, kind.simulated, repeats)
    names = list(kind.parameters(end.values))
    turn = _turn(found)
    covariance = np.nan_to_num(seen.spread.covariance)
    std = np.sqrt(np.diag(turn @ covariance @ turn.T))
    ended = [n for n, at in zip(end.space.names, end.bound, strict=True) if at and n in names]
    if ended:
        notice(
            DataWarning,
            f"elastic friction: {', '.join(ended)} at a bound: the record does not determine "
            "it, so it has no standard error",
        )
        std[[names.index(n) for n in ended]] = np.nan
    return std, seen.spread.factors(turn), repeats


def _turn(found: Candidate) -> Array:
    """Derivatives of the parameters by those of the search."""
    kind, z = found.kind, found.end.values
    step = 1e-6 * np.maximum(np.abs(z), 1e-3)
    return central(
        lambda at: np.array([*kind.parameters(at).values()]), z, step, z - step, z + step
    )


class Elastic(NamedTuple):
    """Free parameters, relative to those of a rigid axis."""

    names: tuple[str, ...]  # of the scalars; levels follow
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
        count = len(self.names)
        levels = np.ascontiguousarray(z[count : count + self.nodes])
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
            levels=levels * self.coulomb,
            low=self.low,
            high=self.high,
            creep=_REST * self.fastest,
        )

    def simulated(self, z: Array, pieces: Pieces) -> Array:
        return simulate_pieces(self.model(z), pieces)

    def space(self, unit: float, states: tuple[float, float]) -> Space:
        rows = [_LIMITS[name] for name in self.names] + [(FLOOR, 50.0, 1.0)] * self.nodes
        names = (*self.names, *(f"level {k}" for k in range(1, self.nodes + 1)))
        low, high, scale = np.array(rows).T
        return Space(names, scale, low / scale, high / scale, states, unit)

    def parameters(self, z: Array) -> dict[str, float]:
        """The parameters one by one: scalars, then `level k`."""
        model = self.model(z)
        found = {name: float(getattr(model, name)) for name in self.names}
        return found | {f"level {k}": float(level) for k, level in enumerate(model.levels, 1)}

    @property
    def words(self) -> str:
        parts = [LUGRE]
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
    slides = (speed >= _GOES * speed.max()) & (_since_reversal(x, v) >= _SLID * np.ptp(x))
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


def _since_reversal(x: Array, v: Array) -> Array:
    """Distance since the last reversal."""
    side = v > 0.0
    turned = np.flatnonzero(np.diff(side, prepend=not side[0]))
    return np.asarray(np.abs(x - np.repeat(x[turned], np.diff(turned, append=len(x)))))


def choose_friction(records: Sequence[Run], rigid: Model, axis: Axis, along: int | None) -> Chosen:
    """The simplest elastic friction that no richer one beats on held-out pieces."""
    parts = pieces(records)
    where = mass_space(rigid, records, axis)
    errors = rigid.simulated(rigid.values(axis), parts) - parts.y
    squares = {RIGID: parts.totals(errors**2) / parts.many}
    # A piece in which next to nothing moves shall not outweigh the others in a mean of logarithms.
    floor = _SMALL * float(np.median(squares[RIGID]))
    squares[RIGID] = squares[RIGID] + floor
    first = _first(records, parts, rigid, axis, where)
    tried = {first.kind.words: first}
    if "stribeck" not in first.kind.names:
        more = first.kind._replace(names=(*first.kind.names, "stribeck", "stribeck_speed"))
        begin = np.insert(first.end.values, len(first.kind.names), [0.1, 0.0])
        tried[more.words] = _fit_candidate(more, begin, first.end)
    for words, one in tried.items():
        squares[words] = one.squares(parts) + floor
    judged = simplest({words: squares[words] for words in tried})
    best, reasons = tried[judged.structure], judged.reasons
    for nodes in NODES[1:] if along is None else (along,):
        if nodes == best.kind.nodes:
            continue
        finer = best.kind._replace(nodes=nodes)
        one = _fit_candidate(finer, _refine(best.end.values, best.kind, nodes), best.end)
        squares[finer.words] = one.squares(parts) + floor
        if along is not None:
            best = one
            continue
        pair = {words: squares[words] for words in (best.kind.words, finer.words)}
        judged = simplest(pair, reasons)
        reasons = judged.reasons
        if judged.structure == finer.words:
            best = one
        elif nodes > NODES[1]:
            break
    scores = {name: typical(each) for name, each in squares.items()}
    taken = best.kind.words
    gained = np.log(squares[RIGID] / squares[taken])
    why = no_better(scores[RIGID], scores[taken], gained, RIGID)
    reasons[RIGID if not why else ELASTIC] = why or f"{taken} is better"
    return Chosen(best, scores, reasons)


def _fit_candidate(kind: Elastic, begin: Array, near: Fit) -> Candidate:
    where = kind.space(near.space.unit, near.space.states)
    return Candidate(kind, fit(kind.simulated, where, near.pieces, begin))


def _first(
    records: Sequence[Run], parts: Pieces, rigid: Model, axis: Axis, where: Space
) -> Candidate:
    """One level, from the rigid axis; the best of searches from several stiffnesses."""
    fastest = max(float(np.abs(locate(r, False)[1]).max()) for r in records)
    low, high = (float(f([f(r.x) for r in records])) for f in (np.min, np.max))
    dt = float(parts.dt[0])
    names, values = ["mass", "viscous", "offset", "stiffness", "settling"], [1.0, 1.0]
    kind = Elastic(tuple(names), 1, axis, dt, low, high, fastest)
    values += [axis.offset / kind.coulomb, 0.0, 2.0]
    if "asymmetry" in rigid.names:
        names.append("asymmetry")
        values.append(axis.asymmetry / axis.viscous)
    if "stribeck" in rigid.names:
        names += ["stribeck", "stribeck_speed"]
        values += [axis.stribeck / kind.coulomb, 0.0]
    kind = kind._replace(names=tuple(names))
    level = max(axis.coulomb / kind.coulomb, FLOOR)
    space = kind.space(where.unit, where.states)
    ends = []
    for stuck in _BEGINS:
        z = np.array([*values, level])
        z[names.index("stiffness")] = math.log(stuck)
        ends.append(fit(kind.simulated, space, parts, z, most=30, rounds=1))
    best = min(ends, key=lambda end: end.rms)
    return Candidate(kind, fit(kind.simulated, space, best.pieces, best.values, most=30))


def _refine(z: Array, kind: Elastic, nodes: int) -> Array:
    count = len(kind.names)
    old = z[count : count + kind.nodes]
    at = np.linspace(0.0, 1.0, nodes)
    new = np.interp(at, np.linspace(0.0, 1.0, max(kind.nodes, 2)), np.resize(old, max(len(old), 2)))
    return np.concatenate([z[:count], new])
