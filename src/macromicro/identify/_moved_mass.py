"""Output error for a mass (`macromicro.models.mass`): records in pieces, scales, cuts, errors."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.identify import _counts, clusters
from macromicro.identify._disturbances import Ripple, ripple
from macromicro.identify.axis_inverse import differences
from macromicro.identify.clusters import Spread
from macromicro.identify.engine import (
    Fit,
    Index,
    Pieces,
    Simulated,
    Space,
    fit,
    settle_starts,
    without_starts,
)
from macromicro.identify.notices import ConvergenceWarning, DataWarning, notice
from macromicro.identify.runs import Run
from macromicro.identify.search import solve_scaled
from macromicro.kernel import compiled
from macromicro.models.mass import Axis, late, restarted

PIECES = 16  # of all records: clusters enough for their errors
_DECAYS = 8
_LEAST = 50  # samples in a piece
FEWEST = _DECAYS * _LEAST  # samples of a decay that its pieces are judged by
_NEAR = 0.25  # of a piece: how far its start moves to a fast sample, where friction is at its level
CORNER = 0.08  # of the samples' rate: cut-off of positions before they are differentiated
_PLACES = np.linspace(-0.5, 0.5, 9)  # of the travel: tried about the place at the start
_BEGINNING = 400_000  # samples by which the start of a record is found
_FEW = 100  # samples in which a force is looked for
_SLOW = 0.15  # of the top speed: a slower one may be that of friction that gives
_WHITE = 1.5  # times the variance of the output's own noise: there is no other
SIGNED = ("offset", "asymmetry", "sine", "cosine")
_FORGOTTEN = 0.5  # of a record: in so short a time
_BLOCKS = 4  # of a whole record that a force disturbs
_ABOVE = ("mass", "spring", "stribeck_speed")  # never 0
LONG = 400_000  # samples in all records; fewer are taken as they are
_KEPT = 30.0  # samples left in a time constant M/Fv
_PARTS = 4  # stretches that stand for a long record


class Model(NamedTuple):
    """The free parameters of a mass, and what else there is of it."""

    names: tuple[str, ...]
    fixed: Axis = Axis(1.0, 0.0)
    speed: bool = False  # the output is the speed

    def axis(self, values: Array) -> Axis:
        return self.fixed._replace(**dict(zip(self.names, values.tolist(), strict=True)))

    def values(self, axis: Axis) -> Array:
        return np.array([getattr(axis, name) for name in self.names])

    def simulated(self, values: Array, pieces: Pieces) -> Array:
        axis = self.axis(values)
        force = _delay_force(pieces, axis.lag)
        out = np.empty((2, len(pieces.y)))
        plain = Axis(*(float(value) for value in axis))
        compiled(restarted)(plain, np.ascontiguousarray(force), *pieces[1:6], out)
        return np.asarray(out[int(self.speed)])


def _delay_force(pieces: Pieces, lag: float) -> Array:
    """The force of the pieces, late by a time."""
    steps = np.unique(pieces.dt).tolist()
    made = late(pieces.force, lag / steps[0])
    for dt in steps[1:]:
        other = late(pieces.force, lag / dt)
        for k in np.flatnonzero(pieces.dt == dt).tolist():
            rows = slice(pieces.first[k], pieces.first[k] + pieces.many[k])
            made[rows] = other[rows]
    return made


class Found(NamedTuple):
    fit: Fit
    spread: Spread


def locate(run: Run, speed: bool) -> tuple[Array, Array]:
    """Smooth places and speeds of a record."""
    if speed:
        smooth = differences(Run(run.t, run.u, _sum_force(run)), run.u, CORNER / run.dt, 1)
        return smooth.run.x, smooth.v
    return run.x, differences(run, run.u, CORNER / run.dt, 1).v


def _sum_force(run: Run) -> Array:
    step = 0.5 * (run.x[1:] + run.x[:-1]) * run.dt
    place = np.concatenate([[0.0], np.cumsum(step)])
    return np.asarray(place - place.mean())  # a spring rests at about the mean


def _fastest(_: Array, rate: Array, many: int) -> list[int]:
    """The fastest samples near even cuts, where friction is at its level."""
    n, speed = len(rate), np.abs(rate)
    reach = int(_NEAR * n / many)
    found = [0]
    for at in np.linspace(0, n, many + 1)[1:-1].astype(int).tolist():
        low = at - reach
        found.append(low + int(np.argmax(speed[low : at + reach + 1])))
    return found


def pieces(
    records: Sequence[Run],
    many: int,
    speed: bool,
    lead: int = 0,
    starts: Callable[[Array, Array, int], list[int]] = _fastest,
) -> Pieces:
    """The records in about so many pieces, each of at least one."""
    total = sum(len(r.x) for r in records)
    length = max(total / many, _LEAST)
    forces: list[Array] = []
    rows: list[tuple[int, int, float, float, float]] = []
    used = 0
    for r in records:
        n = len(r.x)
        place, rate = locate(r, speed)
        cuts = starts(place, rate, max(int(n / length), 1))
        for first, last in zip(cuts, [*cuts[1:], n], strict=True):
            before = r.u[max(first - lead, 0) : first]
            # Before a record its first force acted.
            before = np.concatenate([np.full(lead - len(before), r.u[0]), before])
            forces += [before, r.u[first:last]]
            rows.append((used + lead, last - first, r.dt, float(place[first]), float(rate[first])))
            used += lead + last - first
    first_row, count, dt, x, v = (np.array(each) for each in zip(*rows, strict=True))
    y = np.concatenate([r.x for r in records])
    return Pieces(np.concatenate(forces), first_row, count, dt, x, v, y)


def space(model: Model, records: Sequence[Run], begin: Axis) -> Space:
    """Scales and bounds of the parameters."""
    states = [locate(r, model.speed) for r in records]
    place = max(float(np.ptp(x)) for x, _ in states) or 1.0
    rate = max(float(np.abs(v).max()) for _, v in states) or 1.0
    push = max(float(np.abs(r.u).max()) for r in records)
    force = max(push, begin.spring * place, begin.mass * rate)
    usual = {
        "mass": 0.0,
        "viscous": 0.1 * force / rate,
        "asymmetry": 0.1 * force / rate,
        "spring": 0.1 * force / place,
        "stribeck_speed": 0.01 * rate,
        "lag": records[0].dt,
        "dead_zone": 0.1 * force,
    }
    names = model.names
    scale = [max(abs(getattr(begin, n)), usual.get(n, 0.05 * force), 1e-300) for n in names]
    low = [-np.inf if n in SIGNED else 1e-6 if n in _ABOVE else 0.0 for n in names]
    high = np.full(len(names), np.inf)
    unit = float(np.std(np.concatenate([r.x for r in records]))) or 1.0
    return Space(names, np.array(scale), np.array(low), high, (place, rate), unit)


def noise(records: Sequence[Run]) -> float:
    """Variance of the output's own noise: by fourth differences, or of rounding to counts."""
    found = []
    for r in records:
        white = float(np.mean(np.diff(r.x, 4) ** 2)) / 70.0
        step = _counts.felt(r.x, white)
        found.append(white if step is None else max(white, step * step / 12.0))
    return float(np.mean(found))


