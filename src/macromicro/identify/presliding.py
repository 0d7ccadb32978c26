"""An axis whose friction is elastic before it slides, at a level that depends on the place.

    M dv/dt = F - (Fv + s Fa) v - (f + tau df/dt) - F0,   f = f1 + ... + fn,   dx/dt = v
    g(v, x) = Fc(x) + Fs exp(-(v/vs)^2),   s = sgn v

LuGre (Canudas de Wit, Olsson, Astrom, Lischinsky, A new model for control of systems with
friction, IEEE Transactions on Automatic Control 40 (1995) 419), in its bristle's force
f = sigma0 z, with tau = sigma1 / sigma0:

    df/dt = sigma0 (v - |v| f / g)

GMS (Al-Bender, Lampaert, Swevers, The generalized Maxwell-slip model, IEEE Transactions on
Automatic Control 50 (2005) 1883), n elements in parallel that stick or slide, a slipping one at its
level at once (the paper's C without bound):

    dfi/dt = ki v   while  |fi| < ai g,   k1 + ... + kn = sigma0,   a1 + ... + an = 1

where an element slips after ri times a common way, so that ki goes with ai / ri.
Fc(x) goes linearly between nodes at equal distances.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.identify.axis import breakaway, late
from macromicro.identify.axis_pieces import Index, laid
from macromicro.kernel import compiled, kernel

FRICTIONS = ("lugre", "gms")
REACHES = (0.25, 0.5, 1.0, 2.0)  # ri: after how far elements begin to slide, relative
STEPS = 4  # within a sample


class Presliding(NamedTuple):
    """Parameters of the equations above, in the units of force, position and second (N, m here).

    Attributes
    ----------
    mass : float
        M, N s2/m = kg.
    viscous : float
        Fv, N s/m.
    offset : float
        F0, N.
    asymmetry : float
        Fa, N s/m.
    stribeck : float
        Fs, N.
    stribeck_speed : float
        vs, m/s.
    stiffness : float
        sigma0, N/m: of all that sticks.
    settling : float
        tau = sigma1 / sigma0, s.
    shares : ndarray, shape (n,)
        ai of GMS; empty: LuGre.
    levels : ndarray, shape (k,)
        Fc at the nodes, N.
    low : float
        Place of the first node, m.
    high : float
        Place of the last node, m; one node: anywhere.
    lag : float
        Time by which the force acts late, s.
    """

    mass: float
    viscous: float
    offset: float
    asymmetry: float
    stribeck: float
    stribeck_speed: float
    stiffness: float
    settling: float
    shares: Array
    levels: Array
    low: float
    high: float
    lag: float = 0.0

    @property
    def coulomb(self) -> float:
        """Mean of Fc over the nodes, N."""
        return float(np.mean(self.levels))


@kernel
def level(p: Presliding, x: float, v: float) -> float:
    """g(v, x): what friction comes to while the axis slides.

    Parameters
    ----------
    p : Presliding
        Parameters of the axis.
    x : float
        Position, m.
    v : float
        Speed, m/s.

    Returns
    -------
    float
        N.
    """
    last = len(p.levels) - 1
    found = p.levels[0]
    if last > 0:
        at = min(max((x - p.low) / (p.high - p.low), 0.0), 1.0) * last
        k = min(int(at), last - 1)
        found = p.levels[k] + (at - k) * (p.levels[k + 1] - p.levels[k])
    return float(found + breakaway(p.stribeck, p.stribeck_speed, v))


@kernel
def stiff(p: Presliding, k: int) -> float:
    """ki of one element of GMS; all together have `stiffness`.

    Parameters
    ----------
    p : Presliding
        Parameters of the axis.
    k : int
        Which.

    Returns
    -------
    float
        N/m.
    """
    total = 0.0
    for i in range(len(p.shares)):
        total += p.shares[i] / REACHES[i]
    return float(p.stiffness * p.shares[k] / (REACHES[k] * total))


@kernel
def give(p: Presliding, f: Array, k: int, g: float, v: float, h: float) -> float:
    """Stiffness of one element over a step: 0 for one that slips, less for one that will.

    Parameters
    ----------
    p : Presliding
        Parameters of the axis.
    f : ndarray, shape (n,)
        Force of each element, N; of LuGre one.
    k : int
        Which.
    g : float
        Level of the friction, N.
    v : float
        Speed, m/s.
    h : float
        Length of the step, s.

    Returns
    -------
    float
        df/dx, N/m.
    """
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
    """Forces of the elements after a step at a held speed, in place.

    Parameters
    ----------
    p : Presliding
        Parameters of the axis.
    f : ndarray, shape (n,)
        Force of each, N; overwritten.
    g : float
        Level of the friction, N.
    v : float
        Speed, m/s.
    h : float
        Length of the step, s.

    Returns
    -------
    float
        Their sum, N.
    """
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
    """New speed and distance after a time under a held force; `f` is overwritten.

    The speed first, by the friction before it, its damping and the viscous part taken implicitly,
    then the friction by the new speed: a stuck mass swings as long as its damping lets it.

    Parameters
    ----------
    p : Presliding
        Parameters of the axis.
    f : ndarray, shape (n,)
        Force of each element, N.
    x : float
        Position, m.
    v : float
        Speed, m/s.
    pull : float
        Force less offset, N.
    h : float
        Time, s.

    Returns
    -------
    v : float
        New speed, m/s.
    moved : float
        Distance, m.
    """
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
    """Forces of the elements at the start of a run, in place: sliding, or at rest in balance.

    Parameters
    ----------
    p : Presliding
        Parameters of the axis.
    f : ndarray, shape (n,)
        Is written.
    x : float
        Position, m.
    v : float
        Speed, m/s.
    pull : float
        Force less offset, N.
    """
    g = max(level(p, x, v), 1e-12)
    total = min(max(pull, -g), g)
    if v != 0.0:
        total = g if v > 0.0 else -g
    for k in range(len(f)):
        f[k] = total if len(p.shares) == 0 else p.shares[k] * total


@kernel
def restarted(
    p: Presliding,
    force: Array,
    starts: Index,
    at: Array,
    speeds: Array,
    h: float,
    f: Array,
    out: Array,
) -> None:
    """Positions under a force, from a new state at the start of each piece, as a kernel.

    Parameters
    ----------
    p : Presliding
        Parameters of the axis.
    force : ndarray, shape (n,)
        N, held for `h` each.
    starts : ndarray, shape (k,)
        First sample of each piece.
    at, speeds : ndarray, shape (k,)
        Position and speed there, m and m/s.
    h : float
        Sample time, s.
    f : ndarray, shape (n,)
        Room for the forces of the elements.
    out : ndarray, shape (n,)
        Positions are written here, m.
    """
    piece = 0
    x = 0.0
    v = 0.0
    for k in range(len(out)):
        if piece < len(starts) and k == starts[piece]:
            x = at[piece]
            v = speeds[piece]
            begin(p, f, x, v, force[k] - p.offset)
            piece += 1
        out[k] = x
        v, gone = step(p, f, x, v, force[k] - p.offset, h)
        x += gone


@laid.register
def _laid(
    model: Presliding, force: Array, starts: Index, at: Array, speeds: Array, dt: float
) -> Array:
    pull = np.ascontiguousarray(late(force, model.lag / dt))
    out = np.empty_like(pull)
    room = np.empty(max(len(model.shares), 1))
    compiled(restarted)(model, pull, starts, at, speeds, float(dt), room, out)
    return out


def simulate(
    p: Presliding, force: npt.ArrayLike, dt: float, x: float = 0.0, v: float = 0.0
) -> Array:
    """Free run: positions under a force.

    Parameters
    ----------
    p : Presliding
        Parameters of the axis.
    force : array_like, shape (n,)
        N, held for `dt` each; it acts `lag` later.
    dt : float
        Sample time, s.
    x : float, optional
        Position at the start, m.
    v : float, optional
        Speed at the start, m/s; 0: at rest, friction in balance with the force.

    Returns
    -------
    ndarray, shape (n,)
        Positions at the start of each sample, m.
    """
    pull = np.ascontiguousarray(force, dtype=np.float64)
    return laid(p, pull, np.zeros(1, np.int64), np.array([float(x)]), np.array([float(v)]), dt)
