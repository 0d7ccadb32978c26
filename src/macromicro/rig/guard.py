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
from macromicro.rig import envelope
from macromicro.rig.envelope import Bounds, Envelope
from macromicro.rig.limits import Limits
from macromicro.types import Command, Outputs, Sample

(
    OK,
    ILLEGAL,
    MACRO_LOST,
    MICRO_LOST,
    ENCODER_SILENT,
    HALL_SILENT,
    HALL_FROZEN,
    HALL_RANGE,
    STUCK,
    TOO_HOT,
    NO_MOTION,
    ENCODER_JUMP,
    ENCODER_AGAINST,
    HALL_NOISY,
    CLOCK,
) = range(15)

HALL_SUPPLY = 5.0
ROOM = 25.0


class Guard(NamedTuple):
    """Runtime parameters: the limits, and the envelopes in counts and mm."""

    limits: Limits
    macro: Bounds
    micro: Bounds
    calibration: Calibration


class Seen(NamedTuple):
    """Last good readings and how long each is amiss [s]: age without a new value, time
    of one and the same Hall code, time off the scale, time pushed without a count, hard or
    so that it should just move. `against`: counts against pushes of one sign, signed as they
    are; `jump` [counts] and what was possible; `before`: the Hall reading before the last [V];
    `noise`: its mean square [V^2]; `time` and its last step [s]."""

    encoder: float
    encoder_age: float
    hall: float
    hall_age: float
    same: float
    railed: float
    pushed: float
    leant: float
    against: float
    jump: float
    possible: float
    before: float
    noise: float
    time: float
    passed: float


class Heat(NamedTuple):
    """Estimated heating, where the stage last moved to [mm], time heated idly since [s]."""

    heating: Heating
    anchor: float
    idle: float


class Watch(NamedTuple):
    """State. `fault` code, with what was measured, its limit and the time [s] of it."""

    fault: int
    value: float
    limit: float
    time: float
    seen: Seen
    macro: Envelope
    micro: Envelope
    heat: Heat


def prepare(limits: Limits, table: Calibration) -> Guard:
    """Runtime parameters of the guard."""
    return Guard(
        limits,
        Bounds(limits.macro_margin, limits.macro_tolerance, limits.macro_rate, limits.macro_grace),
        Bounds(
            1e3 * limits.micro_margin,
            1e3 * limits.micro_tolerance,
            1e3 * limits.micro_rate,
            limits.micro_grace,
        ),
        table,
    )


def fresh() -> Watch:
    """Nothing seen yet, all well, actuator cold."""
    nan = math.nan
    return Watch(
        OK,
        0.0,
        0.0,
        0.0,
        Seen(nan, 0.0, nan, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, nan, 0.0, nan, 0.0),
        envelope.closed(),
        envelope.closed(),
        Heat(Heating(0.0, 0.0, 0.0), nan, 0.0),
    )


@kernel
def temperature(s: Watch) -> float:
    """Wire temperature [degC] estimated from CTRL alone: (5.6)-(5.8) above room temperature."""
    return ROOM + electrothermal.temperature(s.heat.heating)


@kernel
def legal(p: Limits, out: Outputs) -> bool:
    """Are all outputs finite and within range? (NaN fails every comparison.)"""
    return (
        abs(out.motor) <= p.motor
        and 0.0 <= out.ctrl <= p.ctrl
        and out.fan * (1.0 - out.fan) == 0.0
        and out.laser_reset * (1.0 - out.laser_reset) == 0.0
    )


@kernel
def _against(p: Limits, before: float, moved: float, effort: float) -> float:
    """Counts against pushes of one sign; none once the carriage goes along with one."""
    if effort >= p.lean:
        return max(before, 0.0) - moved if moved <= 0.0 else 0.0
    if effort <= -p.lean:
        return min(before, 0.0) - moved if moved >= 0.0 else 0.0
    return before


@kernel
def _noise(p: Limits, s: Seen, hall: float, dt: float) -> float:
    """Mean square of the Hall noise [V^2], by second differences: motion has next to none.

    One spike alone counts for less than the limit.
    """
    second = hall - 2.0 * s.hall + s.before
    if math.isnan(second):
        return s.noise
    most = 4.0 * p.noise
    square = min(second * second / 6.0, most * most)
    return s.noise + (square - s.noise) * min(dt / p.noise_time, 1.0)


