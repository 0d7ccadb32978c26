"""A mass with optional spring, behind a drive with optional dead zone: its free simulation.

    M dv/dt = D(F) - k x - (Fv + s Fa) v - s Fc - F0,  s = sgn v,  dx/dt = v
    D(F) = F - d sgn F for |F| > d, else 0

F = gain u is the drive's force, zero for a free decay; with a spring, rest is at -F0 / k. A step is
the exact linear solution (L. Meirovitch, Fundamentals of Vibrations, sections 2.2 and 2.3), split
at reversals.
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
    """Parameters of the equation above, in the units of force, position and second (N, m)."""

    mass: float  # M, kg
    viscous: float  # fv, N s/m
    coulomb: float = 0.0  # fc, N
    offset: float = 0.0  # F0, N: a constant force, or a spring's preload
    asymmetry: float = 0.0  # fa, N s/m: viscous friction is Fv + Fa forwards, Fv - Fa backwards
    spring: float = 0.0  # k, N/m
    dead_zone: float = 0.0  # d, N: what the drive needs before it gives any force

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
    """Force beyond the drive's dead zone."""
    if force > p.dead_zone:
        return force - p.dead_zone
    if force < -p.dead_zone:
        return force + p.dead_zone
    return 0.0


@kernel
def slide(p: Sprung, x: float, v: float, pull: float, h: float) -> tuple[float, float]:
    """State after a time in one direction: the exact solution.

    With A = (pull - k x) / M, a = c / 2 M, w^2 = k / M and e = exp(-a h): v(h) = e (S A + (C - a S)
    v), x(h) = x + A (1 - e (C + a S)) / w^2 + e S v, where C and S are cos wd h and sin wd h / wd,
    or cosh and sinh where it is overdamped.
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
    """New position and speed after a time under a held force."""
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
    """Positions and speeds from a state under a force, as a kernel."""
    for k in range(len(force)):
        out[0, k] = x
        out[1, k] = v
        x, v = step(p, x, v, force[k], h)


def simulate(
    p: Sprung, force: npt.ArrayLike, dt: float, x: float = 0.0, v: float = 0.0, lag: float = 0.0
) -> tuple[Array, Array]:
    """Free simulation: positions and speeds under a force."""
    push = late(np.ascontiguousarray(force, dtype=np.float64), lag / dt)
    out = np.empty((2, len(push)))
    plain = Sprung(*(float(value) for value in p))
    compiled(free_run)(plain, push, float(x), float(v), float(dt), out)
    return out[0], out[1]
