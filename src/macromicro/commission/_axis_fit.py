"""Model of an axis from its strokes: mass, friction along the travel, lag, limit of the force.

    M dv/dt = u(t - lag) - Fv v - s (Fc(x) + Fs exp(-(v/vs)^2)) - F0 - A sin x - B cos x,  s = sgn v

Force is in volts of effort; back-EMF is part of Fv. Friction along the travel is common to all
strokes, so no number of them averages it away: it is fitted at places along the travel, with the
scatter of the measured breakaway as a prior.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.commission.stand import BALANCED, CommissionError, Pull, Record
from macromicro.identify import clusters
from macromicro.identify.clusters import Spread
from macromicro.identify.engine import Fit, Index, Pieces, Space, fit
from macromicro.kernel import compiled, kernel
from macromicro.machines import feasible
from macromicro.models.mass import Axis, acting, glide, late

if TYPE_CHECKING:
    from macromicro.commission._mode import Mode

KNOTS = 20  # places along the travel at which friction is fitted
FITTED = ("mass", "viscous", "coulomb", "offset", "lag")
GRAVITY = ("sine", "cosine")
_LIMIT = ("limit", "back")  # fitted where the drive limits its force
_SPEEDS = (0.01, 1e-3, 0.03, 0.1, 0.3)  # Stribeck speeds tried, parts of the top speed
_FINER = 2  # times that the best speed's neighbours are halved
_LIMITS = (0.1, 0.2, 0.4, 0.7)  # of the largest effort: limits of the force to begin with
_LIMITED = 0.7  # a limit must lower the error to that part
_DROPPED = 0.85  # of the breakaway: sliding friction to begin with where none drops,
_NO_DROP = 0.95  # where it is above that
_LATEST = 12  # whole periods of lag tried
_LEAD = _LATEST + 2
_COMPARED = 150  # samples of a usual stroke
_FADED = 3.0  # Stribeck speeds at which breakaway friction has faded
_SOME = 3  # every third stroke looks for a limit
_ROUNDS = 12  # of a search
_WITNESSES = 5.0  # values that a stroke counts for when data and prior are weighed
_MARGIN = 1.001  # beyond the shortest time constant that is accepted, for rounding
# Standard deviation of what the model leaves out (bristles, the current's rise), as a part of the
# value, by simulation: seen on 12 random axes of docs/make_commissioning.py, checked on 40 others.
SIMULATED = 12  # axes by which these are known
MODEL_ERRORS = {"mass": 0.002, "viscous": 0.003, "coulomb": 0.006}
# The same of a constant force, as a part of the sliding friction (the D/A rounds what holds a
# weight to one of its steps): seen on 15 axes that sink, and checked on others.
_CONSTANT = 0.0007
# Part of lag Fv by which the mass is expected to be larger, and its standard deviation: the
# product of two shares between 0 and 1 of which nothing is known.
_ELECTRICAL = 0.25
_SOONEST, _UNSEEN = 0.02, 0.3  # periods: a lag that is none, and how far off that may be (std.)
APART = (
    "the strokes do not separate mass and friction. Check that there are strokes in both "
    "directions and that the encoder resolves them"
)


class Level(NamedTuple):
    places: Array  # evenly spaced, m
    levels: Array  # in addition to Coulomb friction, V


class Model(NamedTuple):
    axis: Axis  # the parameters, in V and m
    level: Level  # friction along the travel
    names: tuple[str, ...]  # the fitted ones
    spread: Spread  # their uncertainty by the strokes
    hidden: Array  # covariance of what the model leaves out
    rms: float  # of the strokes' positions, m
    hold: float = 0.0  # effort that was beside the strokes' all the time, V: a weight's
    mode: Mode | None = None  # by the chirp

    @property
    def limber(self) -> Mode | None:
        return self.mode if self.mode is not None and self.mode.found else None

    def shaken(self, mode: Mode | None) -> Model:
        """The model with a mode; its lag is then the chirp's, for a mode resembles one."""
        made = self._replace(mode=mode)
        if made.limber is None:
            return made
        kept = [k for k, name in enumerate(self.names) if name != "lag"]
        return made._replace(
            axis=self.axis._replace(lag=made.limber.values["lag"]),
            names=tuple(self.names[k] for k in kept),
            spread=self.spread.some(np.array(kept)),
            hidden=self.hidden[np.ix_(kept, kept)],
        )

    @property
    def whole(self) -> Axis:
        """The parameters with all of the constant force."""
        return self.axis._replace(offset=self.axis.offset + self.hold)

    @property
    def covariance(self) -> Array:
        return self.spread.covariance + self.hidden

    def half_widths(self, slopes: Array) -> Array:
        """Halves of the 95 % intervals of functions of the fitted parameters."""
        hidden = clusters.errors(self.hidden, slopes)
        return clusters.half_widths(self.spread, slopes, hidden, SIMULATED)

    def half_width(self, name: str) -> float:
        return float(self.half_widths(np.eye(len(self.names))[[self.names.index(name)]])[0])


