"""The macro-stage in motion: motor, friction, belt and end stops on one mass."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from macromicro import nominal
from macromicro.columns import Meaning
from macromicro.kernel import kernel
from macromicro.plant import belt, friction, motor
from macromicro.plant.belt import Belt
from macromicro.plant.friction import Friction, Worn
from macromicro.plant.motor import Motor
from macromicro.schema.par import Par

# A carriage that stands needs this many times fewer steps than one that slides.
QUIET = 10


class Carriage(NamedTuple):
    """The moving mass and where its way ends."""

    mass: Annotated[
        float,
        Par(
            "kg",
            "carriage, micro-stage and rotor, at the belt",
            "calibrated to M4a, M4b, M5",
            shown="g",
            positive=True,
        ),
    ] = 0.45
    stop_low: Annotated[float, Par("m", "lower end stop", shown="mm")] = nominal.STOP_LOW
    stop_high: Annotated[
        float, Par("m", "upper end stop (3000 counts)", "Section 4.3.3", shown="mm")
    ] = nominal.STOP_HIGH
    stop_stiffness: Annotated[
        float, Par("N/m", "stiffness of the rubber end stops", shown="N/mm", positive=True)
    ] = 5.0e4
    stop_damping: Annotated[float, Par("N*s/m", "damping of the end stops", lo=0.0)] = 60.0


class Macro(NamedTuple):
    carriage: Carriage
    motor: Motor
    friction: Friction
    belt: Belt


class MacroState(NamedTuple):
    x: Annotated[float, Meaning("position", "m")]
    v: Annotated[float, Meaning("speed", "m/s")]
    z: Annotated[float, Meaning("deflection of the bristles", "m")]
    i: Annotated[float, Meaning("armature current", "A")]
    q: Annotated[float, Meaning("deflection of the belt mode", "m")]
    qv: Annotated[float, Meaning("speed of that", "m/s")]
    accel: Annotated[float, Meaning("mean acceleration over the last call of advance", "m/s^2")]
    worn: Annotated[Worn, Meaning("what the friction remembers")]


def at_rest(x: float) -> MacroState:
    return MacroState(float(x), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, Worn(0.0, 0.0))


@kernel
def stop_terms(
    p: Carriage, x: float, h: float
) -> tuple[Annotated[float, Meaning(name="a")], Annotated[float, Meaning(name="b")]]:
    """End stops over one step, linear in the new speed: force = a - b v1."""
    depth = 0.0
    if x < p.stop_low:
        depth = x - p.stop_low
    elif x > p.stop_high:
        depth = x - p.stop_high
    if depth == 0.0:
        return 0.0, 0.0
    return -p.stop_stiffness * depth, p.stop_stiffness * h + p.stop_damping


@kernel
def substep(p: Macro, s: MacroState, volts: float, offset: float, h: float) -> MacroState:
    """One step of (4.1) with friction and belt, implicit and linear in the new speed."""
    mass = p.carriage.mass
    i0, i1 = motor.current_terms(p.motor, s.i, volts, h)
    stiffness, damping = p.friction.bristle, p.friction.bristle_damping
    z0, z1, f0, f1 = friction.bristle_terms(p.friction, stiffness, damping, s.z, s.v, offset, h)
    e0, e1 = stop_terms(p.carriage, s.x, h)
    mode = belt.tensioned(p.belt, s.x)
    push = motor.force(p.motor, i0) - f0 + e0 + belt.reaction(mode, mass, s.q, s.qv)
    drag = motor.force(p.motor, i1) + f1 + e1 + p.friction.viscous
    v = (mass * s.v + h * push) / (mass + h * drag)
    q, qv = belt.step(mode, s.q, s.qv, v - s.v, h)
    return MacroState(s.x + h * v, v, z0 + z1 * v, i0 - i1 * v, q, qv, s.accel, s.worn)


@kernel
def _stands(s: MacroState, volts: float) -> bool:
    """Whether the motor is off and friction holds the carriage, far below breakaway."""
    return volts == 0.0 and abs(s.i) < 1e-6 and abs(s.v) < 2e-4 and abs(s.z) < 1e-6


@kernel
def advance(
    p: Macro,
    s: MacroState,
    volts: Annotated[float, Meaning("at the motor throughout", "V")],
    dt: float,
    substeps: int,
) -> MacroState:
    # The rod's friction level changes over millimetres, the carriage moves 0.5 mm at most.
    offset = friction.local(p.friction, s.x, s.worn)
    if _stands(s, volts):
        substeps = max(substeps // QUIET, 1)
    h = dt / substeps
    v0 = s.v
    for _ in range(substeps):
        s = substep(p, s, volts, offset, h)
    worn = friction.worn(p.friction, s.worn, s.v, dt)
    return MacroState(s.x, s.v, s.z, s.i, s.q, s.qv, (s.v - v0) / dt, worn)
