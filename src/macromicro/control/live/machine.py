"""The live machine, pure: `begin`, `accept` a request, `step` a control period, `fault`, `lose`."""

from __future__ import annotations

import math
from collections.abc import Callable

from macromicro.control import calibration
from macromicro.control.arrival import TICK
from macromicro.control.live import _homing, _moves, _programme, _steering, brake, state, survey
from macromicro.control.live import messages as m
from macromicro.control.live import transitions as t
from macromicro.control.live._effort import NONE, Efforts, rest_law
from macromicro.control.live.accept import accept
from macromicro.control.live.messages import Evidence, Notice
from macromicro.control.live.parameters import Edges, LiveParameters
from macromicro.control.live.state import LiveState, begin
from macromicro.control.live.survey import Moving, Survey
from macromicro.types import SAFE, Command, Outputs, Sample

__all__ = ["accept", "begin", "doubt", "fault", "lose", "step"]

Look = Callable[[Edges, float, Survey, Sample, Moving, float], Survey]

DISAGREE = "laser and encoder disagree"
_SPEED_TIME = 0.01  # s: time constant of the speed that the encoder shows
_LEAP = 0.1  # s: a longer step of the samples' time is no passing of time


def step(
    p: LiveParameters, s: LiveState, sample: Sample, dt: float, look: Look = survey.look
) -> tuple[LiveState, Command, Outputs, tuple[Notice, ...]]:
    """One control period; 0 V in disabled, ready, fault, and in stopped once at rest."""
    s, sample = perceive(p, s, sample, dt, look)
    if s.survey.apart >= p.settings.edges.span - TICK and _is_driven(s):
        s, notices = fault(p, s, DISAGREE, _disagreement(p, s), position_lost=True)
        return s, Command(s.drive.macro_reference, 0.0, 0.0, 0.0, s.seen.fine), SAFE, notices
    remembered = s.drive.fine
    s, efforts = _work(p, s, sample, dt)
    motor, ctrl, macro_active, micro_active, notices = efforts
    if s.drive.fine is remembered:  # the law of the micro-stage has had no turn
        s = rest_law(s, dt)
    if m.MACRO not in p.stages:  # `sequence.park` = 0 would hold a missing stage
        motor, macro_active = 0.0, 0.0
    d = s.drive
    command = Command(d.macro_reference, macro_active, d.micro_reference, micro_active, s.seen.fine)
    if s.mode == m.FAULT:
        return s, command, SAFE, notices
    reset = 0.0
    if d.reset:
        s = s._replace(drive=d._replace(reset=False), survey=survey.reset_given(s.survey))
        reset = 1.0
    # A law that gives NaN, for numbers that overflow, is the guard's to stop and to report.
    return s, command, Outputs(motor, ctrl, s.fan, reset), notices


def _work(p: LiveParameters, s: LiveState, sample: Sample, dt: float) -> tuple[LiveState, Efforts]:
    if s.work is None:  # nor is a motion under way
        return _moves.hold(s, sample, dt) if s.mode == m.HOLDING else (s, NONE)
    return _WORKS[type(s.work)](p, s, s.motion, s.work, sample, dt)


_WORKS: dict[type, Callable[..., tuple[LiveState, Efforts]]] = {
    state.Settle: _moves.fine,
    state.Approach: _moves.coarse,
    state.Jogged: _steering.step,
    state.Followed: _steering.step,
    state.Running: _programme.step,
    state.Search: _homing.step,
    state.Braking: brake.step,
}


def _time(s: LiveState, given: float, dt: float) -> tuple[float, float]:
    """Time [s] that has passed, without jumps of the samples' clock."""
    if not math.isfinite(given):
        return s.time + dt, s.shift
    time = given - s.shift
    if not math.isnan(s.seen.encoder) and not 0.0 <= time - s.time <= _LEAP:
        time = s.time + dt
        return time, given - time
    return time, s.shift


