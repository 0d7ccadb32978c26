"""Jogs: a set point at constant speed until another request or a limit."""

from __future__ import annotations

import math

from macromicro.control import arrival
from macromicro.control.arrival import TICK
from macromicro.control.live import _moves, brake, following
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
from macromicro.control.live.messages import Notice
from macromicro.control.live.parameters import LiveParameters
from macromicro.control.live.state import EMPTY, NOWHERE, Jogged, LiveState, Motion, Settle, driven
from macromicro.types import Sample


def start_macro(
    p: LiveParameters, s: LiveState, motion: Motion, speed: float, hold: float
) -> tuple[LiveState, tuple[Notice, ...]]:
    found = {"speed_m_per_s": speed}
    here = motion._replace(coarse=s.seen.encoder)
    s, notices = _moves.start_macro(s, here, t.MACRO_JOG, found)
    settle = Settle(s.time, s.seen.encoder, EMPTY)
    work = Jogged(speed / p.settings.pitch, 0.0, 0.0, settle, hold, s.time)
    return s._replace(work=work, target=NOWHERE), notices


def start_micro(
    s: LiveState, motion: Motion, speed: float, hold: float
) -> tuple[LiveState, tuple[Notice, ...]]:
    holding = s.mode in (m.HOLDING, m.MOVING_MICRO)
    here = s.drive.micro_reference if holding else s.seen.fine
    s, notices = _moves.start_micro(
        s, motion._replace(fine=here), t.MICRO_JOG, {"speed_m_per_s": speed}
    )
    settle = Settle(s.time, s.seen.encoder, EMPTY)
    target = s.target._replace(micro=math.nan)
    work = Jogged(speed, 0.0, 0.0, settle, hold, s.time)
    return s._replace(work=work, target=target), notices


def step(
    p: LiveParameters, s: LiveState, motion: Motion, work: Jogged, sample: Sample, dt: float
) -> tuple[LiveState, Efforts]:
    coarse = s.mode == m.MOVING_MACRO
    if following.lapsed(s):
        end = brake.start if coarse else _moves.stay
        return released(end(p, s, m.LOST, t.LAPSED, following.facts(work)))
    if coarse:
        return macro(p, s, work, sample, dt)
    return micro(p, s, work, sample, dt)


def macro(
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
    speed = work.speed + limited(goal - work.speed, most * dt)
    if limit <= abs(speed) * dt:  # at the limit within this period
        reference, speed = reference + math.copysign(limit, work.goal), 0.0
        limit = 0.0
    else:
        reference += speed * dt
    carriage, held_back = lead_carriage(p, s, sample.encoder, reference, dt), work.held_back
    if not math.isnan(sample.encoder):
        held_back = held_back + dt if carriage.stuck else 0.0
    if held_back >= q.jogging.patience - TICK:
        return released(brake.start(p, s, m.STALLED, t.STALLED))
    s = driven(s, carriage.drive, work._replace(speed=speed, held_back=held_back))
    arrived = arrival.within(s.laws.sequence, carriage.reference - sample.encoder)
    if limit == 0.0 and arrived and s.seen.standing >= q.brake.rest - TICK:
        return released(brake.start(p, s, m.LIMIT, t.LIMIT))
    return s, Efforts(carriage.motor, 0.0, 1.0)


def micro(
    p: LiveParameters, s: LiveState, work: Jogged, sample: Sample, dt: float
) -> tuple[LiveState, Efforts]:
    q = p.settings
    up = work.goal > 0.0
    bound = s.limits.micro_high if up else s.limits.micro_low
    reference = s.drive.micro_reference + work.goal * dt
    if not math.isnan(sample.hall):
        reference = s.seen.fine + limited(reference - s.seen.fine, q.jogging.micro_lead)
    at_limit = reference >= bound if up else reference <= bound
    if at_limit:
        reference = bound
    s, efforts = fine_efforts(s, sample, reference, dt)
    settle = work.settle
    if not at_limit:
        settle = Settle(s.time, settle.base, EMPTY)
    window = observe(q.fine, settle.window, sample.hall, reference - s.seen.fine, dt)
    settle = Settle(settle.entered, settle.base, window, settle.witness)
    s = driven(s, s.drive, work._replace(settle=settle))
    if at_limit and window.held >= q.fine.dwell - TICK:
        found = {"micro_mm": reference * 1e3, "error_mm": window.mean * 1e3}
        s, notices = t.conclude(p, s, m.HOLDING, (m.LIMIT, t.LIMIT), found)
        return s, efforts._replace(notices=notices)
    if s.time - settle.entered >= q.fine.patience - TICK:  # since it came to its limit
        s, notices = t.conclude(
            p, s, m.STOPPED, (m.STALLED, t.STALLED), {"micro_mm": reference * 1e3}
        )
        return s, Efforts(notices=notices)
    return s, efforts
