"""Brings the macro-stage to rest: a set point decelerates from the present position and speed."""

from __future__ import annotations

import math

from macromicro.control.arrival import TICK
from macromicro.control.live import messages as m
from macromicro.control.live._effort import Efforts, macro_effort, without_effort
from macromicro.control.live.messages import Evidence, Notice
from macromicro.control.live.parameters import LiveParameters
from macromicro.control.live.state import (
    NAN,
    NOWHERE,
    REST,
    Approach,
    Braking,
    LiveState,
    Motion,
    Running,
)
from macromicro.control.live.transitions import finish, go
from macromicro.types import Sample


def distance(p: LiveParameters, speed: float) -> float:
    """Braking distance (counts): speed^2 / (2 deceleration) + margin; `speed` in counts/s."""
    q = p.settings.brake
    return speed * speed * p.settings.pitch / (2.0 * q.deceleration) + q.margin


def start(
    p: LiveParameters, s: LiveState, outcome: str, cause: str, found: Evidence | None = None
) -> tuple[LiveState, tuple[Notice, ...]]:
    q = p.settings.brake
    speed = min(max(s.seen.speed, -q.fastest), q.fastest)
    allowed = distance(p, speed)
    until = s.time + abs(speed) * p.settings.pitch / q.deceleration + q.patience
    goal = s.drive.macro_reference if isinstance(s.work, Approach | Running) else NAN
    here = s.seen.encoder
    work = Braking(s.time, until, speed, outcome, cause, here, allowed, found or {}, goal)
    drive = s.drive._replace(
        macro_reference=s.seen.encoder, micro_reference=0.0, memory=REST, integral=0.0
    )
    evidence = {"speed_counts_per_s": speed, "allowed_counts": allowed}
    s, event = go(s._replace(work=work, drive=drive, target=NOWHERE), m.STOPPED, cause, evidence)
    return s, (event,)


def step(
    p: LiveParameters, s: LiveState, motion: Motion, work: Braking, sample: Sample, dt: float
) -> tuple[LiveState, Efforts]:
    if work.speed != 0.0:
        return _slow_down(p, s, work, sample, dt)
    late = s.time >= work.until - TICK
    if not late and (math.isnan(sample.encoder) or s.seen.standing < p.settings.brake.rest - TICK):
        return s, Efforts()
    rested = s.seen.standing >= p.settings.brake.rest - TICK
    return without_effort(end(p, s, work, rested, allowed_counts=work.allowed))


def end(
    p: LiveParameters, s: LiveState, work: Braking, rested: bool, **more: float
) -> tuple[LiveState, tuple[Notice, ...]]:
    """The end of a motion that has been braked, or that did not come to rest."""
    way = s.seen.encoder - work.origin
    evidence: Evidence = {"way_counts": way, **more, "cause": work.cause, **work.found}
    if not rested:
        evidence["rest"] = "did not come to rest in time"
    return finish(p, s, work.outcome if rested else m.STALLED, evidence)


def _slow_down(
    p: LiveParameters, s: LiveState, work: Braking, sample: Sample, dt: float
) -> tuple[LiveState, Efforts]:
    less = p.settings.brake.deceleration / p.settings.pitch * dt
    left = abs(work.speed) - less
    # A carriage that stands has nothing left to brake.
    stands = s.seen.standing >= p.settings.brake.rest
    speed = 0.0 if left < less or stands else math.copysign(left, work.speed)
    reference = s.drive.macro_reference + speed * dt
    ahead = work.goal - work.origin
    if ahead * work.speed > 0.0:  # what was near its target does not continue beyond it
        reference = work.origin + math.copysign(
            min(abs(reference - work.origin), abs(ahead)), work.speed
        )
    q = s.limits
    if s.frame.trusted:
        low, high = q.macro_low + s.frame.offset, q.macro_high + s.frame.offset
        reference = min(max(reference, min(low, work.origin)), max(high, work.origin))
    drive, motor = macro_effort(s, sample.encoder, reference, dt)
    return s._replace(drive=drive, work=work._replace(speed=speed)), Efforts(motor, 0.0, 1.0)
