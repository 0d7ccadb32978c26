"""A programme: the supervisor's schedule and laws, reported as modes and events of the machine."""

from __future__ import annotations

import math
from typing import Any

from macromicro.control import arrival, supervisor
from macromicro.control.arrival import TICK
from macromicro.control.live import brake, following
from macromicro.control.live import messages as m
from macromicro.control.live import transitions as t
from macromicro.control.live._effort import Efforts, fine_efforts, observe, without_effort
from macromicro.control.live.messages import Evidence, Notice
from macromicro.control.live.parameters import LiveParameters
from macromicro.control.live.state import (
    EMPTY,
    NAN,
    NOWHERE,
    Drive,
    LiveState,
    Motion,
    Running,
    with_work,
)
from macromicro.control.supervisor import DONE, MACRO, MICRO, SETTLING, Plan, Progress
from macromicro.programme import moves
from macromicro.types import Sample

MODES = {MACRO: m.MOVING_MACRO, SETTLING: m.SETTLING, MICRO: m.MOVING_MICRO}


def start(s: LiveState, motion: Motion, plan: Plan) -> tuple[LiveState, tuple[Notice, ...]]:
    """Begin; macro targets become raw counts."""
    raw = _raw(plan, s.frame.offset)
    progress = supervisor.begin(s.seen.encoder, s.laws)._replace(fine=s.drive.fine)
    drive = t.idle(s.drive)._replace(macro_reference=s.seen.encoder)
    work = Running(raw, progress, s.time, EMPTY, NAN, None)
    s = s._replace(motion=motion, work=work, drive=drive, target=NOWHERE)
    s, event = t.go(s, m.MOVING_MACRO, t.PROGRAMME, {"moves": len(plan.stage)})
    return s, (event,)


def _raw(plan: Plan, offset: float) -> Plan:
    """The plan in raw counts, as plain numbers, which are faster interpreted."""
    target = plan.target + (plan.stage == moves.MACRO) * offset
    columns = plan._replace(target=target)
    listed: Any = {f: getattr(columns, f).tolist() for f in plan._fields if f != "end"}
    return Plan(end=float(plan.end), **listed)


def step(
    p: LiveParameters, s: LiveState, motion: Motion, work: Running, sample: Sample, dt: float
) -> tuple[LiveState, Efforts]:
    if not math.isnan(work.over):
        return _settle(p, s, work, sample, dt)
    before = work.progress
    local = sample._replace(t=s.time - work.start)
    progress, command, out = supervisor.step(s.laws, work.plan, before, local, dt)
    notices: tuple[Notice, ...] = ()
    if before.phase == MACRO and _has_left(work.plan, before, progress):
        late = local.t - before.began >= s.laws.sequence.patience
        found = _way(s, work)
        if _has_arrived(s, before, local):
            s, event = t.go(s, m.SETTLING, t.ARRIVED, found)
        elif late:
            return without_effort(brake.start(p, s, m.STALLED, t.STALLED, found))
        else:
            work = work._replace(cut_off=work.cut_off or found)
            event = t.report(s, "move", "cut off", found)
        notices = (event,)
    window = work.window
    fresh = progress.move != before.move
    if progress.phase == MICRO:
        window = EMPTY if fresh else window
        off = progress.micro_reference - s.seen.fine
        window = observe(p.settings.fine, window, sample.hall, off, dt)
    if progress.phase == DONE:
        s, efforts = _end(p, s, work._replace(over=s.time), sample, dt)
        return s, efforts._replace(notices=(*notices, *efforts.notices))
    drive = Drive(
        progress.macro_reference,
        progress.micro_reference,
        progress.macro,
        progress.integral,
        s.drive.reset or out.laser_reset > 0.5,
        progress.fine,
    )
    s = with_work(s, drive, work._replace(progress=progress, window=window))
    mode = MODES.get(progress.phase, s.mode)
    if mode != s.mode:
        s, event = t.go(s, mode, t.NEXT_MOVE, {"move": progress.move})
        notices = (*notices, event)
    if fresh and work.plan.start[progress.move] != -math.inf:  # a profile is told once
        notices = (*notices, _beginning(s, work, progress))
    return s, Efforts(out.motor, out.ctrl, command.macro_active, command.micro_active, notices)