class Strokes(NamedTuple):
    records: Sequence[Record]
    dt: float
    every: int  # samples of a stroke from one that is compared to the next
    top: float  # greatest speed, m/s
    push: float  # largest effort, V
    places: Array  # evenly spaced along the travel, m
    # each a stroke whose state is its place and the speed that bristles have taken, and one without
    # samples for a prior
    pieces: Pieces


class Sliding(NamedTuple):
    """The free parameters, and what is known of the axis beside the strokes."""

    names: tuple[str, ...]  # levels of friction along the travel follow
    fixed: Axis
    breakaway: float  # effort, V
    mean: Array  # prior of all parameters
    error: Array  # its standard errors; infinite where it says nothing
    places: Array  # evenly spaced along the travel, m
    every: int  # samples from one that is compared to the next
    weight: float = 0.0  # mean square of the strokes' errors, as much as these count, m^2

    def axis(self, values: Array) -> Axis:
        own = dict(zip(self.names, values.tolist(), strict=False))
        made = self.fixed._replace(**own)
        return made._replace(stribeck=max(self.breakaway - made.coulomb, 0.0))

    def values(self, axis: Axis) -> Array:
        own = [getattr(axis, name) for name in self.names]
        return np.array([*own, *np.zeros(len(self.mean) - len(own))])

    def simulated(self, values: Array, pieces: Pieces) -> Array:
        """Positions of the strokes, then what the prior misses, as positions."""
        axis = Axis(*(float(value) for value in self.axis(values)))
        levels = np.zeros(KNOTS)
        levels[: len(values) - len(self.names)] = values[len(self.names) :]
        out = np.empty(len(pieces.y))
        dt, strokes = float(pieces.dt[0]), len(pieces.many) - 1  # the last piece is the prior's
        force = np.ascontiguousarray(late(pieces.force, axis.lag / dt))
        first, count, x0 = pieces.first[:strokes], pieces.many[:strokes], pieces.x[:strokes]
        track = Level(self.places, levels)
        compiled(free_run)(axis, track, force, first, count, self.every, dt, x0, out)
        out += self._without(axis, pieces)
        off = (values - self.mean) / self.error
        out[len(out) - len(off) :] = math.sqrt(self.weight) * off
        return out

    def _without(self, axis: Axis, pieces: Pieces) -> Array:
        """Distance that strokes lose by the speed that bristles have taken."""
        # Bristles absorb momentum before the axis slides, which sliding friction does not model.
        if not pieces.v.any():
            return np.zeros(len(pieces.y))
        rows = np.arange(len(pieces.y)) - np.repeat(pieces.edges[:-1], pieces.many)
        t = self.every * pieces.dt[0] * rows
        fall = axis.viscous / axis.mass
        way: Array = t if fall * t.max() < 1e-6 else -np.expm1(-fall * t) / fall
        return np.asarray(way * pieces.spread(pieces.v))

    def search(self, strokes: Strokes, begin: Array, most: int, rounds: int = 1) -> Fit:
        """The minimum next to a starting point."""
        pieces, count = strokes.pieces, len(begin)
        many = np.append(pieces.many[:-1], count)
        pieces = pieces._replace(many=many, y=np.concatenate([pieces.y, np.zeros(count)]))
        space = self._space(self.axis(begin), strokes)
        return fit(self.simulated, space, pieces, begin, most=most, rounds=rounds)

    def _space(self, begin: Axis, strokes: Strokes) -> Space:
        """Scales and bounds of the parameters."""
        push, top = strokes.push, strokes.top
        usual = {"mass": 0.0, "viscous": 0.05 * push / top, "lag": strokes.dt}
        lowest = {**dict.fromkeys(("offset", *GRAVITY), -np.inf), "mass": 1e-3, "limit": 1e-3}
        scale = [max(abs(getattr(begin, n)), usual.get(n, 0.05 * push)) for n in self.names]
        scale = [1.0 if n == "back" else one for n, one in zip(self.names, scale, strict=True)]
        count = len(self.mean) - len(self.names)
        return Space(
            self.names,
            np.array(scale + self.error[len(self.names) :].tolist()),
            np.array([*(lowest.get(n, 0.0) for n in self.names), *[-np.inf] * count]),
            np.array([*(1.0 if n == "back" else np.inf for n in self.names), *[np.inf] * count]),
            (float(np.ptp(self.places)), top),
            float(np.std(strokes.pieces.y)),
        )


