"""One motor-driven axis: motor, drive, load, friction and end stops."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.arrays import Array
from macromicro.columns import Meaning, Quantity
from macromicro.kernel import kernel
from macromicro.plant import carriage, climate, encoder, friction, power, transmission
from macromicro.plant.carriage import Carriage
from macromicro.plant.climate import Climate
from macromicro.plant.encoder import Encoder
from macromicro.plant.friction import AxisFriction
from macromicro.plant.power import Power

NOISES = 1


class Body(NamedTuple):
    """Masses, drive stiffness and forces."""

    motor: Annotated[float, Meaning("rotating inertia of the motor as a mass at the load", "kg")]
    stiffness: Annotated[float, Meaning("of the drive; 0: motor and load are one mass", "N/m")]
    damping: Annotated[float, Meaning("of the drive", "N s/m")]
    slack: Annotated[float, Meaning("backlash", "m")]
    weight: Annotated[
        float, Meaning("pull of gravity along the axis, towards lower positions", "N")
    ]
    error: Annotated[float, Meaning("pitch error", "m")]
    error_period: Annotated[float, Meaning("period of the pitch error", "m")]
    cogging: Annotated[float, Meaning("cogging force", "N")]
    cogging_period: Annotated[float, Meaning("period of the cogging force", "m")]
    unbalance: Annotated[
        float,
        Meaning(
            "greatest pull of gravity on an eccentric load of an axis that turns; 0 of a slide",
            "N m",
        ),
    ]
    hangs: Annotated[float, Meaning("angle at which that load hangs", "rad")]


class Reading(NamedTuple):
    encoder: Annotated[Encoder, Meaning("travel per count, at the load, and width of the counter")]
    at_load: Annotated[int, Meaning("0: on the motor")]
    noise: Annotated[float, Meaning("standard deviation", "m")]


class Axis(NamedTuple):
    power: Annotated[Power, Meaning("D/A, amplifier, motor")]
    load: Annotated[Carriage, Meaning("moving mass with payload, and end stops")]
    body: Annotated[Body, Meaning("drive and masses")]
    friction: Annotated[AxisFriction, Meaning("at the load")]
    reading: Annotated[Reading, Meaning("the encoder")]
    delay: Annotated[
        float, Meaning("from writing an effort until it acts; at most a control period", "s")
    ]
    steps: Annotated[int, Meaning("steps of the physics in a control period")]
    climate: Annotated[Climate, Meaning("warming and growth")]


class State(NamedTuple):
    x: Annotated[float, Meaning("position of the load, without pitch error", "m")]
    v: Annotated[float, Meaning("speed of the load, without pitch error", "m/s")]
    xm: Annotated[float, Meaning("position of the motor's side of the drive", "m")]
    vm: Annotated[float, Meaning("speed of the motor's side of the drive", "m/s")]
    rubbed: Annotated[float, Meaning("deflection of the friction's bristles", "m")]
    i: Annotated[float, Meaning("current", "A")]
    effort: Annotated[float, Meaning("that acts now, at the D/A", "V")]
    degrees: Annotated[float, Meaning("temperature of the drive", "degC")]


class Truth(NamedTuple):
    """True quantities of the simulated axis."""

    position: Annotated[
        float, Quantity("mm", "true position of the load", column="true_position", scale=1e3)
    ]
    speed: Annotated[float, Quantity("mm/s", "true speed", column="true_speed", scale=1e3)]
    current: Annotated[float, Quantity("A", "motor current", column="motor_current")]


def at_rest(p: Axis) -> State:
    """At rest at 0, held by friction against gravity."""
    held = friction.deflection(p.friction, gravity(p.body, 0.0))
    return State(0.0, 0.0, 0.0, 0.0, held, 0.0, 0.0, p.climate.start)


@kernel
def gravity(p: Body, x: float) -> float:
    """Gravity towards lower positions: on a slope, or m g r sin(x - hangs) of an eccentric load."""
    if p.unbalance == 0.0:
        return p.weight
    return p.weight + p.unbalance * math.sin(x - p.hangs)


@kernel
def _joined(
    p: Axis, s: State, effort: float, offset: float, stiffness: float, damping: float, h: float
) -> State:
    """One step of motor and load as one mass."""
    mass = p.body.motor + p.load.mass
    i0, i1 = power.current_terms(p.power, s.i, effort, s.v, h)
    z0, z1, f0, f1 = friction.bristle_terms(
        p.friction, stiffness, damping, s.rubbed, s.v, offset, h
    )
    e0, e1 = carriage.stop_terms(p.load, s.x, h)
    # Gravity where the load is half a step later: so a free pendulum keeps its energy.
    outer = transmission.wave(p.body.cogging, p.body.cogging_period, s.x)
    outer -= gravity(p.body, s.x + 0.5 * h * s.v)
    push = p.power.push * i0 - f0 + e0 + outer
    drag = p.power.push * i1 + f1 + e1 + p.friction.viscous
    v = (mass * s.v + h * push) / (mass + h * drag)
    x = s.x + 0.5 * h * (s.v + v)
    return State(x, v, x, v, z0 + z1 * v, i0 - i1 * v, effort, s.degrees)


@kernel
def _apart(
    p: Axis, s: State, effort: float, offset: float, stiffness: float, damping: float, h: float
) -> State:
    """One step of motor and load on either side of a spring with slack.

    The spring by the implicit midpoint rule, all else implicitly: two linear equations.
    """
    body = p.body
    i0, i1 = power.current_terms(p.power, s.i, effort, s.vm, h)
    z0, z1, f0, f1 = friction.bristle_terms(
        p.friction, stiffness, damping, s.rubbed, s.v, offset, h
    )
    e0, e1 = carriage.stop_terms(p.load, s.x, h)
    strain = transmission.stretch(body.slack, s.xm - s.x)
    # Spring force over the step: pull + give (vm1 - v1), where it touches.
    pull, give = 0.0, 0.0
    if strain != 0.0 or body.slack == 0.0:
        give = 0.25 * h * body.stiffness + 0.5 * body.damping
        pull = body.stiffness * strain + give * (s.vm - s.v)
    cogging = transmission.wave(body.cogging, body.cogging_period, s.xm)
    # a vm1 - c v1 = b;  -c vm1 + d v1 = e
    c = h * give
    a = body.motor + h * p.power.push * i1 + c
    b = body.motor * s.vm + h * (p.power.push * i0 + cogging - pull)
    d = p.load.mass + h * (f1 + e1 + p.friction.viscous) + c
    e = p.load.mass * s.v + h * (pull - f0 + e0 - gravity(body, s.x + 0.5 * h * s.v))
    whole = a * d - c * c
    vm = (b * d + c * e) / whole
    v = (a * e + b * c) / whole
    x, xm = s.x + 0.5 * h * (s.v + v), s.xm + 0.5 * h * (s.vm + vm)
    return State(x, v, xm, vm, z0 + z1 * v, i0 - i1 * vm, effort, s.degrees)


@kernel
def advance(
    p: Axis,
    s: State,
    effort: Annotated[float, Meaning("at the D/A, which acts after the delay", "V")],
    noise: Array,
    k: int,
    dt: float,
) -> State:
    offset = friction.ripple(p.friction, s.x)
    stiffness, damping = friction.before_sliding(p.friction, p.body.motor + p.load.mass)
    h = dt / p.steps
    before = s.effort
    for j in range(p.steps):
        now = before if (j + 0.5) * h < p.delay else effort
        if p.body.stiffness > 0.0:
            s = _apart(p, s, now, offset, stiffness, damping, h)
        else:
            s = _joined(p, s, now, offset, stiffness, damping, h)
    degrees = climate.advanced(p.climate, s.degrees, dt)
    return State(s.x, s.v, s.xm, s.vm, s.rubbed, s.i, effort, degrees)


@kernel
def place(p: Axis, s: State) -> float:
    """True position of the load, with the drive's pitch error and its growth in the heat."""
    x = s.x + transmission.wave(p.body.error, p.body.error_period, s.x)
    if p.climate.expansion != 0.0:
        x += climate.growth(p.climate, s.degrees) * s.x
    return x


@kernel
def measured(p: Axis, s: State, noise: Array, k: int) -> float:
    x = place(p, s) if p.reading.at_load == 1 else s.xm
    # Half a count up: a count stands for the middle of its width.
    off = p.reading.noise * noise[k, 0] + 0.5 * p.reading.encoder.pitch
    return encoder.count(p.reading.encoder, x + off)


@kernel
def truth(p: Axis, s: State) -> Truth:
    return Truth(place(p, s), s.v, s.i)
