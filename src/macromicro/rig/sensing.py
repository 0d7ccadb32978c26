"""Plausibility of sensors and carriage."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.columns import Meaning
from macromicro.kernel import kernel
from macromicro.rig.codes import (
    CLOCK,
    CLOCK_STANDS,
    ENCODER_AGAINST,
    ENCODER_JUMP,
    ENCODER_SILENT,
    HALL_FROZEN,
    HALL_NOISY,
    HALL_RANGE,
    HALL_SILENT,
    OK,
    STUCK,
)
from macromicro.rig.limits import Limits
from macromicro.types import Sample


class Seen(NamedTuple):
    """Last good readings, and how long each is overdue or implausible."""

    encoder: Annotated[float, Meaning("", "count")]
    encoder_age: Annotated[float, Meaning("without a new value", "s")]
    hall: Annotated[float, Meaning("", "V")]
    hall_age: Annotated[float, Meaning("without a new value", "s")]
    same: Annotated[
        float, Meaning("for how long the Hall sensor has given one and the same code", "s")
    ]
    railed: Annotated[float, Meaning("for how long the Hall sensor has been off its scale", "s")]
    pushed: Annotated[float, Meaning("pushed hard without a count", "s")]
    leant: Annotated[float, Meaning("pushed so that it should just move, without a count", "s")]
    against: Annotated[
        float, Meaning("travel against pushes of one sign, signed as they are", "count")
    ]
    jump: Annotated[float, Meaning("last change of the encoder", "count")]
    possible: Annotated[float, Meaning("what was possible in that time", "count")]
    before: Annotated[float, Meaning("the Hall reading before the last", "V")]
    noise: Annotated[float, Meaning("mean square of the Hall sensor's noise", "V^2")]
    time: Annotated[float, Meaning("time of the last sample", "s")]
    passed: Annotated[float, Meaning("its last step", "s")]
    stood: Annotated[float, Meaning("without a new time", "s")]


UNSEEN = Seen(**dict.fromkeys(Seen._fields, 0.0))._replace(
    encoder=math.nan, hall=math.nan, before=math.nan, time=math.nan
)


@kernel
def expecting(s: Seen, encoder: bool, hall: bool) -> Seen:
    """The state without expecting sensors that the rig lacks."""
    return Seen(
        s.encoder, s.encoder_age if encoder else 0.0, s.hall, s.hall_age if hall else 0.0,
        s.same, s.railed, s.pushed, s.leant, s.against, s.jump, s.possible, s.before, s.noise,
        s.time, s.passed, s.stood,
    )  # fmt: skip


@kernel
def _against(p: Limits, before: float, moved: float, effort: float) -> float:
    """Counts against pushes of one sign, reset by motion along one."""
    if effort >= p.lean:
        return max(before, 0.0) - moved if moved <= 0.0 else 0.0
    if effort <= -p.lean:
        return min(before, 0.0) - moved if moved >= 0.0 else 0.0
    return before


_SPIKE = 4.0  # times the largest rms noise: one reading counts for no more


@kernel
def spike(p: Limits) -> Annotated[float, Meaning("largest step of the Hall voltage", "V")]:
    """Largest second difference of Hall readings that counts as noise."""
    return _SPIKE * math.sqrt(6.0) * p.noise


@kernel
def _noise(p: Limits, s: Seen, hall: float, dt: float) -> float:
    """Mean square of the Hall noise [V^2] by second differences, in which motion cancels."""
    second = hall - 2.0 * s.hall + s.before
    if math.isnan(second):
        return s.noise
    most = _SPIKE * p.noise
    square = min(second * second / 6.0, most * most)
    return s.noise + (square - s.noise) * min(dt / p.noise_time, 1.0)


@kernel
def look(p: Limits, s: Seen, sample: Sample, effort: float, dt: float) -> Seen:
    push = abs(effort)
    passed = sample.t - s.time
    if math.isnan(passed):  # the first one, or a rig that gave no time
        passed = dt
    stood = s.stood + dt if math.isnan(sample.t) or passed == 0.0 else 0.0
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
    if hall < p.rail or hall > p.hall_supply - p.rail:
        railed = s.railed + dt
    return Seen(
        encoder, encoder_age, hall, hall_age, same, railed, pushed, leant, against, abs(moved),
        possible, before, noise, time, passed, stood,
    )  # fmt: skip


REPEATED = 20  # times the same Hall code, which the noise of a sensor that lives forbids


# What `doubt` numbers.
DOUBTS = (
    "",
    "the Hall sensor is silent",
    "the Hall sensor is out of range",
    "the Hall sensor repeats one value",
    "the Hall sensor is noisy",
)


@kernel
def doubt(p: Limits, s: Seen, dt: float) -> int:
    """Why the Hall sensor's last reading is implausible, long before it is a fault."""
    if s.hall_age > p.silent:
        return 1
    if s.railed > p.silent:  # a slack wire that bounces may touch the end of the scale
        return 2
    if s.same > (REPEATED - 0.5) * dt:
        return 3
    return 4 if s.noise > p.noise * p.noise else 0


@kernel
def fault(
    p: Limits, s: Seen, push: float
) -> tuple[
    Annotated[int, Meaning(name="code")],
    Annotated[float, Meaning(name="value")],
    Annotated[float, Meaning(name="limit")],
]:
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
    """Implausible readings: code, measured, limit."""
    if s.passed > p.clock or s.passed < 0.0:
        return CLOCK, s.passed, p.clock
    if s.stood > p.clock:
        return CLOCK_STANDS, s.stood, p.clock
    if s.jump > s.possible:
        return ENCODER_JUMP, s.jump, s.possible
    if abs(s.against) > p.against:
        return ENCODER_AGAINST, abs(s.against), p.against
    if s.noise > p.noise * p.noise:
        return HALL_NOISY, 1e3 * math.sqrt(s.noise), 1e3 * p.noise
    return OK, 0.0, 0.0
