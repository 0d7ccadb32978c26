"""The guard: nothing illegal passes, and a rig that does not answer is switched off.

It sees what a real rig shows - samples, the controller's command, the outputs - and
never the state of a simulated one. A fault latches: all outputs stay safe.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.control import calibration
from macromicro.control.calibration import Calibration
from macromicro.kernel import kernel
from macromicro.models import electrothermal
from macromicro.models.electrothermal import Heating
from macromicro.parameters import Par
from macromicro.types import Command, Outputs, Sample

(
    OK, ILLEGAL, MACRO_LOST, MICRO_LOST, ENCODER_SILENT, HALL_SILENT, HALL_FROZEN, HALL_RANGE,
    STUCK, TOO_HOT, NO_MOTION,
) = range(11)


class Limits(NamedTuple):
    """Limits of the guard. Defaults leave room for the thesis' worst controller."""

    motor: Annotated[float, Par("V", "largest motor output", "Section 3.1", positive=True, hi=5.0)] = 5.0
    ctrl: Annotated[float, Par("V", "largest CTRL output", "Section 3.2.1", positive=True, hi=5.0)] = 5.0
    macro_margin: Annotated[
        float, Par("count", "following error allowed above that at the move's start", lo=1.0)
    ] = 60.0
    macro_grace: Annotated[float, Par("s", "time before the macro error must fall", lo=0.0)] = 0.5
    macro_rate: Annotated[
        float, Par("count/s", "slowest approach that is accepted", positive=True)
    ] = 500.0
    macro_tolerance: Annotated[
        float, Par("count", "following error always allowed (the PID overshoots by 100)", lo=1.0)
    ] = 150.0
    micro_margin: Annotated[
        float, Par("m", "following error allowed above that at the step", shown="mm", positive=True)
    ] = 0.3e-3
    micro_grace: Annotated[float, Par("s", "time before the micro error must fall", lo=0.0)] = 1.5
    micro_rate: Annotated[
        float, Par("m/s", "slowest approach that is accepted", shown="mm/s", positive=True)
    ] = 0.5e-3
    micro_tolerance: Annotated[
        float, Par("m", "following error always allowed", shown="mm", positive=True)
    ] = 0.25e-3
    silent: Annotated[float, Par("s", "longest time without a new value of a sensor", positive=True)] = 0.005
    frozen: Annotated[
        float, Par("s", "longest time of one and the same Hall code (noise moves it)", positive=True)
    ] = 0.5
    rail: Annotated[
        float, Par("V", "Hall readings closer than this to 0 or 5 V are off the scale", shown="mV", lo=0.0)
    ] = 0.01
    rail_time: Annotated[float, Par("s", "longest time off the scale", positive=True)] = 0.1
    push: Annotated[
        float, Par("V", "motor voltage at which the carriage must move", "above M1", positive=True)
    ] = 3.6
    stuck: Annotated[float, Par("s", "longest push without a count", positive=True)] = 0.25
    hottest: Annotated[
        float, Par("degC", "highest temperature estimated from CTRL", "above S6", positive=True)
    ] = 170.0
    ceiling: Annotated[
        float, Par("K", "heating at which the driver is assumed to level off", positive=True)
    ] = 250.0
    warm: Annotated[
        float, Par("degC", "estimated temperature at which the wires must contract", positive=True)
    ] = 120.0
    motion: Annotated[
        float, Par("m", "contraction that counts as motion", shown="um", positive=True)
    ] = 50e-6
    idle: Annotated[float, Par("s", "longest heating above that without motion", positive=True)] = 0.5


class Guard(NamedTuple):
    """Runtime parameters: the limits in the units of samples and commands."""

    limits: Limits
    calibration: Calibration


class Watch(NamedTuple):
    """State. `fault` code with its evidence; envelopes [counts], [mm]; timers [s]."""

    fault: int
    value: float
    limit: float
    time: float
    macro_reference: float
    macro_envelope: float
    macro_timer: float
    micro_reference: float
    micro_envelope: float
    micro_timer: float
    encoder: float
    encoder_age: float
    hall: float
    hall_age: float
    same: float
    railed: float
    pushed: float
    heating: Heating
    anchor: float
    idle: float


def fresh() -> Watch:
    """Nothing seen yet, all well, actuator cold."""
    nan = math.nan
    return Watch(
        OK, 0.0, 0.0, 0.0, nan, 0.0, 0.0, nan, 0.0, 0.0, nan, 0.0, nan, 0.0, 0.0, 0.0, 0.0,
        Heating(0.0, 0.0, 0.0), nan, 0.0,
    )


@kernel
def temperature(s: Watch) -> float:
    """Wire temperature [degC] estimated from CTRL alone: (5.6)-(5.8) above 25 degC."""
    return 25.0 + electrothermal.temperature(s.heating)


@kernel
def _legal(p: Limits, out: Outputs) -> bool:
    """Are all outputs finite and within range? (NaN fails every comparison.)"""
    return (
        abs(out.motor) <= p.motor
        and 0.0 <= out.ctrl <= p.ctrl
        and (out.fan == 0.0 or out.fan == 1.0)
        and (out.laser_reset == 0.0 or out.laser_reset == 1.0)
    )


