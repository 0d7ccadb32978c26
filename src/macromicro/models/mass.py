"""A mass under a force: friction, spring, dead zone, gravity and limits, simulated exactly.

    M dv/dt = D(F) - k x - (Fv + s Fa) v - s (Fc + Fs exp(-(v/vs)^2)) - F0 - A sin x - B cos x,
    s = sgn v,  dx/dt = v,  D(F) = F - d sgn F for |F| > d, else 0

F is the drive's force, zero for a free motion. For a rotary axis read inertia, torque and angle; A
and B are gravity on its eccentric load, which hangs at -atan2(B, A). With a spring, rest is at
-F0 / k. Asymmetry is in the viscous part only: while the axis slides, F0 and a Coulomb level that
depends on the direction cannot be told apart. Between reversals the equation is linear, and a step
is its solution (L. Meirovitch, Fundamentals of Vibrations, sections 2.2 and 2.3).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.kernel import compiled, kernel

Index = npt.NDArray[np.int64]
_SERIES = 1e-4  # of a time constant: below it a step is a series
_HALVINGS = 60  # of a step, until the moment of zero speed is found
_REVERSALS = 8  # within one step


class Axis(NamedTuple):
    """Parameters of the equation above, in the units of force, position and second (N, m).

    Examples
    --------
    >>> from macromicro.identify import Axis
    >>> Axis(mass=1.2, viscous=14.0, coulomb=3.0)._replace(offset=0.5).offset  # N
    0.5
    """

    mass: float  #: M, N s2/m = kg
    viscous: float  #: fv, N s/m
    coulomb: float = 0.0  #: fc, N
    offset: float = 0.0  #: F0, N: a constant force, or a spring's preload
    asymmetry: float = 0.0  #: fa, N s/m: viscous friction is Fv + Fa forwards, Fv - Fa backwards
    stribeck: float = 0.0  #: fs, N
    stribeck_speed: float = 1.0  #: vs, m/s
    lag: float = 0.0  #: time by which the force acts late, s
    #: greatest force that the drive's current gives, N. At a speed the drive can be asked for as
    #: much more as back-EMF takes there, `back` Fv v, before it comes to that
    limit: float = math.inf
    #: part of Fv that is back-EMF, from 0 to 1; no other than a limited force shows it
    back: float = 1.0
    sine: float = 0.0  #: A and B, N m
    cosine: float = 0.0  #: 0 of an axis that slides, or whose load is balanced
    spring: float = 0.0  #: k, N/m
    dead_zone: float = 0.0  #: d, N: what the drive needs before it gives any force

    @property
    def frequency(self) -> float:
        """Undamped frequency of mass and spring, sqrt(k / M) / 2 pi, Hz."""
        return math.sqrt(max(self.spring / self.mass, 0.0)) / (2.0 * math.pi)

    @property
    def damping(self) -> float:
        """Damping ratio, Fv / (2 sqrt(k M)); NaN without a spring."""
        if not self.spring > 0.0:
            return math.nan
        return self.viscous / (2.0 * math.sqrt(self.spring * self.mass))


@kernel
def decay(p: Axis, direction: float, h: float) -> tuple[float, float, float]:
    """Coefficients of a slide in one direction under a held force, without a spring."""
    # The new speed is keep * speed + push * force, the distance mass * push * speed + carry *
    # force; with c the viscous friction, 1 - e^(-c h/M) = c push and c carry = h - M push.
    c = p.viscous + direction * p.asymmetry
    z = c * h / p.mass
    if z > _SERIES:
        fall = -math.expm1(-z)
        return 1.0 - fall, fall / c, h / c * (1.0 - fall / z)
    # Where friction hardly slows the axis the terms above cancel; the next one is z^3/24.
    rise = 1.0 - 0.5 * z + z * z / 6.0
    slow = 0.5 - z / 6.0 + z * z / 24.0
    return 1.0 - z * rise, h / p.mass * rise, h * h / p.mass * slow


@kernel
def stopping(p: Axis, v: float, net: float) -> float:
    """Time in which a held force brings an axis without a spring to rest."""
    c = p.viscous + (p.asymmetry if v > 0.0 else -p.asymmetry)
    z = -c * v / net
    return -p.mass * v / net * (math.log1p(z) / z if z > 1e-12 else 1.0)


@kernel
def breakaway(most: float, fades: float, v: float) -> float:
    """Stribeck friction in excess of Coulomb friction, Fs exp(-(v/vs)^2)."""
    if most == 0.0:
        return 0.0
    ratio = v / fades
    return most * math.exp(-ratio * ratio)


@kernel
def level(p: Axis, v: float) -> float:
    """Coulomb and Stribeck friction at a speed."""
    return p.coulomb + breakaway(p.stribeck, p.stribeck_speed, v)


@kernel
def glide(p: Axis, v: float, pull: float, h: float) -> tuple[float, float]:
    """New speed and distance of an axis without a spring after a time under a held force."""
    # Exact while the axis slides in one direction (Stribeck's level at the mean of the first and
    # the last speed). A reversal is split at zero speed, so the result is continuous in the
    # parameters.
    moved = 0.0
    if v != 0.0:
        side = 1.0 if v > 0.0 else -1.0
        keep, push, carry = decay(p, side, h)
        net = pull - side * level(p, v)
        new = keep * v + push * net
        if p.stribeck != 0.0:
            net = pull - side * level(p, 0.5 * (v + side * max(side * new, 0.0)))
            new = keep * v + push * net
        if new * side > 0.0:
            return new, p.mass * push * v + carry * net
        slide = h
        if net * side < 0.0:  # not so where friction alone has used the speed up
            slide = min(stopping(p, v, net), h)
        keep, push, carry = decay(p, side, slide)
        moved = p.mass * push * v + carry * net
        h -= slide
    hold = p.coulomb + p.stribeck
    if abs(pull) <= hold or h <= 0.0:
        return 0.0, moved
    side = 1.0 if pull > 0.0 else -1.0
    keep, push, carry = decay(p, side, h)
    net = pull - side * hold
    if p.stribeck != 0.0:
        net = pull - side * level(p, 0.5 * push * net)
    return push * net, moved + carry * net


@kernel
def slide(p: Axis, x: float, v: float, side: float, pull: float, h: float) -> tuple[float, float]:
    """State of an axis on a spring after a time in one direction: the exact solution."""
    # With A = (pull - k x) / M, a = c / 2 M, w^2 = k / M and e = exp(-a h): v(h) = e (S A + (C - a
    # S) v), x(h) = x + A (1 - e (C + a S)) / w^2 + e S v, where C and S are cos wd h and sin wd h /
    # wd, or cosh and sinh where it is overdamped.
    a = 0.5 * (p.viscous + side * p.asymmetry) / p.mass
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
    elif a * h > 1e-4:  # hardly a spring: its limit
        gone = (2.0 * a * h + math.expm1(-2.0 * a * h)) / (4.0 * a * a)
    else:
        gone = 0.5 * h * h
    return x + push * gone + odd * v, odd * push + (even - a * odd) * v


@kernel
def swing(p: Axis, x: float, v: float, pull: float, h: float) -> tuple[float, float]:
    """New position and speed of an axis on a spring after a time under a held force."""
    for _ in range(_REVERSALS):
        if v > 0.0:
            side = 1.0
        elif v < 0.0:
            side = -1.0
        else:
            left = pull - p.spring * x
            if abs(left) <= p.coulomb + p.stribeck:
                return x, 0.0
            side = 1.0 if left > 0.0 else -1.0
        drive = pull - side * level(p, v)
        new, speed = slide(p, x, v, side, drive, h)
        if p.stribeck != 0.0:
            drive = pull - side * level(p, 0.5 * (v + side * max(side * speed, 0.0)))
            new, speed = slide(p, x, v, side, drive, h)
        if speed * side >= 0.0:
            return new, speed
        # The direction ends within the step.
        low, high = 0.0, h
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            if slide(p, x, v, side, drive, middle)[1] * side > 0.0:
                low = middle
            else:
                high = middle
        if low == 0.0 and v == 0.0:  # it turns at once: friction holds it
            return x, 0.0
        x = slide(p, x, v, side, drive, high)[0]
        v = 0.0
        h -= high
        if h <= 0.0:
            return x, 0.0
    return x, v


@kernel
def given(p: Axis, force: float, v: float) -> float:
    """Force of the drive within its limits of current and back-EMF, beyond its dead zone."""
    emf = p.back * p.viscous * v
    force = min(max(force, emf - p.limit), emf + p.limit)
    if force > p.dead_zone:
        return force - p.dead_zone
    if force < -p.dead_zone:
        return force + p.dead_zone
    return 0.0


@kernel
def acting(p: Axis, force: float, x: float, v: float, h: float) -> float:
    """Drive force less the load's, before friction, spring and acceleration."""
    pull = given(p, force, v) - p.offset
    if p.sine == 0.0 and p.cosine == 0.0:
        return pull
    x += 0.5 * h * v
    return pull - p.sine * math.sin(x) - p.cosine * math.cos(x)


