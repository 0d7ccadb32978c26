"""Heat and contraction of a wire, in volts of steady effort: what its pulses show.

    tau dh/dt = (1 - share) u - (h - s) - latent dz/dt
    slow ds/dt = share/(1 - share) (h - s) - s
    z = max(z, f(h - start)/(end - start)) while it warms, min(z, f(h - last)/(first - last)) while
    it cools, from 0 to 1;      f(q) = (e^(b q) - 1)/(e^b - 1);      x = way z

h is the temperature above the room, measured by the effort that would keep it, and s that of what
is around the wire and warms slowly (a share of the resistance lies behind it); z is the share that
has contracted. The four h are those of austenite start and end and of martensite start (first) and
end (last).
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
    """Parameters of the wire.

    Attributes
    ----------
    tau : float
        Time constant of the wire, s.
    share : float
        Of the resistance to the room behind what warms slowly.
    slow : float
        Time constant of that, s.
    latent : float
        Of the whole contraction, V s.
    start, end : float
        Heat at which contraction begins and ends, V.
    first, last : float
        Heat at which extension begins and ends, V.
    way : float
        Full contraction, m.
    warming, cooling : float
        How the branches bend; 0 is straight.
    """

    tau: float
    share: float
    slow: float
    latent: float
    start: float
    end: float
    first: float
    last: float
    way: float
    warming: float = 0.0
    cooling: float = 0.0


class Begin(NamedTuple):
    """What a record begins with: a wire that rests extended is not always cold.

    Attributes
    ----------
    heat : float
        Of the wire, V.
    around : float
        Of what is around it, V.
    """

    heat: float
    around: float


COLD = Begin(0.0, 0.0)


@kernel
def branch(q: float, bend: float) -> float:
    """Contraction along a branch.

    Parameters
    ----------
    q : float
        How far the heat is between the branch's ends, from 0 to 1.
    bend : float
        How it bends.

    Returns
    -------
    float
        From 0 to 1.
    """
    inside = min(max(q, 0.0), 1.0)
    if abs(bend) < _STRAIGHT:
        return inside
    return math.expm1(bend * inside) / math.expm1(bend)


def steepest(p: Heat) -> float:
    """Contraction per heat where it is most, on either branch.

    Parameters
    ----------
    p : Heat
        Of the wire.

    Returns
    -------
    float
        Of the whole contraction, 1/V.
    """
    ways = ((p.end - p.start, p.warming), (p.first - p.last, p.cooling))
    return max(_steep(bend) / way for way, bend in ways)


def _steep(bend: float) -> float:
    """The greatest slope of `branch`, at one of its ends."""
    b = abs(bend)
    return 1.0 if b < _STRAIGHT else b / -math.expm1(-b)


@kernel
def along(z: float, bend: float) -> float:
    """The inverse of `branch`.

    Parameters
    ----------
    z : float
        Contraction, from 0 to 1.
    bend : float
        How it bends.

    Returns
    -------
    float
        From 0 to 1.
    """
    if abs(bend) < _STRAIGHT:
        return z
    return math.log1p(z * math.expm1(bend)) / bend


@kernel
def steepness(z: float, bend: float) -> float:
    """Slope of `branch` where it has come to a contraction.

    Parameters
    ----------
    z : float
        Contraction, from 0 to 1.
    bend : float
        How it bends.

    Returns
    -------
    float
        Per share of the heat between its ends.
    """
    if abs(bend) < _STRAIGHT:
        return 1.0
    return bend * (1.0 / math.expm1(bend) + z)


@kernel
def settled(p: Heat, content: float, z: float, warming: bool) -> tuple[float, float]:
    """Heat and contraction that go with a heat content, which rose or fell to it.

    Parameters
    ----------
    p : Heat
        Parameters.
    content : float
        tau h + latent z, V s.
    z : float
        Contraction before, from 0 to 1.
    warming : bool
        Whether it rose.

    Returns
    -------
    h : float
        V.
    z : float
        From 0 to 1.
    """
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
    """Contraction under efforts of a wire that was extended.

    The heat's content goes on by Heun's rule. Heat and contraction follow from it, so a branch
    begins and ends between two samples where it does, and results change smoothly with parameters.

    Parameters
    ----------
    p : Heat
        Parameters.
    begin : Begin
        Heat at the first row.
    efforts : ndarray, shape (n,)
        V.
    dt : float
        From one to the next, s.
    out : ndarray, shape (n,)
        m, means over the periods, written into.
    """
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
    """Contraction along a record.

    Parameters
    ----------
    p : Heat
        Parameters.
    record : Record
        It begins extended.
    begin : Begin, optional
        Heat that it begins with.

    Returns
    -------
    ndarray, shape (n,)
        m.
    """
    out = np.empty_like(record.x)
    plain = Heat(*(float(v) for v in p))
    warm = Begin(*(float(v) for v in begin))
    compiled(free_run)(plain, warm, record.u, float(record.t[1] - record.t[0]), out)
    return out


def thinned(record: Record, dt: float) -> Record:
    """Means over equal blocks, few enough.

    Parameters
    ----------
    record : Record
        Of a drive.
    dt : float
        Control period, s.

    Returns
    -------
    Record
        Of `_ROWS` rows about.
    """
    every = max(len(record.t) // _ROWS, 1)
    n = len(record.t) // every * every
    u, x = (c[:n].reshape(-1, every).mean(axis=1) for c in (record.u, record.x))
    t = np.arange(len(u)) * every * dt
    return Record(np.asarray(t, float), np.asarray(u, float), np.asarray(x - record.x[0], float))
