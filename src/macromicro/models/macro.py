"""The macro-stage as the thesis models it: (4.2)-(4.5), dead zones, saturation.

`LINEAR` has no friction and no limit, `INITIAL` the dead zone of Figure 4.9 and the saturation,
`TUNED` the dead zone with a jump of Figure 4.14. Volts at the D/A board, positions in counts.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.control import macro as control
from macromicro.control.macro import MacroLaw
from macromicro.control.stage_law import Sample, Target
from macromicro.errors import InputError
from macromicro.kernel import compiled, kernel
from macromicro.nominal import FULL_SCALE, PERIOD

LINEAR, INITIAL, TUNED = 0, 1, 2


class Motor(NamedTuple):
    """Parameters of (4.1)."""

    ka: float  # gain of the amplifier
    r: float  # resistance, ohm
    kb: float  # back-EMF constant, V s/rad
    kt: float  # torque constant, N m/A
    b: float  # damping, N m s/rad
    j: float  # inertia, kg m2
    klin: float  # counts per angle, counts/rad


class Linear(NamedTuple):
    """(4.3), speed over volts: b / (z + a); as identified by default."""

    a: float = -0.95833  # dimensionless
    b: float = 165.72  # counts/s/V
    dt: float = PERIOD  # sample time, s


class MacroModel(NamedTuple):
    """Linear dynamics behind a saturation and a dead zone; as printed by default."""

    linear: Linear = Linear()  # (4.3)
    kind: int = TUNED  # LINEAR, INITIAL or TUNED
    width: float = 3.0  # dead zone, V
    a0: float = 0.364  # a0 of (4.5), V
    delta: float = 0.636  # delta of (4.5), dimensionless
    limit: float = FULL_SCALE  # saturation, V


class MacroModelState(NamedTuple):
    """Position x [counts] and speed v [counts/s]."""

    x: float  # position, counts
    v: float  # speed, counts/s


def transfer(p: Motor) -> tuple[float, float]:
    """(4.2): speed over volts, gain / (s + pole), from (4.1), counts/s2/V."""
    if not all(math.isfinite(v) and v > 0.0 for v in (p.r, p.j)):
        raise InputError("motor, r and j", (p.r, p.j), "above 0")
    return p.ka * p.klin * p.kt / (p.j * p.r), (p.b * p.r + p.kt * p.kb) / (p.j * p.r)


def discretise(gain: float, pole: float, dt: float) -> Linear:
    """(4.3) from (4.2), input held; `gain` in counts/s2/V. The printed a lacks a minus sign."""
    if not (pole > 0.0 and dt > 0.0):
        raise InputError("discretised: pole, dt", (pole, dt), "both above 0")
    return Linear(-math.exp(-pole * dt), -gain / pole * math.expm1(-pole * dt), dt)


def position_transfer(p: Linear) -> tuple[Array, Array]:
    """(4.4): (4.3) times dt/(z - 1)."""
    return np.array([p.b * p.dt]), np.array([1.0, p.a - 1.0, -p.a])


@kernel
def saturated(limit: float, volts: float) -> float:
    """A voltage within limits (Section 4.2.1)."""
    return min(max(volts, -limit), limit)


@kernel
def dead_zone(width: float, volts: float) -> float:
    """Voltage beyond a dead zone (Figure 4.9)."""
    if volts > width:
        return volts - width
    if volts < -width:
        return volts + width
    return 0.0


@kernel
def jump_zone(width: float, a0: float, delta: float, volts: float) -> float:
    """Dead zone with a jump (Figure 4.14): zero up to `width`, (4.5) of the rest beyond."""
    # `jump` of `dead_zone` in one expression, which a batch computes in vector registers.
    rest = abs(volts) - width
    return math.copysign(a0 + delta * rest, volts) if rest > 0.0 else 0.0


@kernel
def jump(a0: float, delta: float, volts: float) -> float:
    """(4.5), read (a0 + delta |V|) sgn V."""
    if volts == 0.0:
        return 0.0
    return math.copysign(a0 + delta * abs(volts), volts)


@kernel
def net_volts(p: MacroModel, motor: float) -> float:
    """Volts that reach the linear dynamics."""
    if p.kind == LINEAR:
        # The inverse is taken to cancel the friction wholly (Figure 4.19).
        return dead_zone(p.width, motor)
    limited = saturated(p.limit, motor)
    if p.kind == INITIAL:
        return dead_zone(p.width, limited)
    return jump_zone(p.width, p.a0, p.delta, limited)


@kernel
def step(p: MacroModel, s: MacroModelState, motor: float) -> MacroModelState:
    """The model one period later: (4.3), then the integrator of (4.4)."""
    v = p.linear.b * net_volts(p, motor) - p.linear.a * s.v
    return MacroModelState(s.x + p.linear.dt * s.v, v)


@kernel
def _open(p: MacroModel, s: MacroModelState, motor: Array, out: Array) -> None:
    for k in range(len(motor)):
        out[k] = s.x
        s = step(p, s, motor[k])


@kernel
def whole(x: float) -> float:
    """Floor as a float; compiled `math.floor` is limited to integers."""
    nearest = (x + 6755399441055744.0) - 6755399441055744.0  # 1.5 * 2^52: no place for halves
    return nearest - 1.0 if nearest > x else nearest


@kernel
def rollout(
    p: MacroModel, law: MacroLaw, s: MacroModelState, reference: Array, counted: bool, out: Array
) -> MacroModelState:
    """The loop of `closed_loop` from a state on, as a kernel; `reference` in counts."""
    memory, dt = control.begun(law), p.linear.dt
    seen = math.nan
    for k in range(len(reference)):
        if not counted:
            seen = s.x
        elif not seen <= s.x < seen + 1.0:
            # Only a new count: the next effort need not wait for the position's arithmetic.
            seen = whole(s.x)
        memory, motor = control.step(
            law, memory, Target(reference[k], 0.0, 0.0, math.inf), Sample(k * dt, seen), dt
        )
        out[0, k], out[1, k] = seen, motor
        s = step(p, s, motor)
    return s


def simulate(p: MacroModel, motor: npt.ArrayLike, start: float = 0.0) -> Array:
    """Position (counts) for D/A volts over time, from rest (Figures 4.12, 4.16)."""
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
    """Position (counts) and D/A volts under a control law (Figures 4.19, 4.21), without delay."""
    target = np.ascontiguousarray(reference, dtype=np.float64)
    out = np.empty((2, len(target)))
    law.machine(rollout)(p, law, MacroModelState(float(start), 0.0), target, counted, out)
    return out[0], out[1]
