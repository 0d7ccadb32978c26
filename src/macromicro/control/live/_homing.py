"""Homing without a switch: touch the lower end stop twice, back off, set the position."""

from __future__ import annotations

import math

from macromicro.control import arrival
from macromicro.control.arrival import TICK
from macromicro.control.live import brake, survey
from macromicro.control.live import messages as m
from macromicro.control.live import transitions as t
from macromicro.control.live._effort import Efforts, limit_effort, macro_effort, without_effort
from macromicro.control.live.messages import Notice
from macromicro.control.live.parameters import Homing, LiveParameters
from macromicro.control.live.state import (
    NAN,
    NOWHERE,
    REST,
    LiveState,
    Motion,
    Search,
)
from macromicro.types import Sample

SEARCH, PUSH, BACK = range(3)
GIVE = 20.0  # counts that a stop's rubber may give under the push
DITHER = 1.0  # count that a carriage which stands may show beside its own
AGAIN = 2.0 * GIVE  # counts to back off before it is felt for again
OVER = 1.4  # of the requested speed, with which a carriage that had stuck may catch up


def start(p: LiveParameters, s: LiveState, motion: Motion) -> tuple[LiveState, tuple[Notice, ...]]:
    trust = t.report(s, "trust", "homing", {"trusted": False})
    drive = t.idle(s.drive)._replace(macro_reference=s.seen.encoder)
    q = p.settings.homing
    expected = s.frame.offset + q.coordinate - q.back_off if s.frame.named else NAN
    s = s._replace(
        motion=motion,
        work=Search(SEARCH, s.time, s.seen.encoder, NAN, expected=expected),
        drive=drive,
        frame=s.frame._replace(trusted=False),
        target=NOWHERE,
        survey=survey.again(s.survey, p.settings.pitch),
    )
    s, event = t.go(s, m.HOMING, t.HOME, {})
    return s, (trust, event)


def step(
    p: LiveParameters, s: LiveState, motion: Motion, work: Search, sample: Sample, dt: float
) -> tuple[LiveState, Efforts]:
    q = p.settings.homing
    patience = q.patience + (s.laws.sequence.patience if work.phase == BACK else 0.0)
    if s.time - motion.began >= patience - TICK:
        return without_effort(brake.start(p, s, m.STALLED, t.STALLED))
    if math.isnan(sample.encoder):
        return s, Efforts(macro_active=1.0)
    if work.phase == SEARCH:
        return _search(q, s, work, sample, dt)
    if work.phase == PUSH:
        return _push(p, s, work, sample)
    return _back(p, s, work, sample, dt)


def _slow(q: Homing, s: LiveState, motor: float, pace: float = 0.0) -> float:
    """Limit the effort and the speed [count/s] of homing."""
    return 0.0 if abs(s.seen.speed) > max(q.fastest, OVER * pace) else limit_effort(motor, q.volts)


def pace(q: Homing, above: float) -> float:
    """Speed of the search [counts/s] at `above` counts over the expected stop."""
    if above > q.near:
        return max(q.quick, q.speed)
    return q.speed if above >= -GIVE else max(q.approach, q.speed)


def _search(
    q: Homing, s: LiveState, work: Search, sample: Sample, dt: float
) -> tuple[LiveState, Efforts]:
    speed = pace(q, sample.encoder - work.expected)
    if speed < work.pace:  # neither a reference far ahead nor the law's memory drives it on
        s = s._replace(drive=s.drive._replace(macro_reference=sample.encoder, memory=REST))
    floor = sample.encoder - q.lead
    reference = max(s.drive.macro_reference - speed * dt, floor)
    drive, motor = macro_effort(s, sample.encoder, reference, dt)
    work = _watch_progress(work._replace(pace=speed), s.time, sample.encoder)
    if _stands(s, work) >= q.stand - TICK:
        work = work._replace(phase=PUSH, since=s.time, origin=sample.encoder)
    return s._replace(drive=drive, work=work), Efforts(_slow(q, s, motor, speed), 0.0, 1.0)


def _watch_progress(work: Search, now: float, here: float) -> Search:
    """Since when the carriage gets no farther down, ignoring one count of dither."""
    if work.lowest <= here <= work.lowest + DITHER:
        return work
    return work._replace(lowest=here, rested=now)


def _stands(s: LiveState, work: Search) -> float:
    return min(max(s.seen.standing, s.time - work.rested), s.time - work.since)


def _push(
    p: LiveParameters, s: LiveState, work: Search, sample: Sample
) -> tuple[LiveState, Efforts]:
    q = p.settings.homing
    if abs(sample.encoder - work.origin) > GIVE:  # it had only stuck
        drive = s.drive._replace(macro_reference=sample.encoder, memory=REST)
        work = work._replace(phase=SEARCH, since=s.time, origin=NAN)
        return s._replace(work=work, drive=drive), Efforts(0.0, 0.0, 1.0)
    work = _watch_progress(work, s.time, sample.encoder)
    s = s._replace(work=work)
    if _stands(s, work) < q.stand - TICK:
        return s, Efforts(_slow(q, s, -q.volts), 0.0, 1.0)
    drive = s.drive._replace(macro_reference=sample.encoder, memory=REST)
    sure = abs(sample.encoder - work.stop) <= GIVE  # never, the first time: no stop is known
    cause = "end stop confirmed" if sure else "end stop found"
    event = t.report(s, "move", cause, {"stop_raw_counts": sample.encoder})
    felt = Search(BACK, NAN, NAN, sample.encoder, sure, expected=sample.encoder)
    s = s._replace(work=felt, drive=drive)
    return s, Efforts(0.0, 0.0, 1.0, 0.0, (event,))


def _back(
    p: LiveParameters, s: LiveState, work: Search, sample: Sample, dt: float
) -> tuple[LiveState, Efforts]:
    """Back off; `since` is the time since which it is within the tolerance, or NaN."""
    q, sequence = p.settings.homing, s.laws.sequence
    goal = work.stop + (q.back_off if work.sure else AGAIN)
    reference = min(s.drive.macro_reference + q.speed * dt, goal, sample.encoder + q.lead)
    if not work.sure and sample.encoder >= goal - sequence.tolerance:
        drive = s.drive._replace(macro_reference=sample.encoder, memory=REST)
        s = s._replace(work=work._replace(phase=SEARCH, since=s.time, origin=NAN), drive=drive)
        return s, Efforts(0.0, 0.0, 1.0)
    since = arrival.since(sequence, goal - sample.encoder, work.since, s.time)
    # Not while the stop is not sure, which has turned back above.
    if arrival.arrived(sequence, since, s.time):
        return without_effort(t.homed(p, s, goal - q.coordinate, work.stop))
    drive, motor = macro_effort(s, sample.encoder, reference, dt)
    s = s._replace(drive=drive, work=work._replace(since=since))
    return s, Efforts(_slow(q, s, motor), 0.0, 1.0)