@kernel
def free_run(
    p: Axis, track: Level, force: Array, first: Index, count: Index, every: int, h: float,
    x0: Array, out: Array,
) -> None:  # fmt: skip
    """Each so many positions of strokes from rest, with friction along the travel, as a kernel."""
    low, apart = track.places[0], track.places[1] - track.places[0]
    levels = track.levels
    row = 0
    for piece in range(len(first)):
        x = x0[piece]
        v = 0.0
        for k in range(count[piece]):
            out[row] = x
            row += 1
            at = first[piece] + k * every
            # Steps are exact while force and friction are the same.
            many = every if abs(v) > _FADED * p.stribeck_speed else 1
            for j in range(at, at + every):
                if force[j] != force[at]:
                    many = 1
            for j in range(at, at + every, many):
                place = min(max((x - low) / apart, 0.0), len(levels) - 1.000001)
                knot = int(place)
                level = levels[knot] + (place - knot) * (levels[knot + 1] - levels[knot])
                here = Axis(
                    p.mass, p.viscous, max(p.coulomb + level, 0.0), p.offset, p.asymmetry,
                    p.stribeck, p.stribeck_speed, p.lag, p.limit, p.back, p.sine, p.cosine,
                    p.spring, p.dead_zone,
                )  # fmt: skip
                v, gone = glide(here, v, acting(p, force[j], x, v, many * h), many * h)
                x += gone


