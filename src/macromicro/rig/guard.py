"""The guard: blocks illegal outputs and latches a fault, after which all outputs are safe."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.columns import Meaning
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


class Guard(NamedTuple):
    limits: Annotated[Limits, Meaning("as the user may set them, SI")]
    macro: Annotated[Bounds, Meaning("envelope", "count")]
    micro: Annotated[Bounds, Meaning("envelope", "m")]
    calibration: Annotated[Calibration, Meaning("calibration of the Hall sensor")]


class Heat(NamedTuple):
    """Estimated heat of the actuator."""

    heating: Annotated[Heating, Meaning("state of (5.6)")]
    anchor: Annotated[float, Meaning("where the stage last moved to", "m")]
    idle: Annotated[float, Meaning("for how long it has been heated without motion", "s")]


class Watch(NamedTuple):
    fault: Annotated[int, Meaning("one of codes")]
    value: Annotated[float, Meaning("what was measured at the fault: V, s, counts, m or deg C")]
    limit: Annotated[float, Meaning("its limit")]
    time: Annotated[float, Meaning("when", "s")]
    seen: Annotated[Seen, Meaning("what the sensors have shown")]
    macro: Annotated[Envelope, Meaning("envelope", "count")]
    micro: Annotated[Envelope, Meaning("envelope", "m")]
    heat: Annotated[Heat, Meaning("estimate of the actuator's heat")]


def prepare(limits: Limits, table: Calibration) -> Guard:
    return Guard(
        limits,
        Bounds(limits.macro_margin, limits.macro_tolerance, limits.macro_rate, limits.macro_grace),
        Bounds(limits.micro_margin, limits.micro_tolerance, limits.micro_rate, limits.micro_grace),
        table,
    )


def fresh() -> Watch:
    return Watch(
        OK,
        0.0,
        0.0,
        0.0,
        sensing.UNSEEN,
        envelope.no_set_point(),
        envelope.no_set_point(),
        Heat(Heating(0.0, 0.0, 0.0), math.nan, 0.0),
    )


@kernel
def temperature(p: Limits, s: Watch) -> Annotated[float, Meaning("", "degC")]:
    """Wire temperature (deg C) estimated from CTRL by (5.6)-(5.8)."""
    return p.ambient + electrothermal.temperature(s.heat.heating)


@kernel
def legal(p: Limits, out: Outputs) -> bool:
    """Whether all outputs are finite and within range; NaN fails every comparison."""
    return (
        abs(out.motor) <= p.motor
        and 0.0 <= out.ctrl <= p.ctrl
        and out.fan * (1.0 - out.fan) == 0.0
        and out.laser_reset * (1.0 - out.laser_reset) == 0.0
    )


@kernel
def _warm(p: Limits, s: Heat, ctrl: float, requested: bool, place: float, dt: float) -> Heat:
    """Estimated heating after `dt`, and for how long the stage has not responded to it."""
    heating = electrothermal.step(s.heating, electrothermal.gain(ctrl, p.ceiling), dt)
    hot = p.ambient + electrothermal.temperature(heating) > p.warm
    moved = math.isnan(s.anchor) or abs(place - s.anchor) > p.motion
    if not hot or not requested or moved:
        return Heat(heating, place, 0.0)
    return Heat(heating, s.anchor, s.idle + dt)


@kernel
def _heat_fault(p: Limits, s: Heat) -> tuple[int, float, float]:
    """Fault of the actuator: code, measured [degC], limit."""
    estimate = p.ambient + electrothermal.temperature(s.heating)
    if estimate > p.hottest:
        return TOO_HOT, estimate, p.hottest
    if s.idle > p.idle:
        return NO_MOTION, estimate, s.idle
    return OK, 0.0, 0.0


@kernel
def step(
    p: Guard, s: Watch, sample: Sample, command: Command, out: Outputs, dt: float
) -> tuple[Annotated[Watch, Meaning(name="state")], Annotated[Outputs, Meaning(name="outputs")]]:
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