def fit_starts(
    records: Sequence[Run], model: Model, begins: Sequence[Axis], lead: int = 0
) -> list[Fit]:
    """Output error over pieces from several starts, the nearest first."""
    # Of a decay the late pieces tell little, so there are fewer of them.
    many = PIECES if "mass" in model.names else _DECAYS
    cut = pieces(records, many, model.speed, lead)
    ends = []
    for begin in begins:
        where = space(model, records, begin)
        ends.append(fit(model.simulated, where, cut, model.values(begin)))
    return sorted((end for end in ends if np.isfinite(end.rms)), key=lambda end: end.rms)


def initial_state(
    run: Run, model: Model, axis: Axis, near: tuple[float, float] | None = None
) -> tuple[float, float]:
    """State at a record's start from which the free simulation is nearest to it."""
    run = run.part(0, _BEGINNING)
    lead = math.ceil(axis.lag / run.dt)
    fixed = Model((), axis, model.speed)
    where = space(fixed, [run], axis)
    whole = pieces([run], 1, model.speed, lead)
    tried = [whole]
    if near is not None:
        tried = [whole._replace(x=np.array([near[0]]), v=np.array([near[1]]))]
    elif model.speed and axis.spring > 0.0:
        # The place is not known, and friction makes more than one minimum of it.
        tried = [whole._replace(x=whole.x + part * where.states[0]) for part in _PLACES]
    ends = []
    for begin in tried:
        end = settle_starts(fixed.simulated, where, begin, np.empty(0))
        error = fixed.simulated(np.empty(0), end) - end.y
        ends.append((float(error @ error), float(end.x[0]), float(end.v[0])))
    return min(ends)[1:]


