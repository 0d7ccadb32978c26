"""Heat and contraction of a wire, in volts of steady effort: what its pulses show.

    tau dh/dt = (1 - share) u - (h - s) - latent dz/dt
    slow ds/dt = share/(1 - share) (h - s) - s
    z = max(z, f(h - start)/(end - start)) while it warms, min(z, f(h - last)/(first - last)) while
    it cools, from 0 to 1;      f(q) = (e^(b q) - 1)/(e^b - 1);      x = way z

h is the temperature above the room, measured by the effort that would keep it, and s that of what
is around the wire and warms slowly (a share of the resistance lies behind it); z is the share that
has contracted. The four h are those of austenite start and end and of martensite start (first) and
end (last); between them, z goes along a straight line.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.commission.stand import Record
from macromicro.kernel import compiled, kernel

_ROWS = 4000  # of a record
_NEAR = 1e-9  # of the way: on a branch
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
def free_run(p: Heat, efforts: Array, dt: float, out: Array) -> None:
    """Contraction from cold under efforts.

    Parameters
    ----------
    p : Heat
        Parameters.
    efforts : ndarray, shape (n,)
        V.
    dt : float
        From one to the next, s.
    out : ndarray, shape (n,)
        m, written into.
    """
    h = z = around = 0.0
    behind = p.share / (1.0 - p.share)
    for k in range(len(efforts)):
        out[k] = p.way * z
        flow = h - around
        push = (1.0 - p.share) * efforts[k] - flow
        slope = 0.0
        rise, fall = p.end - p.start, p.first - p.last
        if push > 0.0 and z < 1.0 and (h - p.start) / rise >= along(z, p.warming) - _NEAR:
            slope = steepness(z, p.warming) / rise
        elif push < 0.0 and z > 0.0 and (h - p.last) / fall <= along(z, p.cooling) + _NEAR:
            slope = steepness(z, p.cooling) / fall
        around += (behind * flow - around) * dt / p.slow
        h += push * dt / (p.tau + p.latent * slope)
        if push > 0.0:
            z = max(z, branch((h - p.start) / rise, p.warming))
        else:
            z = min(z, branch((h - p.last) / fall, p.cooling))


def simulated(p: Heat, record: Record) -> Array:
    """Contraction along a record.

    Parameters
    ----------
    p : Heat
        Parameters.
    record : Record
        From cold.

    Returns
    -------
    ndarray, shape (n,)
        m.
    """
    out = np.empty_like(record.x)
    plain = Heat(*(float(v) for v in p))
    compiled(free_run)(plain, record.u, float(record.t[1] - record.t[0]), out)
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
