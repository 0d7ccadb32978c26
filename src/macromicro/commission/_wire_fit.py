"""Model and fit of a wire's heat and contraction, in volts of steady effort; its curves.

    tau dh/dt = (1 - share) u - (h - s) - latent dz/dt
    slow ds/dt = share/(1 - share) (h - s) - s
    z = max(z, f(h - start)/(end - start)) while it warms, min(z, f(h - last)/(first - last)) while
    it cools, from 0 to 1;      f(q) = (e^(b q) - 1)/(e^b - 1);      x = way z

h is the temperature above ambient in steady effort, s that of the slow surroundings (with a share
of the resistance behind it), z the contracted share; start, end: austenite, first, last:
martensite.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.commission.stand import CommissionError, Record
from macromicro.identify import clusters
from macromicro.identify.clusters import Spread
from macromicro.identify.engine import Pieces, Space, fit
from macromicro.kernel import compiled, kernel

# Standard deviation of what the model leaves out (what is around the wire warms in more than one
# step, a bend that is not that of f), as a part of the value, by simulation: seen on 12 random
# wires of docs/commissioning_wire.py, checked on others there.
SIMULATED = 12
MODEL_ERRORS = {"up": 0.025, "tau": 0.06, "start": 0.05, "end": 0.05, "first": 0.05, "last": 0.05}
_BENT = 0.3  # to begin with
_FREE = 10  # parameters of the heat
_SHARES, _SLOWER = (0.03, 0.25), (10.0,)  # of what is around the wire, to begin with
_TAUS = (0.3, 1.0, 3.0)  # of the time constant by delays: where the search begins
_FEW, _BEST, _MOST = 6, 2, 40  # rounds of every search, how many go on, their rounds


class Wire(NamedTuple):
    heat: Heat  # the parameters
    spread: Spread  # their uncertainty, a rise or fall of the effort a cluster
    rms: float  # residual, m
    begin: tuple[Begin, ...] = ()  # heat that each record begins with; none: cold

    def half_width(self, name: str) -> float:
        """Half of the 95 % interval of a quantity, including model error."""
        if name == "up":
            value, slope = self.up, _up_slope(self.heat)
        else:
            k = Heat._fields.index(name)
            value, slope = self.heat[k], np.eye(len(self.heat))[k]
        hidden = np.array([MODEL_ERRORS.get(name, 0.0) * value])
        return float(clusters.half_widths(self.spread, slope[None], hidden, SIMULATED)[0])

    @property
    def up(self) -> float:
        """Speed of contraction per effort, m/(V s)."""
        return _up(self.heat)

    @property
    def down(self) -> float:
        """Speed of extension per heat, m/(V s)."""
        p = self.heat
        return p.way / (p.tau * (p.first - p.last) + p.latent)


class Free(NamedTuple):
    """The free parameters: logarithms, by which the four heats keep their order, and two bends.

    Behind them stands the heat that is left at the beginning of each record, by that at which
    contraction begins.
    """

    way: float

    def heat(self, values: Array) -> Heat:
        v = np.exp(values[:8]).tolist()
        share, ends = v[1] / (1.0 + v[1]), (v[4], v[4] + v[5], v[6] + v[7], v[6])
        return Heat(v[0], share, v[2], v[3], *ends, self.way, *values[8:_FREE].tolist())

    def slopes(self, values: Array) -> Array:
        """Derivatives of `Heat` by the free parameters."""
        v = np.exp(values[:8])
        table = np.zeros((len(Heat._fields), len(values)))
        rows, columns = (0, 2, 3, 4, 5, 5, 6, 6, 7), (0, 2, 3, 4, 4, 5, 6, 7, 6)
        table[rows, columns] = v[list(columns)]
        table[1, 1] = v[1] / (1.0 + v[1]) ** 2
        table[9, 8] = table[10, 9] = 1.0
        return table

    def simulated(self, values: Array, pieces: Pieces) -> Array:
        """Contraction along the records."""
        heat, out = self.heat(values), np.empty(len(pieces.y))
        rows = zip(pairwise(pieces.edges.tolist()), self.begin(values), pieces.dt, strict=True)
        for (a, b), begin, dt in rows:
            compiled(free_run)(heat, begin, pieces.force[a:b], float(dt), out[a:b])
        return out

    def begin(self, values: Array) -> list[Begin]:
        left = math.exp(values[4]) * values[_FREE:]
        return [Begin(one, one) for one in left.tolist()]


def fit_wire(records: Sequence[Record], dt: float, way: float, noise: float) -> Wire:
    """Parameters whose free simulations are nearest to the records."""
    # Residual heat from the previous drive is fitted too. Searches start at several time constants,
    # since a slow wire taken for a quick one explains the ramp as well.
    thin = [average_blocks(one, dt) for one in records]
    many = np.array([len(one.t) for one in thin])
    step, cold = np.array([one.t[1] - one.t[0] for one in thin]), np.zeros(len(thin))
    force, y = (np.concatenate([one[k] for one in thin]) for k in (1, 2))
    pieces = Pieces(force, np.cumsum(many) - many, many, step, cold, cold, y)
    free, starts = Free(way), guesses(thin[0], thin[1], way)
    names = (*Heat._fields[:_FREE], *(f"left {k}" for k in range(len(thin))))
    ones = np.ones(len(names))
    space = Space(names, ones, -np.inf * ones, np.inf * ones, (1.0, 1.0), way)
    rest = [_BENT, _BENT, *cold]
    begins = [np.array([*np.log(guess), *rest]) for guess in starts]
    first = [fit(free.simulated, space, pieces, z, most=_FEW, rounds=1) for z in begins]
    first.sort(key=lambda one: one.rms)
    ended = [
        fit(free.simulated, space, pieces, f.values, most=_MOST, rounds=2) for f in first[:_BEST]
    ]
    best = min(ended, key=lambda one: one.rms)
    if best.rms > 0.15 * way:
        raise CommissionError(
            "no heat balance explains the motion of the wire. Check for an obstacle or moving air"
        )
    own = clusters.spread(best.slopes, best.residual, _turns(thin)).of(free.slopes(best.values))
    k = Heat._fields.index("way")
    own.covariance[k, k] = 2.0 * noise**2
    return Wire(free.heat(best.values), own, best.rms, tuple(free.begin(best.values)))


def _up(p: Heat) -> float:
    return p.way * (1.0 - p.share) / (p.tau * (p.end - p.start) + p.latent)


def _up_slope(p: Heat) -> Array:
    """Derivative of `_up` by each parameter."""
    down, up = p.tau * (p.end - p.start) + p.latent, _up(p)
    by = {
        "tau": -up * (p.end - p.start) / down, "share": -up / (1.0 - p.share),
        "latent": -up / down, "start": up * p.tau / down, "end": -up * p.tau / down,
        "way": up / p.way,
    }  # fmt: skip
    return np.array([by.get(name, 0.0) for name in Heat._fields])


def guesses(ramp: Record, pulses: Record, way: float) -> list[list[float]]:
    about, made = first_guess(ramp, pulses, way), []
    for part in _TAUS:
        one = about if part == 1.0 else first_guess(ramp, pulses, way, part * about.tau)
        for share, slow in product(_SHARES, _SLOWER):
            made.append(
                [
                    one.tau, share, slow * one.tau, one.latent, one.start,
                    one.end - one.start, one.last, one.first - one.last,
                ]
            )  # fmt: skip
    return made


def first_guess(ramp: Record, pulses: Record, way: float, tau: float | None = None) -> Heat:
    """A starting point from delays and durations, without slow surroundings."""
    top = int(np.argmax(ramp.u))
    rate = float(ramp.u[top] / ramp.t[top])
    begin, end = (float(ramp.u[int(np.argmax(ramp.x >= s * way))]) for s in (0.01, 0.97))
    off = int(np.argmax((pulses.u <= 0.0) & (pulses.x > 0.5 * way)))
    push, hold = float(pulses.u[3]), float(pulses.u[off - 2])
    t, x = pulses.t, pulses.x

    def when(hit: npt.NDArray[np.bool_], after: int = 0) -> float:
        return float(t[after + int(np.argmax(hit[after:]))])

    wait = max(when(x >= 0.01 * way), float(t[1]))
    heated = max(when(x >= 0.95 * way) - wait, float(t[1]))
    fall = max(when(x <= 0.97 * way, off) - t[off], float(t[1]))
    fallen = max(when(x <= 0.03 * way, off) - t[off] - fall, float(t[1]))
    if tau is None:
        tau = _tau(rate, begin, push, wait)
    start = push * (1.0 - math.exp(-wait / tau))
    span = max(end - start, 0.05 * start)
    both = heated * max(push - start - 0.5 * span, 0.05 * push)
    root = (end - start) ** 2 - 4.0 * rate * both
    width = 0.5 * (end - start + math.sqrt(root)) if root > 0.0 else 0.5 * span
    width = max(width, 0.05 * start)
    latent = max(both - tau * width, 0.1 * both)
    first = hold * math.exp(-fall / tau)
    cold = (first * fallen - latent) / (tau + 0.5 * fallen)
    cold = min(max(cold, 0.1 * first), 0.8 * first)
    return Heat(tau, 0.0, tau, latent, start, start + width, first, first - cold, way)


def _tau(rate: float, begin: float, push: float, wait: float) -> float:
    """The time constant at which ramp and pulse start contraction at one heat."""
    from scipy.optimize import brentq

    def early(tau: float) -> float:
        ramped = begin - tau * rate * (1.0 - math.exp(-begin / (tau * rate)))
        return push * (1.0 - math.exp(-wait / tau)) - ramped

    low, high = 0.05 * wait, 50.0 * wait
    return float(brentq(early, low, high)) if early(low) * early(high) < 0.0 else 0.7 * wait


def _turns(records: Sequence[Record]) -> Array:
    """Edges of heating and cooling."""
    cuts, done = [], 0
    for one in records:
        steps = np.flatnonzero(np.abs(np.diff(one.u)) > 0.05 * np.ptp(one.u)) + 1
        kept = steps[np.diff(steps, prepend=-10) > 5]
        cuts += [done + int(k) for k in kept if k > 5]
        done += len(one.u)
        cuts.append(done)
    return np.array([0, *cuts])


# The wire cools to a share of its travel and is warmed again. The heat follows from effort and
# measured contraction by the heat balance above, without a hysteresis model.

_BEGUN, _HALF = 0.03, 0.5  # of a curve's rise: between these its slope is taken
_LEVELS = (0.3, 0.5, 0.7)  # of the way, at which ways down are compared


class Curve(NamedTuple):
    """A cooling branch, and the curve back up."""

    # heat, x: V and m, from contracted on
    heat: Array
    x: Array
    turn: int  # row from which the effort rises again


class Curves(NamedTuple):
    # heat (V) and contraction (m) of the first warming, from extended to contracted
    first: tuple[Array, Array]
    every: list[Curve]  # in their order; the last one goes down only


def heat_along(p: Heat, record: Record) -> Array:
    """Heat along a record that begins cold."""
    dt = float(record.t[1] - record.t[0])
    gone = np.diff(record.x, prepend=record.x[0]) / p.way
    behind, h, around = p.share / (1.0 - p.share), 0.0, 0.0
    made = np.empty_like(record.x)
    for k, (u, dz) in enumerate(zip(record.u.tolist(), gone.tolist(), strict=True)):
        # tau dh + latent dz = ((1 - share) u - (h - s)) dt
        h += (((1.0 - p.share) * u - h + around) * dt - p.latent * dz) / p.tau
        around += (behind * (h - around) - around) * dt / p.slow
        made[k] = h
    return made


def curves(record: Record, p: Heat, dt: float) -> Curves:
    thin = average_blocks(record, dt)
    h = heat_along(p, thin)
    rising = np.diff(thin.u) > 0.0
    turns = [0, *(np.flatnonzero(rising[1:] != rising[:-1]) + 1).tolist(), len(thin.t) - 1]
    tops, lows = turns[1::2], turns[2::2]
    ends = [*tops[1:], len(thin.t)]
    every = [
        Curve(h[top:end], thin.x[top:end], low - top)
        for top, low, end in zip(tops, lows, ends, strict=False)
    ]
    return Curves((h[: tops[0] + 1], thin.x[: tops[0] + 1]), every)


def slower(found: Curves) -> list[float]:
    """Additional heat of each curve over the branch for the first half of its rise."""
    made = []
    for one in found.every[:-1]:
        least = int(np.argmin(one.x))  # it goes on for a while after the effort has turned
        back, heat = one.x[least:], one.heat[least:]
        low = float(back[0])
        levels = [low + part * (float(back.max()) - low) for part in (_BEGUN, _HALF)]
        own, branch = (_span(*pair, levels) for pair in ((heat, back), found.first))
        made.append(own / branch)
    return made


def answer(record: Record, p: Heat, dt: float) -> float:
    """Additional effort of a law between the branches."""
    every = slower(curves(record, p, dt))
    return max(sum(every) / len(every), 1.0) if every else 1.0


def spread(found: Curves) -> float:
    """Scatter of the heats at which cooling branches pass equal positions."""
    top = max(float(one.x.max()) for one in found.every)
    most = 0.0
    for level in _LEVELS:
        at = [
            one.heat[int(np.argmax(one.x <= level * top))]
            for one in found.every
            if float(one.x.min()) < level * top
        ]
        most = max(most, float(np.ptp(at)) if at else 0.0)
    return most


def _span(heat: Array, x: Array, levels: list[float]) -> float:
    """Heat between two levels of contraction, V."""
    first, second = (heat[int(np.argmax(x >= level))] for level in levels)
    return max(float(second - first), 1e-9)


_ROWS = 1500  # of a record
_NEAR = 1e-10  # of a branch: where its heat content is found
_PATIENT = 40  # steps of Newton's, or halvings
_STRAIGHT = 1e-6


class Heat(NamedTuple):
    tau: float  # time constant of the wire, s
    share: float  # of the resistance to the room behind what warms slowly
    slow: float  # time constant of that, s
    latent: float  # of the whole contraction, V s
    # start, end: heat at which contraction begins and ends, V
    start: float
    end: float
    # first, last: heat at which extension begins and ends, V
    first: float
    last: float
    way: float  # full contraction, m
    warming: float = 0.0  # curvature of the branches
    cooling: float = 0.0  # 0 is straight


class Begin(NamedTuple):
    """Initial heat of a record: an extended wire is not always cold."""

    heat: float  # of the wire, V
    around: float  # of what is around it, V


COLD = Begin(0.0, 0.0)


@kernel
def branch(q: float, bend: float) -> float:
    inside = min(max(q, 0.0), 1.0)
    if abs(bend) < _STRAIGHT:
        return inside
    return math.expm1(bend * inside) / math.expm1(bend)


def steepest(p: Heat) -> float:
    """Greatest contraction per heat on either branch."""
    ways = ((p.end - p.start, p.warming), (p.first - p.last, p.cooling))
    return max(_steep(bend) / way for way, bend in ways)


def _steep(bend: float) -> float:
    """The greatest slope of `branch`, at one of its ends."""
    b = abs(bend)
    return 1.0 if b < _STRAIGHT else b / -math.expm1(-b)


@kernel
def along(z: float, bend: float) -> float:
    if abs(bend) < _STRAIGHT:
        return z
    return math.log1p(z * math.expm1(bend)) / bend


@kernel
def steepness(z: float, bend: float) -> float:
    """Slope of `branch` at a contraction."""
    if abs(bend) < _STRAIGHT:
        return 1.0
    return bend * (1.0 / math.expm1(bend) + z)


@kernel
def settled(p: Heat, content: float, z: float, warming: bool) -> tuple[float, float]:
    """Heat and contraction for a heat content that rose or fell to it."""
    at, over, bend = p.last, p.first - p.last, p.cooling
    if warming:
        at, over, bend = p.start, p.end - p.start, p.warming
    # As a share of the branch: what no transformation would give, and where it was left.
    free = ((content - p.latent * z) / p.tau - at) / over
    left = along(z, bend)
    if (warming and free <= left) or (not warming and free >= left):
        return at + over * free, z
    low, high, q = min(left, free), max(left, free), left
    part, goal = p.tau * over, content - p.tau * at
    for _ in range(_PATIENT):
        there = branch(q, bend)
        missing = goal - part * q - p.latent * there
        if abs(missing) < _NEAR * part:
            break
        if missing > 0.0:
            low = q
        else:
            high = q
        slope = steepness(there, bend) if 0.0 <= q <= 1.0 else 0.0
        near = q + missing / (part + p.latent * slope)
        q = near if low < near < high else 0.5 * (low + high)
    return at + over * q, branch(q, bend)


@kernel
def free_run(p: Heat, begin: Begin, efforts: Array, dt: float, out: Array) -> None:
    """Contraction under efforts from extended."""
    # Heun's rule for the heat content; heat and contraction follow from it, so branches begin and
    # end between samples and results are smooth in the parameters.
    h, around, z = begin.heat, begin.around, 0.0
    behind = p.share / (1.0 - p.share)
    for k in range(len(efforts)):
        push = (1.0 - p.share) * efforts[k] - h + around
        warm = behind * (h - around) - around
        content = p.tau * h + p.latent * z
        h1, _ = settled(p, content + push * dt, z, push > 0.0)
        around1 = around + warm * dt / p.slow
        push = 0.5 * (push + (1.0 - p.share) * efforts[k] - h1 + around1)
        warm = 0.5 * (warm + behind * (h1 - around1) - around1)
        before = z
        h, z = settled(p, content + push * dt, z, push > 0.0)
        around += warm * dt / p.slow
        out[k] = 0.5 * p.way * (before + z)


def simulate(p: Heat, record: Record, begin: Begin = COLD) -> Array:
    out = np.empty_like(record.x)
    plain = Heat(*(float(v) for v in p))
    warm = Begin(*(float(v) for v in begin))
    compiled(free_run)(plain, warm, record.u, float(record.t[1] - record.t[0]), out)
    return out


def average_blocks(record: Record, dt: float) -> Record:
    """Means over equal blocks, few enough."""
    every = max(len(record.t) // _ROWS, 1)
    n = len(record.t) // every * every
    u, x = (c[:n].reshape(-1, every).mean(axis=1) for c in (record.u, record.x))
    t = np.arange(len(u)) * every * dt
    return Record(np.asarray(t, float), np.asarray(u, float), np.asarray(x - record.x[0], float))
