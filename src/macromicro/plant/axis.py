"""One motor-driven axis: motor and load, stiffly or flexibly joined, with friction and stops."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

from macromicro.arrays import Array
from macromicro.columns import Quantity
from macromicro.kernel import kernel
from macromicro.plant import carriage, encoder, power, rubbing, transmission
from macromicro.plant.carriage import Carriage
from macromicro.plant.encoder import Encoder
from macromicro.plant.power import Power

NOISES = 1


class Body(NamedTuple):
    """Masses, what joins them, and what acts on them; runtime parameters.

    Attributes
    ----------
    motor : float
        What turns with the motor, at the load's way, kg.
    stiffness : float
        Of the drive, N/m; 0: motor and load are one mass.
    damping : float
        Of the drive, N s/m.
    slack : float
        Backlash, m.
    weight : float
        Pull of gravity along the axis, towards lower positions, N.
    error, error_period : float
        Pitch error, m.
    cogging, cogging_period : float
        N, m.
    unbalance : float
        Greatest pull of gravity on an eccentric load of an axis that turns, N m; 0 of a slide.
    hangs : float
        Angle at which that load hangs, rad.
    """

    motor: float
    stiffness: float
    damping: float
    slack: float
    weight: float
    error: float
    error_period: float
    cogging: float
    cogging_period: float
    unbalance: float
    hangs: float


class Reading(NamedTuple):
    """How the position is measured; runtime parameters.

    Attributes
    ----------
    encoder : Encoder
        Travel per count, at the load, and width of the counter.
    at_load : int
        0: on the motor.
    noise : float
        Standard deviation, m.
    """

    encoder: Encoder
    at_load: int
    noise: float


class Axis(NamedTuple):
    """Runtime parameters.

    Attributes
    ----------
    power : Power
        D/A, amplifier, motor.
    load : Carriage
        Moving mass with payload, and end stops.
    body : Body
        Drive and masses.
    friction : Any
        At the load: `Friction`, or the parameters of a part of another package (`rubbing`).
    reading : Reading
        The encoder.
    delay : float
        From writing an effort until it acts, s; at most a control period.
    steps : int
        Steps of the physics in a control period.
    """

    power: Power
    load: Carriage
    body: Body
    friction: Any
    reading: Reading
    delay: float
    steps: int


class State(NamedTuple):
    """State of the axis.

    Attributes
    ----------
    x, v : float
        Load, m and m/s; the way of the nut, without pitch error.
    xm, vm : float
        The motor's side of the drive, in the same units.
    rubbed : Any
        What the friction remembers: the deflection of its bristles, m, or a part's state.
    i : float
        Current, A.
    effort : float
        That acts now, V at the D/A.
    """

    x: float
    v: float
    xm: float
    vm: float
    rubbed: Any
    i: float
    effort: float


class Truth(NamedTuple):
    """What only the simulated axis knows."""

    position: Annotated[
        float, Quantity("mm", "true position of the load", column="true_position", scale=1e3)
    ]
    speed: Annotated[float, Quantity("mm/s", "true speed", column="true_speed", scale=1e3)]
    current: Annotated[float, Quantity("A", "motor current", column="motor_current")]


def at_rest(p: Axis) -> State:
    """The axis standing at 0, held by its friction where its weight pulls.

    Parameters
    ----------
    p : Axis
        Parameters.

    Returns
    -------
    State
        Without current.
    """
    held = rubbing.begun(p.friction, gravity(p.body, 0.0))
    return State(0.0, 0.0, 0.0, 0.0, held, 0.0, 0.0)


@kernel
def gravity(p: Body, x: float) -> float:
    """Pull of gravity towards lower positions.

    Of a weight on a slope, and of an eccentric load: m g r sin(x - hangs), which turns it to where
    it hangs.

    Parameters
    ----------
    p : Body
        Parameters.
    x : float
        Where the load is, m, or rad.

    Returns
    -------
    float
        N, or N m.
    """
    if p.unbalance == 0.0:
        return p.weight
    return p.weight + p.unbalance * math.sin(x - p.hangs)


@kernel
def _joined(p: Axis, s: State, effort: float, offset: float, h: float) -> State:
    """A step of motor and load as one mass."""
    mass = p.body.motor + p.load.mass
    i0, i1 = power.current_terms(p.power, s.i, effort, s.v, h)
    z0, z1, f0, f1 = rubbing.terms(p.friction, s.rubbed, s.x, s.v, offset, h)
    e0, e1 = carriage.stop_terms(p.load, s.x, h)
    # Gravity where the load is half a step later: so a free pendulum keeps its energy.
    outer = transmission.wave(p.body.cogging, p.body.cogging_period, s.x)
    outer -= gravity(p.body, s.x + 0.5 * h * s.v)
    push = p.power.push * i0 - f0 + e0 + outer
    drag = p.power.push * i1 + f1 + e1 + rubbing.viscous(p.friction)
    v = (mass * s.v + h * push) / (mass + h * drag)
    x = s.x + 0.5 * h * (s.v + v)
    rubbed = rubbing.after(p.friction, s.rubbed, z0 + z1 * v, s.x, v, h)
    return State(x, v, x, v, rubbed, i0 - i1 * v, effort)


@kernel
def _apart(p: Axis, s: State, effort: float, offset: float, h: float) -> State:
    """A step of motor and load on either side of a spring with slack.

    The spring by the implicit midpoint rule, which takes nothing from the mode's energy; all else
    implicitly; both new speeds follow from two linear equations.
    """
    body = p.body
    i0, i1 = power.current_terms(p.power, s.i, effort, s.vm, h)
    z0, z1, f0, f1 = rubbing.terms(p.friction, s.rubbed, s.x, s.v, offset, h)
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
    d = p.load.mass + h * (f1 + e1 + rubbing.viscous(p.friction)) + c
    e = p.load.mass * s.v + h * (pull - f0 + e0 - gravity(body, s.x + 0.5 * h * s.v))
    whole = a * d - c * c
    vm = (b * d + c * e) / whole
    v = (a * e + b * c) / whole
    x, xm = s.x + 0.5 * h * (s.v + v), s.xm + 0.5 * h * (s.vm + vm)
    rubbed = rubbing.after(p.friction, s.rubbed, z0 + z1 * v, s.x, v, h)
    return State(x, v, xm, vm, rubbed, i0 - i1 * vm, effort)


@kernel
def advance(p: Axis, s: State, effort: float, noise: Array, k: int, dt: float) -> State:
    """The axis after one control period.

    Parameters
    ----------
    p : Axis
        Parameters.
    s : State
        State.
    effort : float
        V at the D/A's input; it acts after the delay, the one before it until then.
    noise : ndarray, shape (periods, NOISES)
        Not used here.
    k : int
        Its row.
    dt : float
        Control period, s.

    Returns
    -------
    State
        New state.
    """
    offset = rubbing.offset(p.friction, s.x)
    h = dt / p.steps
    before = s.effort
    for j in range(p.steps):
        now = before if (j + 0.5) * h < p.delay else effort
        if p.body.stiffness > 0.0:
            s = _apart(p, s, now, offset, h)
        else:
            s = _joined(p, s, now, offset, h)
    return State(s.x, s.v, s.xm, s.vm, s.rubbed, s.i, effort)


@kernel
def place(p: Axis, s: State) -> float:
    """True position of the load, with the drive's pitch error.

    Parameters
    ----------
    p : Axis
        Parameters.
    s : State
        State.

    Returns
    -------
    float
        m.
    """
    return s.x + transmission.wave(p.body.error, p.body.error_period, s.x)


@kernel
def measured(p: Axis, s: State, noise: Array, k: int) -> float:
    """The encoder's reading.

    Parameters
    ----------
    p : Axis
        Parameters.
    s : State
        State.
    noise : ndarray, shape (periods, NOISES)
        Standard normal draws.
    k : int
        Its row.

    Returns
    -------
    float
        Counts.
    """
    x = place(p, s) if p.reading.at_load == 1 else s.xm
    # Half a count up: a count stands for the middle of its width.
    off = p.reading.noise * noise[k, 0] + 0.5 * p.reading.encoder.pitch
    return encoder.count(p.reading.encoder, x + off)


@kernel
def truth(p: Axis, s: State) -> Truth:
    """What is true of the axis.

    Parameters
    ----------
    p : Axis
        Parameters.
    s : State
        State.

    Returns
    -------
    Truth
        SI.
    """
    return Truth(place(p, s), s.v, s.i)
