"""The two-stage machine steered by a client: jogs, and set points that are streamed."""

from __future__ import annotations

import math

from macromicro.control import arrival
from macromicro.control.arrival import TICK
from macromicro.control.live import _moves, brake, following
from macromicro.control.live import messages as m
from macromicro.control.live import transitions as t
from macromicro.control.live._effort import (
    CarriageStep,
    Efforts,
    fine_efforts,
    lead_carriage,
    limit_effort,
    observe,
    without_effort,
)
from macromicro.control.live.leading import REST
from macromicro.control.live.messages import Notice
from macromicro.control.live.parameters import LiveParameters
from macromicro.control.live.state import (
    EMPTY,
    NOWHERE,
    Followed,
    Jogged,
    LiveState,
    Motion,
    Settle,
    with_work,
)
from macromicro.types import Sample

RISE = 0.02  # s in which the acceleration of what follows rises
START = 0.05  # s in which the micro-stage that follows reaches the speed of a jog


def start_jog(
    p: LiveParameters, s: LiveState, motion: Motion, request: m.Jog
) -> tuple[LiveState, tuple[Notice, ...]]:
    settle = Settle(s.time, s.seen.encoder, EMPTY)
    found = {"speed_m_per_s": request.speed}
    goal, holding = request.speed, s.mode in (m.HOLDING, m.MOVING_MICRO)
    if request.stage == m.MACRO:
        goal /= p.settings.pitch
        s, notices = _start_macro(s, motion, t.MACRO_JOG, found)
    else:
        here = s.drive.micro_reference if holding else s.seen.fine
        s, notices = _start_micro(s, motion, here, t.MICRO_JOG, found)
    return s._replace(work=Jogged(goal, 0.0, 0.0, settle, request.hold, s.time)), notices


def start_follow(
    s: LiveState, motion: Motion, request: m.Follow
) -> tuple[LiveState, tuple[Notice, ...]]:
    found = {"hold_s": request.hold}
    if request.stage == m.MACRO:
        s, notices = _start_macro(s, motion, t.MACRO_FOLLOW, found)
    else:
        s, notices = _start_micro(s, motion, s.seen.fine, t.MICRO_FOLLOW, found)
    return s._replace(work=Followed(float(request.hold), s.time)), notices


def _start_macro(
    s: LiveState, motion: Motion, cause: str, found: m.Evidence
) -> tuple[LiveState, tuple[Notice, ...]]:
    here = motion._replace(coarse=s.seen.encoder)
    s, notices = _moves.start_macro(s, here, cause, found)
    return s._replace(target=NOWHERE), notices


def _start_micro(
    s: LiveState, motion: Motion, here: float, cause: str, found: m.Evidence
) -> tuple[LiveState, tuple[Notice, ...]]:
    s, notices = _moves.start_micro(s, motion._replace(fine=here), cause, found)
    return s._replace(target=s.target._replace(micro=math.nan)), notices


def step(
    p: LiveParameters,
    s: LiveState,
    motion: Motion,
    work: Jogged | Followed,
    sample: Sample,
    dt: float,
) -> tuple[LiveState, Efforts]:
    coarse = s.mode == m.MOVING_MACRO
    if following.has_lapsed(s):
        end = brake.start if coarse else _moves.stay
        return without_effort(end(p, s, m.LOST, t.LAPSED, following.facts(work)))
    if isinstance(work, Jogged):
        jog = _jog_macro if coarse else _jog_micro
        return jog(p, s, work, sample, dt)
    work, goal = _lead(p, s, motion, work, coarse, dt)
    follow = _follow_macro if coarse else _follow_micro
    return follow(p, s, work, goal, sample, dt)


def _held_back(
    work: Jogged | Followed, carriage: CarriageStep, stuck: bool, sample: Sample, dt: float
) -> float:
    """For how long the carriage has held the reference back."""
    if math.isnan(sample.encoder):
        return work.held_back
    return work.held_back + dt if stuck and carriage.stuck else 0.0


def _near(p: LiveParameters, s: LiveState, sample: Sample, reference: float) -> float:
    """The micro-stage's reference, no farther ahead of it than it may be."""
    if math.isnan(sample.hall):
        return reference
    return s.seen.fine + limit_effort(reference - s.seen.fine, p.settings.jogging.micro_lead)


def _jog_macro(
    p: LiveParameters, s: LiveState, work: Jogged, sample: Sample, dt: float
) -> tuple[LiveState, Efforts]:
    q, pitch = p.settings, p.settings.pitch
    most = q.brake.deceleration / pitch
    goal, reference = work.goal, s.drive.macro_reference
    limit = math.inf
    if s.frame.trusted:
        bound = s.limits.macro_high if goal > 0.0 else s.limits.macro_low
        limit = max(math.copysign(1.0, goal) * (bound + s.frame.offset - reference), 0.0)
        goal = math.copysign(min(abs(goal), math.sqrt(2.0 * most * limit)), goal)
    speed = work.speed + limit_effort(goal - work.speed, most * dt)
    if limit <= abs(speed) * dt:  # at the limit within this period
        reference, speed = reference + math.copysign(limit, work.goal), 0.0
        limit = 0.0
    else:
        reference += speed * dt
    carriage = lead_carriage(p, s, sample.encoder, reference, dt)
    held_back = _held_back(work, carriage, True, sample, dt)
    if held_back >= q.jogging.patience - TICK:
        return without_effort(brake.start(p, s, m.STALLED, t.STALLED))
    s = with_work(s, carriage.drive, work._replace(speed=speed, held_back=held_back))
    arrived = arrival.within(s.laws.sequence, carriage.reference - sample.encoder)
    if limit == 0.0 and arrived and s.seen.standing >= q.brake.rest - TICK:
        return without_effort(brake.start(p, s, m.LIMIT, t.LIMIT))
    return s, Efforts(carriage.motor, 0.0, 1.0)