@kernel
def step(p: Axis, x: float, v: float, force: float, h: float) -> tuple[float, float]:
    """New position and speed after a time under a held force of the drive."""
    pull = acting(p, force, x, v, h)
    if p.spring != 0.0:
        return swing(p, x, v, pull, h)
    v, gone = glide(p, v, pull, h)
    return x + gone, v


@kernel
def free_run(p: Axis, force: Array, x: float, v: float, h: float, out: Array) -> None:
    """Positions and speeds from a state under a force, as a kernel."""
    for k in range(len(force)):
        out[0, k] = x
        out[1, k] = v
        x, v = step(p, x, v, force[k], h)


@kernel
def restarted(
    p: Axis, force: Array, first: Index, count: Index, dt: Array, x0: Array, v0: Array, out: Array
) -> None:
    """Positions and speeds of pieces one behind the other, each from its own state, as a kernel."""
    row = 0
    for piece in range(len(first)):
        x = x0[piece]
        v = v0[piece]
        for k in range(count[piece]):
            out[0, row] = x
            out[1, row] = v
            x, v = step(p, x, v, force[first[piece] + k], dt[piece])
            row += 1


def late(force: Array, samples: float) -> Array:
    """A held input delayed by a time, which may be a fraction of a sample."""
    if samples == 0.0:
        return force
    samples = min(samples, float(len(force)))  # later, nothing of it is seen
    whole = math.floor(samples)
    part = samples - whole
    first = np.full(whole + 1, force[0])
    shifted = np.concatenate([first, force])[: len(force) + 1]
    return (1.0 - part) * shifted[1:] + part * shifted[:-1]