@kernel
def _look(p: Limits, s: Seen, sample: Sample, effort: float, dt: float) -> Seen:
    """Readings and ages after this sample; `effort` [V] is the motor output asked for."""
    push = abs(effort)
    passed = sample.t - s.time
    if math.isnan(passed):  # the first one, or a rig that gave no time
        passed = dt
    time = s.time + dt if math.isnan(sample.t) else sample.t
    encoder, encoder_age, pushed, leant = sample.encoder, 0.0, 0.0, 0.0
    if math.isnan(encoder):
        encoder, encoder_age = s.encoder, s.encoder_age + dt
    moved = encoder - s.encoder
    if math.isnan(moved):
        moved = 0.0
    if push >= p.push and encoder == s.encoder:
        pushed = s.pushed + dt
    if push >= p.lean and encoder == s.encoder:
        leant = s.leant + dt
    against = _against(p, s.against, moved, effort)
    possible = p.fastest * (s.encoder_age + max(passed, dt))
    hall, hall_age, same, railed = sample.hall, 0.0, 0.0, 0.0
    before, noise = s.hall, s.noise
    if math.isnan(hall):
        hall, hall_age, same, before = s.hall, s.hall_age + dt, s.same, s.before
    else:
        noise = _noise(p, s, hall, dt)
        if hall == s.hall:
            same = s.same + dt
    if hall < p.rail or hall > HALL_SUPPLY - p.rail:
        railed = s.railed + dt
    return Seen(
        encoder,
        encoder_age,
        hall,
        hall_age,
        same,
        railed,
        pushed,
        leant,
        against,
        abs(moved),
        possible,
        before,
        noise,
        time,
        passed,
    )


@kernel
def _sensor_fault(p: Limits, s: Seen, push: float) -> tuple[int, float, float]:
    """Fault of a sensor or of the carriage: code, measured, limit."""
    if s.encoder_age > p.silent:
        return ENCODER_SILENT, s.encoder_age, p.silent
    if s.hall_age > p.silent:
        return HALL_SILENT, s.hall_age, p.silent
    if s.same > p.frozen:
        return HALL_FROZEN, s.same, p.frozen
    if s.railed > p.rail_time:
        return HALL_RANGE, s.hall, p.rail
    if s.pushed > p.stuck or s.leant > p.leant:
        return STUCK, push, max(s.pushed, s.leant)
    return _implausible(p, s)


@kernel
def _implausible(p: Limits, s: Seen) -> tuple[int, float, float]:
    """Readings that come, and that no machine could have: code, measured, limit."""
    if s.passed > p.clock or s.passed < 0.0:
        return CLOCK, s.passed, p.clock
    if s.jump > s.possible:
        return ENCODER_JUMP, s.jump, s.possible
    if abs(s.against) > p.against:
        return ENCODER_AGAINST, abs(s.against), p.against
    if s.noise > p.noise * p.noise:
        return HALL_NOISY, 1e3 * math.sqrt(s.noise), 1e3 * p.noise
    return OK, 0.0, 0.0


@kernel
def _warm(p: Limits, s: Heat, ctrl: float, wanted: bool, place: float, dt: float) -> Heat:
    """Estimated heating after `dt`, and how long the stage at `place` [mm] ignores it.

    `wanted`: a contraction is being asked for and not yet there.
    """
    heating = electrothermal.step(s.heating, electrothermal.gain(ctrl, p.ceiling), dt)
    hot = ROOM + electrothermal.temperature(heating) > p.warm
    moved = math.isnan(s.anchor) or abs(place - s.anchor) > 1e3 * p.motion
    if not hot or not wanted or moved:
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
    """One control period: the guard's new state and the outputs that may be written."""
    q = p.limits
    fine = legal(q, out)
    effort = out.motor if fine else 0.0
    seen = _look(q, s.seen, sample, effort, dt)
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
    wanted = command.micro_active > 0.5 and off > 1e3 * q.motion
    heat = _warm(q, s.heat, ctrl, wanted, place, dt)

    fault, value, limit, time = s.fault, s.value, s.limit, s.time
    if fault == OK:
        if not fine:
            fault, value, limit = ILLEGAL, out.motor, q.motor
            if abs(out.motor) <= q.motor:
                value, limit = out.ctrl, q.ctrl
        if fault == OK:
            fault, value, limit = _sensor_fault(q, seen, abs(effort))
        if fault == OK and command.macro_active > 0.5 and error > macro.allowed:
            fault, value, limit = MACRO_LOST, error, macro.allowed
        if fault == OK and command.micro_active > 0.5 and abs(off) > micro.allowed:
            fault, value, limit = MICRO_LOST, abs(off), micro.allowed
        if fault == OK:
            fault, value, limit = _heat_fault(q, heat)
        if fault != OK:
            time = sample.t
    watch = Watch(fault, value, limit, time, seen, macro, micro, heat)
    if fault != OK:
        return watch, Outputs(0.0, 0.0, 0.0, 0.0)
    return watch, out
