"""The guard: nothing illegal passes, and a rig that does not answer is switched off.

It sees what a real rig shows - samples, the controller's command, the outputs - and
never the state of a simulated one. A fault latches: from then on all outputs are safe.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from macromicro.control import calibration
from macromicro.control.calibration import Calibration
from macromicro.kernel import kernel
from macromicro.models import electrothermal
from macromicro.models.electrothermal import Heating
from macromicro.rig import envelope, sensing
from macromicro.rig.codes import ILLEGAL, MACRO_LOST, MICRO_LOST, NO_MOTION, OK, TOO_HOT
from macromicro.rig.envelope import Bounds, Envelope
from macromicro.rig.limits import Limits
from macromicro.rig.sensing import Seen
from macromicro.types import Command, Outputs, Sample

ROOM = 25.0


class Guard(NamedTuple):
    """Runtime parameters.

    Attributes
    ----------
    limits : Limits
        As the user may set them, SI.
    macro : Bounds
        Envelope, counts.
    micro : Bounds
        Envelope, m.
    calibration : Calibration
        Calibration of the Hall sensor.
    """

    limits: Limits
    macro: Bounds
    micro: Bounds
    calibration: Calibration


class Heat(NamedTuple):
    """What the guard estimates of the actuator.

    Attributes
    ----------
    heating : Heating
        State of (5.6).
    anchor : float
        Where the stage last moved to, m.
    idle : float
        For how long it has been heated without motion, s.
    """

    heating: Heating
    anchor: float
    idle: float


class Watch(NamedTuple):
    """State of the guard.

    Attributes
    ----------
    fault : int
        One of `codes`.
    value : float
        What was measured at the fault: V, s, counts, m or deg C.
    limit : float
        Its limit.
    time : float
        When, s.
    seen : Seen
        What the sensors have shown.
    macro : Envelope
        Envelope, counts.
    micro : Envelope
        Envelope, m.
    heat : Heat
        Estimate of the actuator's heat.
    """

    fault: int
    value: float
    limit: float
    time: float
    seen: Seen
    macro: Envelope
    micro: Envelope
    heat: Heat


def prepare(limits: Limits, table: Calibration) -> Guard:
    """Runtime parameters of the guard.

    Parameters
    ----------
    limits : Limits
        As the user may set them.
    table : Calibration
        Calibration of the Hall sensor.

    Returns
    -------
    Guard
        Envelopes in counts and m.
    """
    return Guard(
        limits,
        Bounds(limits.macro_margin, limits.macro_tolerance, limits.macro_rate, limits.macro_grace),
        Bounds(
            limits.micro_margin,
            limits.micro_tolerance,
            limits.micro_rate,
            limits.micro_grace,
        ),
        table,
    )


def fresh() -> Watch:
    """The guard at the start: nothing seen yet, all well, actuator cold.

    Returns
    -------
    Watch
        State.
    """
    return Watch(
        OK,
        0.0,
        0.0,
        0.0,
        sensing.UNSEEN,
        envelope.closed(),
        envelope.closed(),
        Heat(Heating(0.0, 0.0, 0.0), math.nan, 0.0),
    )


@kernel
def temperature(s: Watch) -> float:
    """Wire temperature estimated from CTRL alone: (5.6)-(5.8) above room temperature.

    Parameters
    ----------
    s : Watch
        State of the guard.

    Returns
    -------
    float
        deg C.
    """
    return ROOM + electrothermal.temperature(s.heat.heating)


@kernel
def legal(p: Limits, out: Outputs) -> bool:
    """Whether all outputs are finite and within range. NaN fails every comparison.

    Parameters
    ----------
    p : Limits
        Limits.
    out : Outputs
        Outputs that were asked for.

    Returns
    -------
    bool
        False if one is not.
    """
    return (
        abs(out.motor) <= p.motor
        and 0.0 <= out.ctrl <= p.ctrl
        and out.fan * (1.0 - out.fan) == 0.0
        and out.laser_reset * (1.0 - out.laser_reset) == 0.0
    )


@kernel
def _warm(p: Limits, s: Heat, ctrl: float, requested: bool, place: float, dt: float) -> Heat:
    """Estimated heating after `dt`, and how long the stage at `place` [m] ignores it.

    `requested`: a contraction is being asked for and not yet there.
    """
    heating = electrothermal.step(s.heating, electrothermal.gain(ctrl, p.ceiling), dt)
    hot = ROOM + electrothermal.temperature(heating) > p.warm
    moved = math.isnan(s.anchor) or abs(place - s.anchor) > p.motion
    if not hot or not requested or moved:
        return Heat(heating, place, 0.0)
    return Heat(heating, s.anchor, s.idle + dt)


@kernel
def _heat_fault(p: Limits, s: Heat) -> tuple[int, float, float]:
    """Fault of the actuator: code, measured [degC], limit."""
    estimate = ROOM + electrothermal.temperature(s.heating)
    if estimate > p.hottest:
        return TOO_HOT, estimate, p.hottest
    if s.idle > p.idle:
        return NO_MOTION, estimate, s.idle
    return OK, 0.0, 0.0


@kernel
def step(
    p: Guard, s: Watch, sample: Sample, command: Command, out: Outputs, dt: float
) -> tuple[Watch, Outputs]:
    """One control period of the guard.

    Parameters
    ----------
    p : Guard
        Parameters of the guard.
    s : Watch
        State of the guard.
    sample : Sample
        What the rig shows.
    command : Command
        What the controller is asking for.
    out : Outputs
        The outputs that it wants.
    dt : float
        Control period, s.

    Returns
    -------
    state : Watch
        New state; a fault in it latches.
    outputs : Outputs
        Those that may be written: `out`, or all safe.
    """
    q = p.limits
    fine = legal(q, out)
    effort = out.motor if fine else 0.0
    seen = sensing.look(q, s.seen, sample, effort, dt)
    place = calibration.position(p.calibration, seen.hall)
    error = abs(command.macro_reference - seen.encoder)
    macro = envelope.follow(
        p.macro, s.macro, command.macro_active, command.macro_reference, error, dt
    )
    off = command.micro_reference - place
    micro = envelope.follow(
        p.micro, s.micro, command.micro_active, command.micro_reference, abs(off), dt
    )
    ctrl = out.ctrl if fine and s.fault == OK else 0.0
    requested = command.micro_active > 0.5 and off > q.motion
    heat = _warm(q, s.heat, ctrl, requested, place, dt)

    fault, value, limit, time = s.fault, s.value, s.limit, s.time
    if fault == OK:
        if not fine:
            fault, value, limit = ILLEGAL, out.motor, q.motor
            if abs(out.motor) <= q.motor:
                value, limit = out.ctrl, q.ctrl
        if fault == OK:
            fault, value, limit = sensing.fault(q, seen, abs(effort))
        if fault == OK and command.macro_active > 0.5 and error > macro.allowed:
            fault, value, limit = MACRO_LOST, error, macro.allowed
        if fault == OK and command.micro_active > 0.5 and abs(off) > micro.allowed:
            fault, value, limit = MICRO_LOST, abs(off), micro.allowed
        if fault == OK:
            fault, value, limit = _heat_fault(q, heat)
        if fault != OK:
            time = seen.time
    watch = Watch(fault, value, limit, time, seen, macro, micro, heat)
    if fault != OK:
        return watch, Outputs(0.0, 0.0, 0.0, 0.0)
    return watch, out