def beginnings(found: Found, records: Sequence[Run]) -> list[tuple[float, float]]:
    """States at the starts of the records, as fitted."""
    rows = np.cumsum([0, *(len(r.x) for r in records[:-1])])
    parts = found.fit.pieces
    at = np.searchsorted(parts.edges, rows)
    return list(zip(parts.x[at].tolist(), parts.v[at].tolist(), strict=True))


def surest(records: Sequence[Run], model: Model, parts: Fit, lead: int = 0) -> Found:
    """The fit to pieces; to whole records where these are no less sure of their parameters."""
    # A force on a mass without a spring moves all that follows, so blocks of a whole record are
    # not independent, unless noise of the output is all that is left. On a spring, and as a speed,
    # it is forgotten; the whole record then tells more than pieces whose starts are unknown.
    pieces_alone = len(parts.pieces.many) <= len(records)
    found = Found(parts, spread(parts, edges(parts.pieces)))
    quiet = _quiet(parts, records)
    forgets = _memory(model, parts) <= _FORGOTTEN * max(len(r.x) * r.dt for r in records)
    if not (quiet or forgets or pieces_alone):
        return found
    whole = parts
    if not pieces_alone:
        begin = model.axis(parts.values)
        cut = pieces(records, 1, model.speed, lead)
        states = np.array(beginnings(found, records))  # nearer than measured ones
        cut = cut._replace(x=states[:, 0], v=states[:, 1])
        whole = fit(model.simulated, space(model, records, begin), cut, parts.values)
    quiet = _quiet(whole, records)
    many = PIECES if quiet else max(_BLOCKS, len(records))
    sure = Found(whole, spread(whole, clusters.blocks(len(whole.residual), many)))
    if forgets or pieces_alone:
        return sure
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = np.diag(sure.spread.covariance) / np.diag(found.spread.covariance)
    return sure if quiet and np.nanmedian(ratio) < 1.0 else found


def edges(pieces: Pieces) -> Index:
    """Edges of the clusters by which errors are judged: two pieces each, where there are many."""
    # A slow force is alike in neighbours.
    every = pieces.edges
    return np.append(every[:-1:2], every[-1]) if len(every) > PIECES else every


def _quiet(end: Fit, records: Sequence[Run]) -> bool:
    return bool(np.mean(end.residual**2) <= _WHITE * noise(records))


def _memory(model: Model, end: Fit) -> float:
    """Time constant with which a driven output forgets a force, s."""
    axis = model.axis(end.values)
    if "mass" not in model.names or not (axis.spring > 0.0 or model.speed):
        return math.inf
    # Coulomb friction damps a motion of half the top speed as so much more viscous friction does.
    drag = axis.viscous + 2.0 * axis.coulomb / end.space.states[1]
    return (2.0 if axis.spring > 0.0 else 1.0) * axis.mass / drag if drag > 0.0 else math.inf


def spread(end: Fit, edges: npt.ArrayLike) -> Spread:
    free = ~end.bound
    found = clusters.spread(end.slopes[:, free], end.residual, edges)
    return found.among(np.flatnonzero(free), len(free))


def find_ripple(end: Fit, simulation: Simulated, axis: Axis) -> Ripple | None:
    """A force that repeats along the way, in the force that explains the residuals."""
    table = np.column_stack([end.slopes, -end.residual])
    simulated = simulation(end.values, end.pieces)
    forces, places, taken = [], [], []
    least = _SLOW * end.space.states[1]
    for first, last, dt in zip(
        end.pieces.edges[:-1], end.pieces.edges[1:], end.pieces.dt.tolist(), strict=True
    ):
        rows = table[first:last]
        bend = (rows[2:] - 2.0 * rows[1:-1] + rows[:-2]) / (dt * dt)
        slope = (rows[2:] - rows[:-2]) / (2.0 * dt)
        force = axis.mass * bend + axis.viscous * slope + axis.spring * rows[1:-1]
        y, way = end.pieces.y[first:last], simulated[first:last]
        # Where one of them turns or stands, friction has no known sign.
        goes = np.sign(np.diff(y)) * np.sign(np.diff(way)) > 0.0
        same = np.sign(np.diff(way))[1:] == np.sign(np.diff(way))[:-1]
        fast = np.abs(way[2:] - way[:-2]) > 2.0 * dt * least
        sure = goes[1:] & goes[:-1] & same & fast
        forces.append(force[sure, -1])
        places.append(y[1:-1][sure])
        taken.append(force[sure, :-1])
    return ripple(forces, places, taken) if sum(map(len, places)) > _FEW else None


