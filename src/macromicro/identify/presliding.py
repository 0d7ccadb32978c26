"""An axis whose friction is elastic before it slides, at a level that depends on the position.

    M dv/dt = F - (Fv + s Fa) v - (f + tau df/dt) - F0,   f = f1 + ... + fn,   dx/dt = v
    g(v, x) = Fc(x) + Fs exp(-(v/vs)^2),   s = sgn v

LuGre (Canudas de Wit et al., IEEE Trans. Automatic Control 40 (1995) 419), f = sigma0 z and tau =
sigma1 / sigma0:

    df/dt = sigma0 (v - |v| f / g)

GMS (Al-Bender et al., IEEE Trans. Automatic Control 50 (2005) 1883), n elements in parallel that
stick or slide, a slipping one at its level at once (the paper's C without bound):

    dfi/dt = ki v   while  |fi| < ai g,   k1 + ... + kn = sigma0,   a1 + ... + an = 1

An element slips after ri times a common displacement, so ki is proportional to ai / ri. Fc(x) is
linear between equidistant nodes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.identify.engine import Index, Pieces
from macromicro.kernel import compiled, kernel
from macromicro.models.mass import breakaway, late

FRICTIONS = ("lugre", "gms")
REACHES = (0.25, 0.5, 1.0, 2.0)  # ri: after how far elements begin to slide, relative
STEPS = 4  # within a sample


class Presliding(NamedTuple):
    """Parameters of the equations above, in the units of force, position and second (N, m here)."""

    mass: float  # M, N s2/m = kg
    viscous: float  # fv, N s/m
    offset: float  # F0, N
    asymmetry: float  # fa, N s/m
    stribeck: float  # fs, N
    stribeck_speed: float  # vs, m/s
    stiffness: float  # sigma0, N/m: of all that sticks
    settling: float  # tau = sigma1 / sigma0, s
    shares: Array  # ai of GMS; empty: LuGre
    levels: Array  # fc at the nodes, N
    low: float  # place of the first node, m
    high: float  # place of the last node, m; one node: anywhere
    lag: float = 0.0  # time by which the force acts late, s
    creep: float = 0.0  # speed below which a run begins at rest, in balance, m/s

    @property
    def coulomb(self) -> float:
        return float(np.mean(self.levels))


@kernel
def level(p: Presliding, x: float, v: float) -> float:
    """g(v, x): friction while the axis slides."""
    last = len(p.levels) - 1
    found = p.levels[0]
    if last > 0:
        at = min(max((x - p.low) / (p.high - p.low), 0.0), 1.0) * last
        k = min(int(at), last - 1)
        found = p.levels[k] + (at - k) * (p.levels[k + 1] - p.levels[k])
    return float(found + breakaway(p.stribeck, p.stribeck_speed, v))


@kernel
def stiff(p: Presliding, k: int) -> float:
    """ki of one element of GMS; their sum is `stiffness`."""
    total = 0.0
    for i in range(len(p.shares)):
        total += p.shares[i] / REACHES[i]
    return float(p.stiffness * p.shares[k] / (REACHES[k] * total))


@kernel
def give(p: Presliding, f: Array, k: int, g: float, v: float, h: float) -> float:
    """Mean stiffness of an element over a step: 0 while it slips, less if it is about to."""
    side = 1.0 if v >= 0.0 else -1.0
    if len(p.shares) == 0:
        return float(p.stiffness * (1.0 - min(side * f[0] / g, 1.0)))
    # Where the level rises along the way, a slipping element has a little room at every step.
    room = p.shares[k] * g - side * f[k]
    if room <= 0.0:
        return 0.0
    return float(min(stiff(p, k), room / (h * abs(v)))) if v != 0.0 else stiff(p, k)


@kernel
def slid(p: Presliding, f: Array, g: float, v: float, h: float) -> float:
    """Forces of the elements after a step at constant speed, in place."""
    if len(p.shares) == 0:
        # The rate of slip is taken implicitly: f relaxes to the level for any step.
        f[0] = (f[0] + p.stiffness * h * v) / (1.0 + p.stiffness * h * abs(v) / g)
        return float(f[0])
    total = 0.0
    for k in range(len(f)):
        most = p.shares[k] * g
        f[k] = min(max(f[k] + stiff(p, k) * h * v, -most), most)
        total += f[k]
    return total


@kernel
def step(p: Presliding, f: Array, x: float, v: float, pull: float, h: float) -> tuple[float, float]:
    """New speed and distance after a time under a held force; `f` is overwritten."""
    # First the speed, with damping and viscous friction implicit, then the friction at the new
    # speed: a stuck mass oscillates as long as its damping lets it.
    part = h / STEPS
    moved = 0.0
    for _ in range(STEPS):
        g = max(level(p, x + moved, v), 1e-12)
        held, soft = 0.0, 0.0
        for k in range(len(f)):
            held += f[k]
            soft += give(p, f, k, g, v, part)
        drag = p.viscous + (p.asymmetry if v > 0.0 else -p.asymmetry) + p.settling * soft
        new = (v + part / p.mass * (pull - held)) / (1.0 + part / p.mass * drag)
        slid(p, f, g, new, part)
        moved += 0.5 * part * (v + new)
        v = new
    return v, moved


@kernel
def begin(p: Presliding, f: Array, x: float, v: float, pull: float) -> None:
    """Initial forces of the elements, in place: sliding, or at rest in balance."""
    g = max(level(p, x, v), 1e-12)
    total = min(max(pull, -g), g)
    if abs(v) > p.creep:
        total = g if v > 0.0 else -g
    for k in range(len(f)):
        f[k] = total if len(p.shares) == 0 else p.shares[k] * total


@kernel
def restarted(
    p: Presliding,
    force: Array,
    first: Index,
    count: Index,
    dt: Array,
    x0: Array,
    v0: Array,
    f: Array,
    out: Array,
) -> None:
    """Positions of pieces one behind the other, each from its own state, as a kernel."""
    row = 0
    for piece in range(len(first)):
        x = x0[piece]
        v = v0[piece]
        begin(p, f, x, v, force[first[piece]] - p.offset)
        for k in range(count[piece]):
            out[row] = x
            pull = force[first[piece] + k] - p.offset
            v, gone = step(p, f, x, v, pull, dt[piece])
            x += gone
            row += 1


def simulate_pieces(p: Presliding, pieces: Pieces) -> Array:
    """Positions over pieces of records."""
    out = np.empty(len(pieces.y))
    room = np.empty(max(len(p.shares), 1))
    force = np.ascontiguousarray(pieces.force)
    compiled(restarted)(p, force, *pieces[1:6], room, out)
    return out


def simulate(
    p: Presliding, force: npt.ArrayLike, dt: float, x: float = 0.0, v: float = 0.0
) -> Array:
    pull = late(np.ascontiguousarray(force, dtype=np.float64), p.lag / dt)
    first, count = np.zeros(1, np.int64), np.array([len(pull)])
    step, place, speed = np.array([[dt], [x], [v]], np.float64)
    return simulate_pieces(p, Pieces(pull, first, count, step, place, speed, pull))
