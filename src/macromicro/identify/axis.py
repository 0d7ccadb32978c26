"""A motor-driven axis: mass, viscous and Coulomb friction, free run of the equation of motion.

    M dv/dt = F - (Fv + s Fa) v - s (Fc + Fs exp(-(v/vs)^2)) - F0,  s = sgn v,  dx/dt = v

F = gain u is the drive's force. At rest friction balances any force up to Fc + Fs. For a
rotary axis read inertia, torque and angle. F0 and a Coulomb level that depends on the
direction are one and the same while the axis slides (both are a constant force per
direction), so asymmetry is in the viscous part only.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.kernel import compiled, kernel

Array = npt.NDArray[np.float64]


class Axis(NamedTuple):
    """Parameters of the equation above, in the units of force, position and second.

    mass M [N s2/m = kg], viscous Fv [N s/m], coulomb Fc [N], offset F0 [N], asymmetry Fa
    [N s/m] (viscous friction is Fv + Fa forwards, Fv - Fa backwards), stribeck Fs [N],
    stribeck_speed vs [m/s].
    """

    mass: float
    viscous: float
    coulomb: float = 0.0
    offset: float = 0.0
    asymmetry: float = 0.0
    stribeck: float = 0.0
    stribeck_speed: float = 1.0


@kernel
def decay(p: Axis, direction: float, h: float) -> tuple[float, float]:
    """Speed after `h` [s] = first * speed + second * force, in one direction, force held."""
    c = p.viscous + direction * p.asymmetry
    if c * h > 1e-12 * p.mass:
        fall = -math.expm1(-c * h / p.mass)
        return 1.0 - fall, fall / c
    return 1.0, h / p.mass


@kernel
def step(p: Axis, v: float, pull: float, h: float) -> tuple[float, float]:
    """New speed and distance after `h` [s] under the force `pull` [N], offset taken off.

    Exact for a held force while the axis slides in one direction (Stribeck's level taken at
    the step's start). A reversal is split at the moment of zero speed, so that the result
    is continuous in the parameters.
    """
    moved = 0.0
    if v != 0.0:
        level = p.coulomb
        if p.stribeck != 0.0:
            ratio = v / p.stribeck_speed
            level += p.stribeck * math.exp(-ratio * ratio)
        side = 1.0 if v > 0.0 else -1.0
        keep, push = decay(p, side, h)
        new = keep * v + push * (pull - side * level)
        if new * side > 0.0:
            return new, 0.5 * h * (v + new)
        slide = h * v / (v - new)
        moved = 0.5 * slide * v
        h -= slide
    hold = p.coulomb + p.stribeck
    if abs(pull) <= hold or h <= 0.0:
        return 0.0, moved
    side = 1.0 if pull > 0.0 else -1.0
    new = decay(p, side, h)[1] * (pull - side * hold)
    return new, moved + 0.5 * h * new


@kernel
def free_run(p: Axis, force: Array, x: float, v: float, h: float, out: Array) -> None:
    """Positions out[n] from `x` [m] and speed `v` [m/s] under `force` [N], n steps of `h` [s]."""
    for k in range(len(out)):
        out[k] = x
        v, gone = step(p, v, force[k] - p.offset, h)
        x += gone


def simulate(p: Axis, force: npt.ArrayLike, dt: float, x: float = 0.0, v: float = 0.0) -> Array:
    """Free run: positions float64[n] under `force` float64[n], from `x` and speed `v`."""
    pull = np.ascontiguousarray(force, dtype=np.float64)
    out = np.empty_like(pull)
    plain = Axis(*(float(value) for value in p))
    compiled(free_run)(plain, pull, float(x), float(v), float(dt), out)
    return out