def _has_left(plan: Plan, before: Progress, progress: Progress) -> bool:
    """Whether the macro move that was under way is over."""
    if progress.move != before.move and plan.start[progress.move] == -math.inf:
        return False  # the next set point of the same profile
    fresh = progress.move != before.move and plan.stage[progress.move] == moves.MACRO
    return progress.phase != MACRO or fresh


def _has_arrived(s: LiveState, before: Progress, sample: Sample) -> bool:
    """Whether the macro move under way has arrived, by the supervisor's rule."""
    q = s.laws.sequence
    error = before.macro_reference - sample.encoder
    inside = arrival.since(q, error, before.inside, sample.t)
    return arrival.arrived(q, inside, sample.t)


def _way(s: LiveState, work: Running) -> Evidence:
    """The macro move under way and its error [counts]."""
    move = work.progress.move
    while work.plan.stage[move] != moves.MACRO:  # passed over on its way
        move -= 1
    return {"move": move, "error_counts": work.progress.macro_reference - s.seen.encoder}


def _beginning(s: LiveState, work: Running, progress: Progress) -> m.Event:
    """The event of a move's beginning, with the end of the previous one."""
    k = progress.move
    coarse = work.plan.stage[k] == moves.MACRO
    goal = work.plan.target[k]
    target = {"target_counts": goal - s.frame.offset} if coarse else {"target_mm": goal * 1e3}
    facts: Evidence = {"move": k, "stage": m.STAGES[work.plan.stage[k]]}
    facts |= {**target, "passed_over": k - work.progress.move - 1}
    if work.progress.move >= 0:
        facts |= _result(s, work)
    return t.report(s, "move", "next move", facts)


def _result(s: LiveState, work: Running) -> Evidence:
    """Error at the end of the present move: counts, or mm of the last full window."""
    if work.plan.stage[work.progress.move] == moves.MACRO:
        return {"error_counts": work.progress.macro_reference - s.seen.encoder}
    return {"error_mm": work.window.mean * 1e3}


def _end(
    p: LiveParameters, s: LiveState, work: Running, sample: Sample, dt: float
) -> tuple[LiveState, Efforts]:
    """End the plan: complete, and its last move on target or not."""
    move, plan = work.progress.move, work.plan
    left = len(plan.stage) - move - 1
    found: Evidence = {"moves": move + 1, **(_result(s, work) if move >= 0 else {})}
    if lacks := following.lacking(left, work.cut_off):
        return _stall(p, s, found | lacks)
    if plan.stage[move] == moves.MICRO:
        return _settle(p, s, work, sample, dt)
    if not arrival.within(s.laws.sequence, found["error_counts"]):
        return _stall(p, s, found)
    return without_effort(t.conclude(p, s, m.READY, (m.DONE, t.PROGRAMME_DONE), found))


def _settle(
    p: LiveParameters, s: LiveState, work: Running, sample: Sample, dt: float
) -> tuple[LiveState, Efforts]:
    """One period after the plan's end, while a fine last move settles."""
    q, reference = p.settings.fine, work.progress.micro_reference
    s, efforts = fine_efforts(s, sample, reference, dt)
    window = observe(q, work.window, sample.hall, reference - s.seen.fine, dt)
    work = work._replace(window=window)
    s = s._replace(work=work)
    found: Evidence = {"moves": work.progress.move + 1, **_result(s, work)}
    if window.held >= q.dwell - TICK and window.number == 0:
        return without_effort(t.conclude(p, s, m.READY, (m.DONE, t.PROGRAMME_DONE), found))
    if s.time - work.over >= q.patience - TICK:
        return _stall(p, s, found)
    return s, efforts


def _stall(p: LiveParameters, s: LiveState, found: Evidence) -> tuple[LiveState, Efforts]:
    if s.mode == m.MOVING_MICRO:
        s, notices = t.conclude(p, s, m.STOPPED, (m.STALLED, t.STALLED), found)
    else:
        s, notices = brake.start(p, s, m.STALLED, t.STALLED, found)
    return s, Efforts(notices=notices)
