"""Fit of a wire's heat and contraction, and its first-order curves over the heat."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.commission.stand import CommissionError, Record
from macromicro.commission.wire_model import Begin, Heat, simulated, thinned

# Standard deviation of what the model leaves out (what is around the wire warms in more than one
# step, a bend that is not that of f), as a part of the value: seen on 12 random wires of
# docs/commissioning_wire.py, and checked on others there.
LEFT_OUT = {"up": 0.025, "tau": 0.06, "start": 0.05, "end": 0.05, "first": 0.05, "last": 0.05}
_BENT = 0.3  # to begin with
_SHARES, _SLOWER = (0.03, 0.25), (10.0,)  # of what is around the wire, to begin with
_TAUS = (0.3, 1.0, 3.0)  # of the time constant by delays: where the search begins
_FEW, _BEST, _ROUNDS = 6, 2, 40  # rounds of every search, how many go on, their rounds
_STEP = 1e-3  # of a parameter, for differences


class Wire(NamedTuple):
    heat: Heat  # the parameters
    covariance: Array  # of them, a rise or fall of the effort a witness
    freedom: float  # clusters less one
    rms: float  # residual, m
    begin: tuple[Begin, ...] = ()  # heat that each record begins with; none: cold

    def deviation(self, name: str) -> float:
        """Standard deviation of a quantity, including model error."""
        if name == "up":
            value, slope = self.up, _up_slope(self.heat)
            square = float(slope @ self.covariance @ slope)
        else:
            k = Heat._fields.index(name)
            value, square = self.heat[k], float(self.covariance[k, k])
        return math.hypot(math.sqrt(max(square, 0.0)), LEFT_OUT.get(name, 0.0) * value)

    @property
    def up(self) -> float:
        """Speed of contraction per effort, m/(V s)."""
        return _up(self.heat)

    @property
    def down(self) -> float:
        """Speed of extension per heat, m/(V s)."""
        p = self.heat
        return p.way / (p.tau * (p.first - p.last) + p.latent)


def _up(p: Heat) -> float:
    return p.way * (1.0 - p.share) / (p.tau * (p.end - p.start) + p.latent)


def _up_slope(p: Heat) -> Array:
    """Derivative of `_up` by each parameter."""
    steps = {n: 1e-6 * max(abs(v), 1e-3) for n, v in p._asdict().items()}
    near = {n: p._replace(**{n: getattr(p, n) + step}) for n, step in steps.items()}
    return np.array([(_up(near[n]) - _up(p)) / step for n, step in steps.items()])


def fitted(records: Sequence[Record], dt: float, way: float, noise: float) -> Wire:
    """Parameters whose free simulations are nearest to the records."""
    # Residual heat from the previous drive is fitted too. Searches start at several time constants,
    # since a slow wire taken for a quick one explains the ramp as well.
    from scipy.optimize import least_squares

    thin = [thinned(one, dt) for one in records]

    def heat(p: Array) -> Heat:
        v, bends = np.exp(p[:8]), p[8:10]
        # Differences keep the four in their order.
        share = v[1] / (1.0 + v[1])
        return Heat(v[0], share, v[2], v[3], v[4], v[4] + v[5], v[6] + v[7], v[6], way, *bends)

    def begin(p: Array) -> list[Begin]:
        return [Begin(left, left) for left in (math.exp(p[4]) * p[10:]).tolist()]

    def missed(p: Array) -> Array:
        wire = heat(p)
        return np.concatenate(
            [(r.x - simulated(wire, r, b)) / way for r, b in zip(thin, begin(p), strict=True)]
        )

    def jac(p: Array) -> Array:
        # Steps of their own: parts of the logarithms, which may be 0, say nothing of the scale.
        return _slopes(missed, p, _STEP)

    first = [
        least_squares(missed, [*np.log(g), _BENT, _BENT, *np.zeros(len(thin))], jac, max_nfev=_FEW)
        for g in guesses(thin[0], thin[1], way)
    ]
    first.sort(key=lambda one: float(one.cost))
    ended = [least_squares(missed, one.x, jac, max_nfev=_ROUNDS) for one in first[:_BEST]]
    best = min(ended, key=lambda one: float(one.cost))
    p = Heat(*(float(v) for v in heat(best.x)))
    if math.sqrt(np.mean(best.fun**2)) > 0.15:
        raise CommissionError(
            "no heat balance explains the motion of the wire. Check for an obstacle or moving air"
        )
    slopes = _slopes(lambda p: np.array(heat(p)), best.x, 1e-5)
    bread = np.linalg.pinv(best.jac.T @ best.jac, hermitian=True)
    cuts = _turns(thin)
    parts = zip(np.split(best.jac, cuts), np.split(best.fun, cuts), strict=True)
    scores = np.stack([j.T @ e for j, e in parts])
    n = len(scores)
    covariance = slopes @ (n / (n - 1) * bread @ (scores.T @ scores) @ bread) @ slopes.T
    k = Heat._fields.index("way")
    covariance[k, k] = 2.0 * noise**2
    rms = way * float(np.sqrt(np.mean(best.fun**2)))
    return Wire(p, covariance, n - 1.0, rms, tuple(begin(best.x)))


def guesses(ramp: Record, pulses: Record, way: float) -> list[list[float]]:
    about, made = begun(ramp, pulses, way), []
    for part in _TAUS:
        one = about if part == 1.0 else begun(ramp, pulses, way, part * about.tau)
        for share, slow in product(_SHARES, _SLOWER):
            made.append(
                [
                    one.tau, share, slow * one.tau, one.latent, one.start,
                    one.end - one.start, one.last, one.first - one.last,
                ]
            )  # fmt: skip
    return made


def begun(ramp: Record, pulses: Record, way: float, tau: float | None = None) -> Heat:
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


def _slopes(what: Callable[[Array], Array], at: Array, step: float) -> Array:
    here = what(at)
    columns = [(what(at + one) - here) / step for one in step * np.eye(len(at))]
    return np.stack(columns, axis=1)


def _turns(records: Sequence[Record]) -> Array:
    """Rows at which heating or cooling begins."""
    cuts, done = [], 0
    for one in records:
        steps = np.flatnonzero(np.abs(np.diff(one.u)) > 0.05 * np.ptp(one.u)) + 1
        kept = steps[np.diff(steps, prepend=-10) > 5]
        cuts += [done + int(k) for k in kept if k > 5]
        done += len(one.u)
        cuts.append(done)
    return np.array(cuts[:-1])


# The wire cools to a share of its travel and is warmed again. The heat follows from effort and
# measured contraction by the heat balance (`wire_model`), without a hysteresis model.

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


def warmed(p: Heat, record: Record) -> Array:
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
    thin = thinned(record, dt)
    h = warmed(p, thin)
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
