"""A mass on a spring, or none, behind a drive with a dead zone, or none: its free run.

    M dv/dt = D(F) - k x - (Fv + s Fa) v - s Fc - F0,  s = sgn v,  dx/dt = v
    D(F) = F - d sgn F for |F| > d, else 0

F = gain u is the drive's force, zero for a free decay. F0 holds preload: with a spring its rest is
at -F0 / k. At rest friction balances any force up to Fc. Between reversals the equation is linear,
so a step is its exact solution (L. Meirovitch, Fundamentals of Vibrations, sections 2.2 and 2.3),
and a reversal is split at the moment of zero speed.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.identify.axis import late
from macromicro.kernel import compiled, kernel

_HALVINGS = 60  # of a step, until the moment of zero speed is found
_PIECES = 8  # reversals within one step


class Sprung(NamedTuple):
    """Parameters of the equation above, in the units of force, position and second (N and m here).

    Attributes
    ----------
    mass : float
        M, kg.
    viscous : float
        Fv, N s/m.
    coulomb : float
        Fc, N.
    offset : float
        F0, N: a constant force, or a spring's preload.
    asymmetry : float
        Fa, N s/m: viscous friction is Fv + Fa forwards, Fv - Fa backwards.
    spring : float
        k, N/m.
    dead_zone : float
        d, N: what the drive needs before it gives any force.
    """

    mass: float
    viscous: float
    coulomb: float = 0.0
    offset: float = 0.0
    asymmetry: float = 0.0
    spring: float = 0.0
    dead_zone: float = 0.0

    @property
    def frequency(self) -> float:
        """Undamped, sqrt(k / M) / 2 pi, Hz."""
        return math.sqrt(max(self.spring / self.mass, 0.0)) / (2.0 * math.pi)

    @property
    def damping(self) -> float:
        """Damping ratio, Fv / (2 sqrt(k M)); NaN without a spring."""
        if not self.spring > 0.0:
            return math.nan
        return self.viscous / (2.0 * math.sqrt(self.spring * self.mass))


@kernel
def passed(p: Sprung, force: float) -> float:
    """What the drive's dead zone leaves of a force.

    Parameters
    ----------
    p : Sprung
        Parameters.
    force : float
        N.

    Returns
    -------
    float
        D(F), N.
    """
    if force > p.dead_zone:
        return force - p.dead_zone
    if force < -p.dead_zone:
        return force + p.dead_zone
    return 0.0


@kernel
def slide(p: Sprung, x: float, v: float, pull: float, h: float) -> tuple[float, float]:
    """State after a time in which the direction stays: the linear equation's exact solution.

    With A = (pull - k x) / M, a = c / 2 M, w^2 = k / M and e = exp(-a h):
    v(h) = e (S A + (C - a S) v), x(h) = x + A (1 - e (C + a S)) / w^2 + e S v, where C and S are
    cos wd h and sin wd h / wd, or cosh and sinh where it is overdamped.

    Parameters
    ----------
    p : Sprung
        Parameters; `viscous` is that of this direction.
    x : float
        Position, m.
    v : float
        Speed, m/s.
    pull : float
        Force less friction and offset, N.
    h : float
        Time, s.

    Returns
    -------
    x : float
        m.
    v : float
        m/s.
    """
    a = 0.5 * p.viscous / p.mass
    w2 = p.spring / p.mass
    push = (pull - p.spring * x) / p.mass
    rest = a * a - w2
    if rest < 0.0:
        turn = math.sqrt(-rest)
        fall = math.exp(-a * h)
        even, odd = fall * math.cos(turn * h), fall * math.sin(turn * h) / turn
    else:
        turn = math.sqrt(rest)
        slow, fast = math.exp((turn - a) * h), math.exp(-(turn + a) * h)
        even = 0.5 * (slow + fast)
        odd = 0.5 * (slow - fast) / turn if turn * h > 1e-6 else h * math.exp(-a * h)
    if w2 * h * h > 1e-8:
        gone = (1.0 - even - a * odd) / w2
    elif a * h > 1e-4:  # no spring: its limit
        gone = (2.0 * a * h + math.expm1(-2.0 * a * h)) / (4.0 * a * a)
    else:
        gone = 0.5 * h * h
    return x + push * gone + odd * v, odd * push + (even - a * odd) * v


@kernel
def step(p: Sprung, x: float, v: float, force: float, h: float) -> tuple[float, float]:
    """New position and speed after a time under a held force.

    Parameters
    ----------
    p : Sprung
        Parameters.
    x : float
        Position, m.
    v : float
        Speed, m/s.
    force : float
        Of the drive, N.
    h : float
        Time, s.

    Returns
    -------
    x : float
        m.
    v : float
        m/s.
    """
    pull = passed(p, force) - p.offset
    for _ in range(_PIECES):
        if v > 0.0:
            side = 1.0
        elif v < 0.0:
            side = -1.0
        else:
            left = pull - p.spring * x
            if abs(left) <= p.coulomb:
                return x, 0.0
            side = 1.0 if left > 0.0 else -1.0
        own = Sprung(p.mass, p.viscous + side * p.asymmetry, 0.0, 0.0, 0.0, p.spring, p.dead_zone)
        drive = pull - side * p.coulomb
        new, speed = slide(own, x, v, drive, h)
        if speed * side >= 0.0:
            return new, speed
        # The direction ends within the step.
        low, high = 0.0, h
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            if slide(own, x, v, drive, middle)[1] * side > 0.0:
                low = middle
            else:
                high = middle
        if low == 0.0 and v == 0.0:  # it turns at once: friction holds it
            return x, 0.0
        x = slide(own, x, v, drive, high)[0]
        v = 0.0
        h -= high
        if h <= 0.0:
            return x, 0.0
    return x, v


@kernel
def free_run(p: Sprung, force: Array, x: float, v: float, h: float, out: Array) -> None:
    """Positions and speeds from a state under a force, as a kernel.

    Parameters
    ----------
    p : Sprung
        Parameters.
    force : ndarray, shape (n,)
        N, held for `h` each.
    x : float
        Position at the start, m.
    v : float
        Speed at the start, m/s.
    h : float
        Sample time, s.
    out : ndarray, shape (2, n)
        Positions, m, and speeds, m/s, are written here.
    """
    for k in range(len(force)):
        out[0, k] = x
        out[1, k] = v
        x, v = step(p, x, v, force[k], h)


def simulate(
    p: Sprung, force: npt.ArrayLike, dt: float, x: float = 0.0, v: float = 0.0, lag: float = 0.0
) -> tuple[Array, Array]:
    """Free run: positions and speeds under a force.

    Parameters
    ----------
    p : Sprung
        Parameters.
    force : array_like, shape (n,)
        N, held for `dt` each; zeros for a free decay.
    dt : float
        Sample time, s.
    x : float, optional
        Position at the start, m.
    v : float, optional
        Speed at the start, m/s.
    lag : float, optional
        Time by which the force acts late, s.

    Returns
    -------
    x : ndarray, shape (n,)
        Positions at the start of each sample, m.
    v : ndarray, shape (n,)
        Speeds there, m/s.
    """
    push = late(np.ascontiguousarray(force, dtype=np.float64), lag / dt)
    out = np.empty((2, len(push)))
    plain = Sprung(*(float(value) for value in p))
    compiled(free_run)(plain, push, float(x), float(v), float(dt), out)
    return out[0], out[1]