def _jog_micro(
    p: LiveParameters, s: LiveState, work: Jogged, sample: Sample, dt: float
) -> tuple[LiveState, Efforts]:
    q = p.settings
    up = work.goal > 0.0
    bound = s.limits.micro_high if up else s.limits.micro_low
    reference = _near(p, s, sample, s.drive.micro_reference + work.goal * dt)
    at_limit = reference >= bound if up else reference <= bound
    if at_limit:
        reference = bound
    s, efforts = fine_efforts(s, sample, reference, dt)
    settle = work.settle
    if not at_limit:
        settle = Settle(s.time, settle.base, EMPTY)
    window = observe(q.fine, settle.window, sample.hall, reference - s.seen.fine, dt)
    settle = Settle(settle.entered, settle.base, window, settle.witness)
    s = with_work(s, s.drive, work._replace(settle=settle))
    if at_limit and window.held >= q.fine.dwell - TICK:
        found = {"micro_mm": reference * 1e3, "error_mm": window.mean * 1e3}
        s, notices = t.conclude(p, s, m.HOLDING, (m.LIMIT, t.LIMIT), found)
        return s, efforts._replace(notices=notices)
    if s.time - settle.entered >= q.fine.patience - TICK:  # since it came to its limit
        facts = {"micro_mm": reference * 1e3}
        return without_effort(t.conclude(p, s, m.STOPPED, (m.STALLED, t.STALLED), facts))
    return s, efforts


def _lead(
    p: LiveParameters, s: LiveState, motion: Motion, work: Followed, coarse: bool, dt: float
) -> tuple[Followed, float]:
    """The set point a period later, and where it is to rest, or NaN; m of the homed frame."""
    q = p.settings
    here = (s.seen.encoder - s.frame.offset) * q.pitch if coarse else s.drive.micro_reference
    aim = REST._replace(position=here) if work.track is None else work.track.aim
    speed = q.jogging.macro if coarse else q.jogging.micro
    most = q.brake.deceleration if coarse else speed / START
    rates, ends = (speed, most, most / RISE), following.bounds(p, s, motion)
    work, target, given, _ = following.led(work, rates, ends, aim, s.time, dt)
    return work, target.position if work.ending and given == target else math.nan


def _follow_macro(
    p: LiveParameters, s: LiveState, work: Followed, goal: float, sample: Sample, dt: float
) -> tuple[LiveState, Efforts]:
    q = p.settings
    reference = work.track.aim.position / q.pitch + s.frame.offset
    carriage = lead_carriage(p, s, sample.encoder, reference, dt)
    apart = not arrival.within(s.laws.sequence, carriage.ahead)
    work = work._replace(held_back=_held_back(work, carriage, apart, sample, dt))
    if work.held_back >= q.jogging.patience - TICK:
        return without_effort(brake.start(p, s, m.STALLED, t.STALLED, following.facts(work)))
    if not math.isnan(goal):
        error = goal / q.pitch + s.frame.offset - sample.encoder
        inside = arrival.since(s.laws.sequence, error, work.settle.base, s.time)
        entered = s.time if math.isnan(work.settle.entered) else work.settle.entered
        work = work._replace(settle=Settle(entered, inside, EMPTY))
        found = {"error_counts": error, **following.facts(work)}
        if arrival.arrived(s.laws.sequence, inside, s.time):
            return without_effort(t.arrived(p, s, found))
        if s.time - entered >= s.laws.sequence.patience - TICK:
            return without_effort(brake.start(p, s, m.STALLED, t.STALLED, found))
    return with_work(s, carriage.drive, work), Efforts(carriage.motor, 0.0, 1.0)


def _follow_micro(
    p: LiveParameters, s: LiveState, work: Followed, goal: float, sample: Sample, dt: float
) -> tuple[LiveState, Efforts]:
    q = p.settings
    s, efforts = fine_efforts(s, sample, _near(p, s, sample, work.track.aim.position), dt)
    if not math.isnan(goal):
        entered = s.time if math.isnan(work.settle.entered) else work.settle.entered
        window = observe(q.fine, work.settle.window, sample.hall, goal - s.seen.fine, dt)
        work = work._replace(settle=Settle(entered, s.seen.encoder, window))
        found = {"error_mm": window.mean * 1e3, **following.facts(work)}
        if window.held >= q.fine.dwell - TICK:
            s, notices = t.conclude(p, s, m.HOLDING, (m.DONE, t.ON_TARGET), found)
            return s, efforts._replace(notices=notices)
        if s.time - entered >= q.fine.patience - TICK:
            return without_effort(t.conclude(p, s, m.STOPPED, (m.STALLED, t.STALLED), found))
    return with_work(s, s.drive, work), efforts