@kernel
def _envelope(
    reference: float, before: float, envelope: float, timer: float, error: float,
    margin: float, tolerance: float, fall: float, grace: float, dt: float,
) -> tuple[float, float]:
    """Allowed error and time since the last new reference.

    A new reference opens the envelope to the present error plus `margin`; after `grace`
    it closes at the slowest accepted approach, `fall` per period, down to `tolerance`.
    """
    if reference != before:
        return max(error + margin, tolerance), 0.0
    if timer >= grace:
        return max(envelope - fall, tolerance), timer
    return envelope, timer + dt


@kernel
def step(
    p: Guard, s: Watch, sample: Sample, command: Command, out: Outputs, dt: float
) -> tuple[Watch, Outputs]:
    """One control period: the guard's new state and the outputs that may be written."""
    q = p.limits
    fault, value, limit, time = s.fault, s.value, s.limit, s.time
    legal = _legal(q, out)
    if fault == OK and not legal:
        fault, value, limit = ILLEGAL, out.motor, q.motor
        if abs(out.motor) <= q.motor:
            value, limit = out.ctrl, q.ctrl

    # silent and frozen sensors
    encoder, encoder_age = s.encoder, s.encoder_age
    if math.isnan(sample.encoder):
        encoder_age = encoder_age + dt
    else:
        encoder, encoder_age = sample.encoder, 0.0
    hall, hall_age, same = s.hall, s.hall_age, s.same
    if math.isnan(sample.hall):
        hall_age = hall_age + dt
    else:
        same = same + dt if sample.hall == s.hall else 0.0
        hall, hall_age = sample.hall, 0.0
    if fault == OK and encoder_age > q.silent:
        fault, value, limit = ENCODER_SILENT, encoder_age, q.silent
    if fault == OK and hall_age > q.silent:
        fault, value, limit = HALL_SILENT, hall_age, q.silent
    if fault == OK and same > q.frozen:
        fault, value, limit = HALL_FROZEN, same, q.frozen
    railed = s.railed + dt if hall < q.rail or hall > 5.0 - q.rail else 0.0
    if fault == OK and railed > q.rail_time:
        fault, value, limit = HALL_RANGE, hall, q.rail

    # following errors against a predicted envelope
    error = abs(command.macro_reference - encoder)
    macro_reference, macro_envelope, macro_timer = math.nan, 0.0, 0.0
    if command.macro_active > 0.5:
        macro_reference = command.macro_reference
        macro_envelope, macro_timer = _envelope(
            macro_reference, s.macro_reference, s.macro_envelope, s.macro_timer, error,
            q.macro_margin, q.macro_tolerance, q.macro_rate * dt, q.macro_grace, dt,
        )
        if fault == OK and error > macro_envelope:
            fault, value, limit = MACRO_LOST, error, macro_envelope
    place = calibration.position(p.calibration, hall)
    error = abs(command.micro_reference - place)
    micro_reference, micro_envelope, micro_timer = math.nan, 0.0, 0.0
    if command.micro_active > 0.5:
        micro_reference = command.micro_reference
        micro_envelope, micro_timer = _envelope(
            micro_reference, s.micro_reference, s.micro_envelope, s.micro_timer, error,
            1e3 * q.micro_margin, 1e3 * q.micro_tolerance, 1e3 * q.micro_rate * dt,
            q.micro_grace, dt,
        )
        if fault == OK and error > micro_envelope:
            fault, value, limit = MICRO_LOST, error, micro_envelope

    # pushing without a count
    pushed = s.pushed + dt if legal and abs(out.motor) >= q.push and encoder == s.encoder else 0.0
    if fault == OK and pushed > q.stuck:
        fault, value, limit = STUCK, abs(out.motor), pushed

    # temperature from CTRL alone; heat without motion
    heating = electrothermal.step(
        s.heating, electrothermal.gain(out.ctrl if legal and fault == OK else 0.0, q.ceiling), dt
    )
    estimate = 25.0 + electrothermal.temperature(heating)
    if fault == OK and estimate > q.hottest:
        fault, value, limit = TOO_HOT, estimate, q.hottest
    anchor, idle = s.anchor, 0.0
    if estimate > q.warm and command.micro_active > 0.5:
        wanted = abs(command.micro_reference - place) > 1e3 * q.motion
        moved = math.isnan(anchor) or abs(place - anchor) > 1e3 * q.motion
        idle = s.idle + dt if wanted and not moved else 0.0
        if moved:
            anchor = place
        if fault == OK and idle > q.idle:
            fault, value, limit = NO_MOTION, estimate, idle
    else:
        anchor = place

    if fault != OK and s.fault == OK:
        time = sample.t
    watch = Watch(
        fault, value, limit, time, macro_reference, macro_envelope, macro_timer,
        micro_reference, micro_envelope, micro_timer, encoder, encoder_age, hall, hall_age, same,
        railed, pushed, heating, anchor, idle,
    )
    if fault != OK:
        return watch, Outputs(0.0, 0.0, 0.0, 0.0)
    return watch, out