def fit_axis(
    records: Sequence[Record],
    dt: float,
    breakaway: float,
    spread: float,
    slid: float = 0.0,
    pull: Pull = BALANCED,
) -> Model:
    """Parameters with the free simulations nearest to the strokes."""
    # How fast breakaway friction fades is hardly observable but affects the mass, so several speeds
    # are averaged (Hoeting et al. 1999, Bayesian model averaging). Errors that no stroke shows are
    # added.
    strokes = as_strokes(records, dt)
    names = FITTED if pull == BALANCED else (*FITTED, *GRAVITY)
    start, breakaway, square = _with_force_limit(
        as_strokes(records[::_SOME], dt), breakaway, slid, pull
    )
    free = names if math.isinf(start.limit) else (*names, *_LIMIT)
    known = dict(zip(GRAVITY, pull[:2], strict=True))
    sure = dict.fromkeys(GRAVITY, pull.error or math.inf)
    mean = np.array([*(known.get(n, 0.0) for n in free), *np.zeros(KNOTS)])
    error = np.array([*(sure.get(n, math.inf) for n in free), *np.full(KNOTS, spread)])
    model = Sliding(free, start, breakaway, mean, error, strokes.places, strokes.every)
    witnesses = len(strokes.pieces.y) / (_WITNESSES * len(records))
    prior = witnesses / error**2
    every = _by_speed(strokes, model._replace(weight=square * witnesses), start)
    squares = np.array([_square(end) for _, end in every])
    best, chosen = every[int(np.argmin(squares))]
    own, freedom = _spread(chosen, prior), _freedom(chosen, prior)
    weights = np.exp(-0.5 * freedom * (squares / squares.min() - 1.0))
    weights /= weights.sum()
    count = len(names)
    values = np.array([end.values[:count] for _, end in every])
    drops = np.array([(a.stribeck, a.stribeck_speed) for a in (m.axis(e.values) for m, e in every)])
    middle = weights @ values
    covariance = np.einsum("k,ki,kj->ij", weights, values - middle, values - middle)
    for weight, (_, end) in zip(weights, every, strict=True):
        covariance += weight * _spread(end, prior).covariance[:count, :count]
    own = own.some(np.arange(count))._replace(covariance=covariance)
    shift, hidden = _left_out(middle, names, strokes.places, dt)
    middle = _possible(middle + shift, covariance + hidden, names, clusters.within(freedom), dt)
    stribeck, speed = (weights @ drops).tolist()
    axis = best.axis(chosen.values)._replace(
        **dict(zip(names, middle.tolist(), strict=True)), stribeck=stribeck, stribeck_speed=speed
    )
    level = Level(strokes.places, chosen.values[len(free) :])
    return Model(axis, level, names, own, hidden, math.sqrt(squares.min()))


