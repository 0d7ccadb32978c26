"""The two-stage machine follows streamed set points with one stage."""

from __future__ import annotations

import math

from macromicro.control import arrival
from macromicro.control.arrival import TICK
from macromicro.control.live import _moves, brake, following, tracking
from macromicro.control.live import messages as m
from macromicro.control.live import transitions as t
from macromicro.control.live._effort import (
    Efforts,
    fine_efforts,
    lead_carriage,
    limited,
    observe,
    released,
)
from macromicro.control.live.leading import REST, Aim
from macromicro.control.live.messages import Notice
from macromicro.control.live.parameters import LiveParameters
from macromicro.control.live.state import EMPTY, Followed, LiveState, Motion, Settle, driven
from macromicro.control.live.tracking import Limits
from macromicro.types import Sample

RISE = 0.02  # s in which its acceleration rises
START = 0.05  # s in which the micro-stage reaches the speed of a jog


def step(
    p: LiveParameters, s: LiveState, motion: Motion, work: Followed, sample: Sample, dt: float
) -> tuple[LiveState, Efforts]:
    coarse = s.mode == m.MOVING_MACRO
    if following.lapsed(s):
        end = brake.start if coarse else _moves.stay
        return released(end(p, s, m.LOST, t.LAPSED, following.facts(work)))
    work, goal = _led(p, s, motion, work, coarse, dt)
    follow = _macro if coarse else _micro
    return follow(p, s, work, goal, sample, dt)


def _led(
    p: LiveParameters, s: LiveState, motion: Motion, work: Followed, coarse: bool, dt: float
) -> tuple[Followed, float]:
    """The set point a period later, and where it is to rest, or NaN; m of the homed frame."""
    q = p.settings
    low, high = following.bounds(p, s, motion)
    here = (s.seen.encoder - s.frame.offset) * q.pitch if coarse else s.drive.micro_reference
    aim = REST._replace(position=here) if work.track is None else work.track.aim
    speed = q.jogging.macro if coarse else q.jogging.micro
    most = q.brake.deceleration if coarse else speed / START
    bounds = min(low, aim.position), max(high, aim.position)
    limits = Limits(speed, most, most / RISE, *bounds)
    track = tracking.start(limits, aim) if work.track is None else work.track
    target: Aim = following.target(work, s.time, low, high, aim.position)
    track, given, _ = tracking.step(limits, track, target, dt)
    rests = work.ending and given == target
    return work._replace(track=track), target.position if rests else math.nan


def _macro(
    p: LiveParameters, s: LiveState, work: Followed, goal: float, sample: Sample, dt: float
) -> tuple[LiveState, Efforts]:
    q = p.settings
    reference = work.track.aim.position / q.pitch + s.frame.offset
    carriage = lead_carriage(p, s, sample.encoder, reference, dt)
    if not math.isnan(sample.encoder):
        stuck = carriage.stuck and not arrival.within(s.laws.sequence, carriage.ahead)
        work = work._replace(held_back=work.held_back + dt if stuck else 0.0)
    if work.held_back >= q.jogging.patience - TICK:
        return released(brake.start(p, s, m.STALLED, t.STALLED, following.facts(work)))
    if not math.isnan(goal):
        error = goal / q.pitch + s.frame.offset - sample.encoder
        inside = arrival.since(s.laws.sequence, error, work.settle.base, s.time)
        entered = s.time if math.isnan(work.settle.entered) else work.settle.entered
        work = work._replace(settle=Settle(entered, inside, EMPTY))
        found = {"error_counts": error, **following.facts(work)}
        if arrival.arrived(s.laws.sequence, inside, s.time):
            s, event = t.go(s, m.SETTLING, t.ARRIVED, found)
            s, notices = t.conclude(p, s, m.READY, (m.DONE, t.SETTLED), found)
            return s, Efforts(notices=(event, *notices))
        if s.time - entered >= s.laws.sequence.patience - TICK:
            s, notices = brake.start(p, s, m.STALLED, t.STALLED, found)
            return s, Efforts(notices=notices)
    return driven(s, carriage.drive, work), Efforts(carriage.motor, 0.0, 1.0)


def _micro(
    p: LiveParameters, s: LiveState, work: Followed, goal: float, sample: Sample, dt: float
) -> tuple[LiveState, Efforts]:
    q = p.settings
    reference = work.track.aim.position
    if not math.isnan(sample.hall):
        lead = q.jogging.micro_lead
        reference = s.seen.fine + limited(reference - s.seen.fine, lead)
    s, efforts = fine_efforts(s, sample, reference, dt)
    notices: tuple[Notice, ...] = ()
    if not math.isnan(goal):
        entered = s.time if math.isnan(work.settle.entered) else work.settle.entered
        window = observe(q.fine, work.settle.window, sample.hall, goal - s.seen.fine, dt)
        work = work._replace(settle=Settle(entered, s.seen.encoder, window))
        found = {"error_mm": window.mean * 1e3, **following.facts(work)}
        if window.held >= q.fine.dwell - TICK:
            s, notices = t.conclude(p, s, m.HOLDING, (m.DONE, t.ON_TARGET), found)
            return s, efforts._replace(notices=notices)
        if s.time - entered >= q.fine.patience - TICK:
            s, notices = t.conclude(p, s, m.STOPPED, (m.STALLED, t.STALLED), found)
            return s, Efforts(notices=notices)
    return driven(s, s.drive, work), efforts
