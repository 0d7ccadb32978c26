"""The macro-stage as the thesis models it: (4.2)-(4.5), dead zones, saturation.

Three models of one structure: `LINEAR` knows no friction and no limit, `INITIAL` has the
dead zone of Figure 4.9 and the saturation, `TUNED` the dead zone with a jump of Figure 4.14
in its place. Volts at the D/A board, positions in counts.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.control import macro as control
from macromicro.control.macro import MacroLaw
from macromicro.errors import InputError
from macromicro.kernel import compiled, kernel
from macromicro.nominal import FULL_SCALE, PERIOD

Array = npt.NDArray[np.float64]

LINEAR, INITIAL, TUNED = 0, 1, 2


class Motor(NamedTuple):
    """(4.1): amplifier gain ka, resistance r [ohm], back-EMF kb [V s/rad], torque kt [N m/A],
    damping b [N m s/rad], inertia j [kg m2], klin [counts/rad]."""

    ka: float
    r: float
    kb: float
    kt: float
    b: float
    j: float
    klin: float


class Linear(NamedTuple):
    """(4.3), speed [counts/s] over volts: b / (z + a); `dt` [s]. Default: as identified."""

    a: float = -0.95833
    b: float = 165.72
    dt: float = PERIOD


class MacroModel(NamedTuple):
    """Linear dynamics behind saturation `limit` [V] and a dead zone of `width` [V].

    `kind`: LINEAR, INITIAL or TUNED; a0 [V] and delta [1]: of (4.5). Default: as printed.
    """

    linear: Linear = Linear()
    kind: int = TUNED
    width: float = 3.0
    a0: float = 0.364
    delta: float = 0.636
    limit: float = FULL_SCALE


class MacroModelState(NamedTuple):
    """Position x [counts] and speed v [counts/s]."""

    x: float
    v: float


def transfer(p: Motor) -> tuple[float, float]:
    """(4.2): gain [counts/s2/V] and pole [rad/s] of speed over volts, gain / (s + pole)."""
    if not all(math.isfinite(v) and v > 0.0 for v in (p.r, p.j)):
        raise InputError("motor, r and j", (p.r, p.j), "above 0")
    return p.ka * p.klin * p.kt / (p.j * p.r), (p.b * p.r + p.kt * p.kb) / (p.j * p.r)


def discretised(gain: float, pole: float, dt: float) -> Linear:
    """(4.3) from (4.2), its input held for `dt` [s]. The printed a lacks a minus sign."""
    if not (pole > 0.0 and dt > 0.0):
        raise InputError("discretised: pole, dt", (pole, dt), "both above 0")
    return Linear(-math.exp(-pole * dt), -gain / pole * math.expm1(-pole * dt), dt)


def position_transfer(p: Linear) -> tuple[Array, Array]:
    """(4.4): numerator and denominator in z, highest power first, (4.3) times dt/(z - 1)."""
    return np.array([p.b * p.dt]), np.array([1.0, p.a - 1.0, -p.a])


@kernel
def saturated(limit: float, volts: float) -> float:
    """Volts [V] within +-`limit` (Section 4.2.1)."""
    return min(max(volts, -limit), limit)


@kernel
def dead_zone(width: float, volts: float) -> float:
    """What is left of `volts` [V] beyond +-`width` [V] (Figure 4.9)."""
    if volts > width:
        return volts - width
    if volts < -width:
        return volts + width
    return 0.0


@kernel
def jump_zone(width: float, a0: float, delta: float, volts: float) -> float:
    """Dead zone with a jump (Figure 4.14): none up to `width` [V], (4.5) of the rest beyond."""
    # `jump` of `dead_zone` in one expression, which a batch computes in vector registers.
    rest = abs(volts) - width
    return math.copysign(a0 + delta * rest, volts) if rest > 0.0 else 0.0


@kernel
def jump(a0: float, delta: float, volts: float) -> float:
    """(4.5), read (a0 + delta |V|) sgn V; 0 at 0."""
    if volts == 0.0:
        return 0.0
    return math.copysign(a0 + delta * abs(volts), volts)


@kernel
def net_volts(p: MacroModel, motor: float) -> float:
    """Volts [V] that reach the linear dynamics for `motor` [V] at the D/A board."""
    if p.kind == LINEAR:
        # The inverse is taken to cancel the friction wholly (Figure 4.19).
        return dead_zone(p.width, motor)
    limited = saturated(p.limit, motor)
    if p.kind == INITIAL:
        return dead_zone(p.width, limited)
    return jump_zone(p.width, p.a0, p.delta, limited)


@kernel
def step(p: MacroModel, s: MacroModelState, motor: float) -> MacroModelState:
    """The model one period later, `motor` [V] held: (4.3), then the integrator of (4.4)."""
    v = p.linear.b * net_volts(p, motor) - p.linear.a * s.v
    return MacroModelState(s.x + p.linear.dt * s.v, v)


@kernel
def _open(p: MacroModel, s: MacroModelState, motor: Array, out: Array) -> None:
    for k in range(len(motor)):
        out[k] = s.x
        s = step(p, s, motor[k])


@kernel
def whole(x: float) -> float:
    """The greatest whole number not above `x`, |x| < 2^51, as floats.

    Not `math.floor`, which compiled code reaches only over integers.
    """
    nearest = (x + 6755399441055744.0) - 6755399441055744.0  # 1.5 * 2^52: no place for halves
    return nearest - 1.0 if nearest > x else nearest


@kernel
def rollout(
    p: MacroModel, law: MacroLaw, s: MacroModelState, reference: Array, counted: bool, out: Array
) -> MacroModelState:
    """The loop of `closed_loop` from `s` on; positions and volts into the rows of `out`."""
    memory = control.rest(0.0)
    seen = math.nan
    for k in range(len(reference)):
        if not counted:
            seen = s.x
        elif not seen <= s.x < seen + 1.0:
            # Only a new count: the next effort need not wait for the position's arithmetic.
            seen = whole(s.x)
        memory, motor = control.step(law, memory, reference[k] - seen, p.linear.dt)
        out[0, k], out[1, k] = seen, motor
        s = step(p, s, motor)
    return s


def simulate(p: MacroModel, motor: npt.ArrayLike, start: float = 0.0) -> Array:
    """Position [counts], (n,), for D/A volts (n,) from rest at `start` (Figures 4.12, 4.16)."""
    sent = np.ascontiguousarray(motor, dtype=np.float64)
    out = np.empty_like(sent)
    compiled(_open)(p, MacroModelState(float(start), 0.0), sent, out)
    return out


def closed_loop(
    p: MacroModel,
    law: MacroLaw,
    reference: npt.ArrayLike,
    start: float = 0.0,
    counted: bool = False,
) -> tuple[Array, Array]:
    """Position [counts] and D/A volts, (n,), under a control law (Figures 4.19, 4.21).

    `reference`: counts, (n,), a sample each `dt`. The law's own limit saturates the volts,
    which act without the bench's delay. `counted`: the law sees, and the result holds, the
    whole counts that an encoder shows (rounded down), else the position itself.
    """
    aim = np.ascontiguousarray(reference, dtype=np.float64)
    out = np.empty((2, len(aim)))
    compiled(rollout)(p, law, MacroModelState(float(start), 0.0), aim, counted, out)
    return out[0], out[1]
