"""An axis whose friction is elastic before it slides, at a level that depends on the position.

    M dv/dt = F - (Fv + s Fa) v - (f + tau df/dt) - F0,   dx/dt = v
    g(v, x) = Fc(x) + Fs exp(-(v/vs)^2),   s = sgn v

LuGre (Canudas de Wit et al., IEEE Trans. Automatic Control 40 (1995) 419), f = sigma0 z and tau =
sigma1 / sigma0:

    df/dt = sigma0 (v - |v| f / g)

Fc(x) is linear between equidistant nodes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.identify.engine import Index, Pieces
from macromicro.kernel import compiled, kernel
from macromicro.models.mass import breakaway

LUGRE = "lugre"
STEPS = 4  # within a sample


class Presliding(NamedTuple):
    """Parameters of the equations above, in the units of force, position and second (N, m here)."""

    mass: float  # M, N s2/m = kg
    viscous: float  # fv, N s/m
    offset: float  # F0, N
    asymmetry: float  # fa, N s/m
    stribeck: float  # fs, N
    stribeck_speed: float  # vs, m/s
    stiffness: float  # sigma0, N/m
    settling: float  # tau = sigma1 / sigma0, s
    levels: Array  # fc at the nodes, N
    low: float  # place of the first node, m
    high: float  # place of the last node, m; one node: anywhere
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
def give(p: Presliding, f: float, g: float, v: float) -> float:
    """Stiffness by which friction rises with the distance: less, the nearer it is to its level."""
    side = 1.0 if v >= 0.0 else -1.0
    return float(p.stiffness * (1.0 - min(side * f / g, 1.0)))


@kernel
def slid(p: Presliding, f: float, g: float, v: float, h: float) -> float:
    """Friction after a step at constant speed."""
    # The rate of slip is taken implicitly: f relaxes to the level for any step.
    return float((f + p.stiffness * h * v) / (1.0 + p.stiffness * h * abs(v) / g))


@kernel
def step(
    p: Presliding, f: float, x: float, v: float, pull: float, h: float
) -> tuple[float, float, float]:
    """New speed, distance and friction after a time under a held force."""
    # First the speed, with damping and viscous friction implicit, then the friction at the new
    # speed: a stuck mass oscillates as long as its damping lets it.
    part = h / STEPS
    moved = 0.0
    for _ in range(STEPS):
        g = max(level(p, x + moved, v), 1e-12)
        drag = p.viscous + (p.asymmetry if v > 0.0 else -p.asymmetry)
        drag += p.settling * give(p, f, g, v)
        new = (v + part / p.mass * (pull - f)) / (1.0 + part / p.mass * drag)
        f = slid(p, f, g, new, part)
        moved += 0.5 * part * (v + new)
        v = new
    return v, moved, f


@kernel
def begin(p: Presliding, x: float, v: float, pull: float) -> float:
    """Initial friction: sliding, or at rest in balance."""
    g = max(level(p, x, v), 1e-12)
    if abs(v) > p.creep:
        return float(g if v > 0.0 else -g)
    return float(min(max(pull, -g), g))


@kernel
def restarted(
    p: Presliding,
    force: Array,
    first: Index,
    count: Index,
    dt: Array,
    x0: Array,
    v0: Array,
    out: Array,
) -> None:
    """Positions of pieces one behind the other, each from its own state, as a kernel."""
    row = 0
    for piece in range(len(first)):
        x = x0[piece]
        v = v0[piece]
        f = begin(p, x, v, force[first[piece]] - p.offset)
        for k in range(count[piece]):
            out[row] = x
            pull = force[first[piece] + k] - p.offset
            v, gone, f = step(p, f, x, v, pull, dt[piece])
            x += gone
            row += 1


def simulate_pieces(p: Presliding, pieces: Pieces) -> Array:
    """Positions over pieces of records."""
    out = np.empty(len(pieces.y))
    compiled(restarted)(p, np.ascontiguousarray(pieces.force), *pieces[1:6], out)
    return out


def simulate(
    p: Presliding, force: npt.ArrayLike, dt: float, x: float = 0.0, v: float = 0.0
) -> Array:
    pull = np.asarray(force, dtype=np.float64)
    first, count = np.zeros(1, np.int64), np.array([len(pull)])
    step, place, speed = np.array([[dt], [x], [v]], np.float64)
    return simulate_pieces(p, Pieces(pull, first, count, step, place, speed, pull))