def perceive(
    p: LiveParameters, s: LiveState, sample: Sample, dt: float, look: Look
) -> tuple[LiveState, Sample]:
    """Readings, speed, standstill and position after a sample; NaN is missing."""
    if m.MACRO not in p.stages:  # nothing carries the micro-stage: it stands at 0
        sample = sample._replace(encoder=0.0)
    encoder, hall = sample.encoder, sample.hall
    time, shift = _time(s, sample.t, dt)
    if math.isinf(encoder) or math.isinf(hall):
        encoder = encoder if math.isfinite(encoder) else math.nan
        hall = hall if math.isfinite(hall) else math.nan
        sample = sample._replace(encoder=encoder, hall=hall)
    last, speed, standing, fine, position = s.seen
    frame = s.frame
    if not math.isnan(encoder):
        if math.isnan(last):
            frame = frame._replace(offset=encoder - frame.first)
        else:
            moved = encoder - last
            speed += (moved / dt - speed) * min(dt / _SPEED_TIME, 1.0)
            standing = standing + dt if moved == 0.0 else 0.0
        last = encoder
    if not math.isnan(hall):
        fine = calibration.position(p.calibration, hall)
    q = p.settings
    watched = survey.NOTHING
    if s.mode != m.FAULT or frame.trusted:  # else counts are not what they were
        moving = survey.Moving(fine, speed, standing, frame.offset)
        watched = look(q.edges, q.pitch, s.survey, sample, moving, dt)
    if frame.trusted and watched.half < 0.5 * q.pitch:
        position = survey.whole(watched, q.pitch, frame.offset)
    else:
        position = (last - frame.offset) * q.pitch + fine
    seen = state.Seen(last, speed, standing, fine, position)
    return state.with_sample(s, (time, shift), seen, frame, watched), sample


def _is_driven(s: LiveState) -> bool:
    """Whether the motor is active, or was just now; until then laser and Hall are not compared."""
    return s.mode in (m.HOMING, m.MOVING_MACRO, m.SETTLING) or (
        s.mode == m.STOPPED and s.motion is not None
    )


def _disagreement(p: LiveParameters, s: LiveState) -> Evidence:
    """The carriage's position by either witness [counts, homed frame]."""
    by_encoder = s.seen.encoder - s.frame.offset
    return {
        "by_laser_counts": by_encoder + s.survey.gap,
        "by_encoder_counts": by_encoder,
        "allowed_counts": p.settings.edges.lost,
        "for_s": s.survey.apart,
    }


def fault(
    p: LiveParameters, s: LiveState, words: str, evidence: Evidence, *, position_lost: bool = False
) -> tuple[LiveState, tuple[Notice, ...]]:
    """Latch a fault: all outputs off, position untrusted; the first fault stays."""
    if s.mode == m.FAULT:
        return s, ()
    lost: tuple[Notice, ...] = ()
    if s.motion is not None or position_lost:
        s, lost = t.distrust(s, f"fault: {words}")
    drive = t.idle(s.drive)._replace(reset=False)
    s = s._replace(fault=state.Trouble(state.now(s), words, evidence), fan=0.0, drive=drive)
    facts = {"words": words, **evidence}
    s, notices = t.conclude(p, s, m.FAULT, (m.FAULTED, t.FAULT), facts)
    return s, (*lost, *notices)


def doubt(p: LiveParameters, s: LiveState, words: str) -> tuple[LiveState, tuple[Notice, ...]]:
    """Note that the Hall sensor's readings are implausible, or plausible again."""
    before = state.uncertainty(p, s)
    # What was judged by readings that were none is not to be held against the encoder.
    if not words and (s.survey.apart > 0.0 or not state.by_laser(p, s)):
        s = s._replace(survey=survey.NOTHING)
    s = s._replace(doubt=words)
    known = math.isfinite(state.uncertainty(p, s))
    if known == math.isfinite(before):
        return s, ()
    return s, (t.report(s, "trust", words or "the Hall sensor is back", {"trusted": known}),)


def lose(s: LiveState, words: str) -> tuple[LiveState, tuple[Notice, ...]]:
    """Note that counts may have been missed: the position is no longer trusted."""
    return t.distrust(s, words)
