"""Heat and contraction of a wire, in volts of steady effort.

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
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.commission.stand import Record
from macromicro.kernel import compiled, kernel

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


def simulated(p: Heat, record: Record, begin: Begin = COLD) -> Array:
    out = np.empty_like(record.x)
    plain = Heat(*(float(v) for v in p))
    warm = Begin(*(float(v) for v in begin))
    compiled(free_run)(plain, warm, record.u, float(record.t[1] - record.t[0]), out)
    return out


def thinned(record: Record, dt: float) -> Record:
    """Means over equal blocks, few enough."""
    every = max(len(record.t) // _ROWS, 1)
    n = len(record.t) // every * every
    u, x = (c[:n].reshape(-1, every).mean(axis=1) for c in (record.u, record.x))
    t = np.arange(len(u)) * every * dt
    return Record(np.asarray(t, float), np.asarray(u, float), np.asarray(x - record.x[0], float))