def as_strokes(records: Sequence[Record], dt: float) -> Strokes:
    """The strokes as pieces of the search."""
    every = max(sum(len(one.t) for one in records) // (_COMPARED * len(records)), 1)
    forces: list[Array] = []
    rows, measured, used = [], [], 0
    for one in records:
        forces += [np.full(_LEAD, one.u[0]), one.u, np.full(every, one.u[-1])]
        x = one.x[::every]
        rows.append((used + _LEAD, len(x), dt, float(x[0]), 0.0))
        measured.append(x)
        used += _LEAD + len(one.u) + every
    rows.append((used, 0, dt, 0.0, 0.0))
    first, count, each, x0, lost = (np.array(column) for column in zip(*rows, strict=True))
    y = np.concatenate(measured)
    top = max(float(np.abs(np.gradient(one.x, dt)).max()) for one in records)
    push = max(float(np.abs(one.u).max()) for one in records)
    pieces = Pieces(np.concatenate(forces), first, count, each, x0, lost, y)
    places = np.linspace(y.min(), y.max(), KNOTS)
    return Strokes(records, dt, every, top, push, places, pieces)


def weakest(strokes: Sequence[Record]) -> list[Record]:
    """The third with the smallest efforts, least affected by a limit."""
    return sorted(strokes, key=lambda s: np.abs(s.u).max())[: len(strokes) // 3]


def momentum(strokes: Sequence[Record], dt: float, pull: Pull = BALANCED) -> Axis:
    """Starting point by the momentum balance of strokes from rest, linear in the parameters.

    The integral of u is M v + Fv (x - x0) + (s Fc + F0) t; the lag is the best whole number of
    periods.
    """
    best, least = None, math.inf
    for lag in range(_LATEST + 1):
        table = np.concatenate([_balance(s, float(lag), dt, pull) for s in strokes])
        left, right = table[:, :-1], table[:, -1]
        scale = np.linalg.norm(left, axis=0)
        if not (scale > 0.0).all() or np.linalg.cond(left / scale) > 1e7:
            break
        theta = np.linalg.lstsq(left / scale, right, rcond=None)[0] / scale
        error = float(np.linalg.norm(right - left @ theta))
        if error < least:
            best, least = (theta.tolist(), lag), error
    if best is None or (best[0][0] <= 0.0 and best[0][1] <= 0.0):
        raise CommissionError(APART)
    (mass, viscous, coulomb, offset), late_by = best
    if mass <= 0.0:
        # So strongly damped that the encoder's steps hide its momentum: its lag is much the same.
        mass = viscous * dt
    return Axis(
        mass, max(viscous, 0.0), max(coulomb, 0.0), offset, lag=max(late_by, 0.1) * dt,
        sine=pull.sine, cosine=pull.cosine,
    )  # fmt: skip


def _balance(stroke: Record, lag: float, dt: float, pull: Pull) -> Array:
    """The momentum balance of a stroke from rest, a row per sample."""
    speed = np.gradient(stroke.x, dt)
    way = math.copysign(1.0, stroke.x[-1] - stroke.x[0])
    pushed = late(stroke.u - pull.along(stroke.x), lag)
    impulse = np.concatenate([[0.0], np.cumsum(pushed[:-1])]) * dt
    columns = [speed, stroke.x - stroke.x[0], way * stroke.t, stroke.t, impulse]
    return np.stack(columns, axis=1)


def _with_force_limit(
    strokes: Strokes, breakaway: float, slid: float, pull: Pull
) -> tuple[Axis, float, float]:
    """The start of the fit, with a force limit if that explains the strokes far better."""
    every, dt = strokes.records, strokes.dt
    try:
        start = momentum(every, dt, pull)
    except CommissionError:
        start = momentum(weakest(every), dt, pull)
    try:
        gentle = momentum(weakest(every), dt, pull)
    except CommissionError:
        gentle = start
    breakaway = max(breakaway - start.viscous * slid, 0.5 * breakaway)
    slow = _SPEEDS[0] * strokes.top

    def uniform(begin: Axis) -> tuple[Axis, Fit]:
        names = FITTED if math.isinf(begin.limit) else (*FITTED, *_LIMIT)
        none = np.zeros(len(names)), np.full(len(names), np.inf)
        fixed = begin._replace(stribeck_speed=slow)
        model = Sliding(names, fixed, breakaway, *none, strokes.places, strokes.every)
        found = model.search(strokes, model.values(begin), 2 * _ROUNDS)
        return model.axis(found.values), found

    best, plain = uniform(start)
    least, square = _LIMITED, _square(plain)
    # A late force and a limited one look alike: begin on both sides.
    for part, lag in product(_LIMITS, {gentle.lag, 0.1 * dt}):
        axis, found = uniform(gentle._replace(lag=lag, limit=part * strokes.push))
        left = _relative_residual(found, plain)
        if left < least and axis.limit < strokes.push:
            best, least, square = axis, left, _square(found)
    return best, breakaway, square


def _relative_residual(found: Fit, plain: Fit) -> float:
    """Residual relative to a plain model: overall, or the mean over strokes against outliers."""
    mine, other = (np.maximum(f.pieces.totals(f.residual**2)[:-1], 1e-300) for f in (found, plain))
    typical = float(np.exp(0.5 * np.mean(np.log(mine / other))))
    return min(math.sqrt(float(mine.sum() / other.sum())), typical)


def _by_speed(strokes: Strokes, model: Sliding, start: Axis) -> list[tuple[Sliding, Fit]]:
    """Fits at several Stribeck speeds."""
    tried: dict[float, tuple[Sliding, Fit]] = {}

    def fit_at(speed: float, begins: Sequence[Array]) -> None:
        fixed = model.fixed._replace(stribeck_speed=speed * strokes.top)
        own = model._replace(fixed=fixed)
        ends = [own.search(strokes, begin, _ROUNDS) for begin in begins]
        tried[speed] = own, min(ends, key=_square)

    def nearest(speed: float) -> Array:
        return tried[min(tried, key=lambda one: abs(math.log(one / speed)))][1].values

    fit_at(_SPEEDS[0], [model.values(start)])
    dropped = []
    if start.coulomb > _NO_DROP * model.breakaway:
        # No search that begins without a drop finds one: what it tries there changes nothing.
        lower, later = _DROPPED * model.breakaway, max(start.lag, strokes.dt)
        dropped = [model.values(start._replace(coulomb=lower, lag=later))]
    for speed in _SPEEDS:
        fit_at(speed, [nearest(speed), *dropped])
    for _ in range(_FINER):
        known = sorted(tried)
        best = min(range(len(known)), key=lambda k: _square(tried[known[k]][1]))
        for k in {max(best - 1, 0), min(best, len(known) - 2)}:
            middle = math.sqrt(known[k] * known[k + 1])
            fit_at(middle, [nearest(middle)])
    return list(tried.values())


def _square(found: Fit) -> float:
    """Mean square of what the positions miss."""
    rows = int(found.pieces.edges[-2])
    return float(np.mean(found.residual[:rows] ** 2))


def _spread(found: Fit, prior: Array) -> Spread:
    """Uncertainty by the strokes, a cluster each, with the prior's information."""
    edges, known = found.pieces.edges[:-1], np.diag(_square(found) * prior)
    return clusters.spread(found.slopes, found.residual, edges, known)


def _freedom(found: Fit, prior: Array) -> float:
    """Strokes less all that was fitted, the levels as far as the prior leaves them free."""
    rows = found.slopes[: found.pieces.edges[-2]]
    scale = np.linalg.norm(rows, axis=0)
    seen = scale > 0.0
    table = rows[:, seen] / scale[seen]
    shown = table.T @ table
    known = np.diag(_square(found) * prior[seen] / scale[seen] ** 2)
    used = np.trace(np.linalg.pinv(shown + known, hermitian=True) @ shown)
    return max(len(found.pieces.many) - 1.0 - float(used), 1.0)


def _left_out(mean: Array, names: Sequence[str], places: Array, dt: float) -> tuple[Array, Array]:
    """Correction of the parameters, and the covariance of errors that no stroke shows."""
    # An inductance shows as a lag, and its back-EMF as less mass: by lag Fv if all of the lag is
    # electrical and all of the slope back-EMF. The actual shares are unknown.
    known = dict(zip(names, mean.tolist(), strict=True))
    electrical = _ELECTRICAL * known["lag"] * known["viscous"]
    shift = np.array([electrical if name == "mass" else 0.0 for name in names])
    std = np.array([MODEL_ERRORS.get(name, 0.0) for name in names]) * (mean + shift)
    variance = std**2 + shift**2
    if known["lag"] < _SOONEST * dt:  # at its bound, where nothing says how sure it is
        variance[list(names).index("lag")] += (_UNSEEN * dt) ** 2
    # The model error is another force at each position. On a short travel gravity and a constant
    # force can hardly be separated.
    at = [k for k, name in enumerate(names) if name in ("offset", *GRAVITY)]
    table = np.stack([np.ones_like(places), np.sin(places), np.cos(places)], axis=1)[:, : len(at)]
    shared = np.linalg.pinv(table.T @ table / len(places))
    covariance = np.diag(variance)
    covariance[np.ix_(at, at)] += (_CONSTANT * known["coulomb"]) ** 2 * shared
    return shift, covariance


def _possible(
    mean: Array, covariance: Array, names: Sequence[str], within: float, dt: float
) -> Array:
    """Parameters with a feasible time constant for the period, if strokes allow it."""
    # With strong damping, strokes determine only the sum of `mass / viscous` and `lag`, and the
    # best mass may be too small for any loop at this period. So the most likely ones under `mass >=
    # feasible.PERIODS dt viscous` are taken; lag and friction follow by their covariance.
    mass, viscous, lag = (list(names).index(n) for n in ("mass", "viscous", "lag"))
    shortest = _MARGIN * feasible.PERIODS * dt
    missing = shortest * mean[viscous] - mean[mass]
    slope = np.zeros(len(mean))
    slope[mass], slope[viscous] = 1.0, -shortest
    moved = covariance @ slope
    variance = float(slope @ moved)
    if missing <= 0.0 or variance <= 0.0 or missing > within * math.sqrt(variance):
        return mean
    found = mean + moved * (missing / variance)
    found[lag] = max(found[lag], 0.0)
    return np.asarray(found)


def shows_time_constant(axis: Axis, dt: float) -> bool:
    """Whether the mass is not the smallest that suits the period."""
    return axis.mass > _MARGIN**2 * feasible.PERIODS * dt * axis.viscous