def under(found: Found, simulated: Simulated, repeats: Ripple) -> Found:
    """The errors with those by a force that repeats along the way, in any phase."""
    # All pieces share its phase, so their scatter tells less than it does. Its two quadratures move
    # the parameters by a and b, and a phase that may be any by (a a' + b b') / 2.
    end, pieces = found.fit, found.fit.pieces
    rows = np.concatenate([
        np.arange(first, first + count)
        for first, count in zip(pieces.first, pieces.many, strict=True)
    ])  # fmt: skip
    plain = simulated(end.values, pieces)
    covariance = found.spread.covariance.copy()
    for turn in (0.0, 0.5 * math.pi):
        force = pieces.force.copy()
        force[rows] += repeats.at(pieces.y, turn)
        moved = simulated(end.values, pieces._replace(force=force)) - plain
        moved = without_starts(simulated, end, moved)
        by = solve_scaled(end.slopes, moved)
        covariance += 0.5 * np.outer(by, by)
    return found._replace(spread=found.spread._replace(covariance=covariance))


def floor_errors(found: Found, records: Sequence[Run]) -> Found:
    """The errors, none below those that rounding to counts makes where it is all that is left."""
    # Rounding repeats in all parts of a periodic motion, so their scatter tells less than it does.
    end = found.fit
    cuts = np.cumsum([len(r.x) for r in records])[:-1]
    measured, left = np.split(end.pieces.y, cuts), np.split(end.residual, cuts)
    steps = _counts.steps(measured, left)
    if steps is None:
        return found
    clean = [y + e for y, e in zip(measured, left, strict=True)]
    own = _counts.covariance(end.slopes, clean, steps)
    if not _counts.alone(end.slopes, own, measured, clean, steps):
        return found
    known = np.sqrt(np.diag(found.spread.covariance))
    with np.errstate(invalid="ignore", divide="ignore"):
        wider = np.fmax(np.sqrt(np.diag(own)) / known, 1.0)
    covariance = found.spread.covariance * np.outer(wider, wider)
    return found._replace(spread=found.spread._replace(covariance=covariance))


def warn_of_unseen(found: Found, names: tuple[str, ...]) -> None:
    """Warn of parameters that the records do not show; these lose their errors."""
    end, covariance = found.fit, found.spread.covariance
    if not end.settled:
        notice(ConvergenceWarning, "output error: not settled; the last values are returned")
    lost = clusters.unseen(end.slopes, names)
    for name in np.array(names)[end.bound].tolist():
        if name in lost:
            continue
        notice(
            DataWarning,
            f"{name} ended at 0: the record does not determine it, so it has no standard error",
        )
    for name in lost:
        at = names.index(name)
        covariance[at, :] = covariance[:, at] = np.nan
    clusters.warn_of_mixture(found.spread, names, end.values)


def is_long(runs: list[Run]) -> bool:
    return sum(len(run.t) for run in runs) > LONG


def stretches(runs: list[Run], count: int = _PARTS, length: int | None = None) -> list[Run]:
    """Evenly spread parts of the records, about so many of that length in all."""
    total = sum(len(run.t) for run in runs)
    made = []
    for run in runs:
        size = min(LONG // count if length is None else length, len(run.t))
        parts = max(min(round(count * len(run.t) / total), len(run.t) // size), 1)
        for first in np.linspace(0, len(run.t) - size, parts).astype(int):
            made.append(run.part(first, first + size))
    return made


def shorten(runs: list[Run], axis: Axis) -> list[Run]:
    """The records as means over blocks that are short for an axis; parts of what is still long."""
    total = sum(len(run.t) for run in runs)
    many = -(-total // LONG)
    if axis.mass > 0.0 and axis.viscous > 0.0:
        step = max(run.dt for run in runs)
        many = min(many, int(axis.mass / axis.viscous / step / _KEPT))
    if many > 1:
        runs = [means(run, many) for run in runs]
    return stretches(runs) if is_long(runs) else runs


# The mean position over a block responds to the mean force over the span of both blocks, so a free
# simulation is unchanged except within the block of a reversal, and noise is lower.
def means(run: Run, many: int) -> Run:
    count = len(run.t) // many
    x, u = (column[: count * many].reshape(count, many) for column in (run.x, run.u))
    rising = np.arange(1.0, many + 1.0) / many**2
    force = u @ rising
    force[:-1] += u[1:] @ (1.0 / many - rising)
    force[-1] = u[-1].mean()
    t = run.t[0] + run.dt * (many * np.arange(count) + 0.5 * (many - 1))
    return Run(t, force, x.mean(axis=1))