def motion(p: Axis, force: npt.ArrayLike, dt: float, x: float = 0.0, v: float = 0.0) -> Array:
    """Positions and speeds of a free run, shape (2, n)."""
    pull = late(np.ascontiguousarray(force, dtype=np.float64), p.lag / dt)
    out = np.empty((2, len(pull)))
    plain = Axis(*(float(value) for value in p))
    compiled(free_run)(plain, pull, float(x), float(v), float(dt), out)
    return out


def simulate(p: Axis, force: npt.ArrayLike, dt: float, x: float = 0.0, v: float = 0.0) -> Array:
    """Free run: positions under a force.

    Parameters
    ----------
    p : Axis
        Parameters of the axis.
    force : array_like, shape (n,)
        N, held for `dt` each; it acts `lag` later.
    dt : float
        Sample time, s.
    x : float, optional
        Position at the start, m.
    v : float, optional
        Speed at the start, m/s.

    Returns
    -------
    ndarray, shape (n,)
        Positions at the start of each sample, m.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.identify import Axis, simulate
    >>> axis = Axis(mass=2.0, viscous=0.0, coulomb=1.0)  # kg, N s/m, N
    >>> simulate(axis, np.full(5, 5.0), dt=0.5)  # m, under 5 N
    array([0.  , 0.25, 1.  , 2.25, 4.  ])
    """
    return np.asarray(motion(p, force, dt, x, v)[0])
