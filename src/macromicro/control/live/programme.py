"""A programme: the supervisor's schedule and laws, told as modes and events of the machine.

"Done": every macro move arrived, and the last move is on target when the programme ends.
A macro move out of patience ends the programme as stalled.
"""

from __future__ import annotations

import math
from typing import Any

from macromicro.control import supervisor
from macromicro.control.live import brake
from macromicro.control.live import messages as m
from macromicro.control.live import transitions as t
from macromicro.control.live.effort import Efforts, observe
from macromicro.control.live.messages import Evidence, Notice
from macromicro.control.live.parameters import LiveParameters
from macromicro.control.live.state import EMPTY, REST, TICK, LiveState, Motion, Running
from macromicro.control.supervisor import DONE, MACRO, MICRO, SETTLING, Plan, Progress
from macromicro.types import Sample

MODES = {MACRO: m.MOVING_MACRO, SETTLING: m.SETTLING, MICRO: m.MOVING_MICRO}


def start(s: LiveState, motion: Motion, plan: Plan) -> tuple[LiveState, tuple[Notice, ...]]:
    """Begin: macro targets become raw counts."""
    raw = _raw(plan, s.frame.offset)
    progress = supervisor.begin(s.seen.encoder)
    drive = t.idle(s.drive)._replace(macro_reference=s.seen.encoder)
    work = Running(raw, progress, s.time, EMPTY)
    s = s._replace(motion=motion, work=work, drive=drive, target=math.nan)
    s, event = t.go(s, m.MOVING_MACRO, t.PROGRAMME, {"moves": len(plan.stage)})
    return s, (event,)


def _raw(plan: Plan, offset: float) -> Plan:
    """The plan with raw counts, as plain numbers: interpreted, they are faster than arrays."""
    target = plan.target + (plan.stage == 0) * offset
    listed: Any = [a.tolist() for a in (plan.start, plan.stage, target, plan.hold)]
    start, stage, goal, hold = listed
    return Plan(start, stage, goal, hold, float(plan.end))


def step(
    p: LiveParameters, s: LiveState, motion: Motion, work: Running, sample: Sample, dt: float
) -> tuple[LiveState, Efforts]:
    """One period of the programme."""
    before = work.progress
    local = sample._replace(t=s.time - work.start)
    progress, command, out = supervisor.step(s.laws, work.plan, before, local, dt)
    if progress.phase == SETTLING and before.phase == MACRO and _stalled(s, progress, local.t):
        s, ends = brake.start(p, s, m.STALLED, t.STALLED)
        return s, Efforts(notices=ends)
    window = work.window
    fresh = progress.move != before.move
    if progress.phase == MICRO:
        window = EMPTY if fresh else window
        off = progress.micro_reference - s.seen.fine
        window = observe(p.settings.fine, window, sample.hall, off, dt)
    if progress.phase == DONE:
        return _end(p, s, work)
    drive = s.drive._replace(
        macro_reference=progress.macro_reference,
        micro_reference=progress.micro_reference,
        memory=progress.macro,
        integral=progress.integral,
        reset=s.drive.reset or out.laser_reset > 0.5,
    )
    s = s._replace(drive=drive, work=work._replace(progress=progress, window=window))
    notices: tuple[Notice, ...] = ()
    mode = MODES.get(progress.phase, s.mode)
    if mode != s.mode:
        s, event = t.go(
            s, mode, t.ARRIVED if mode == m.SETTLING else t.NEXT_MOVE, {"move": progress.move}
        )
        notices = (event,)
    if fresh:
        notices = (*notices, _told(s, work, progress))
    return s, Efforts(out.motor, out.ctrl, command.macro_active, command.micro_active, notices)


def _stalled(s: LiveState, progress: Progress, now: float) -> bool:
    """Did the supervisor give up waiting for an arrival?"""
    inside = progress.inside
    return math.isnan(inside) or now - inside < s.laws.sequence.dwell - TICK


def _told(s: LiveState, work: Running, progress: Progress) -> m.Event:
    """The event of a move's beginning, with how the one before ended."""
    k = progress.move
    coarse = work.plan.stage[k] == 0
    target = work.plan.target[k] - (s.frame.offset if coarse else 0.0)
    unit = "counts" if coarse else "mm"
    facts: Evidence = {"move": k, "stage": m.STAGES[work.plan.stage[k]]}
    facts |= {f"target_{unit}": target, "passed_over": k - work.progress.move - 1}
    if work.progress.move >= 0:
        facts |= _result(s, work)
    return t.told(s, "move", "next move", facts)


def _result(s: LiveState, work: Running) -> Evidence:
    """Error at the end of the present move: counts, or the last full window's mean in mm."""
    if work.plan.stage[work.progress.move] == 0:
        return {"error_counts": work.progress.macro_reference - s.seen.encoder}
    return {"error_mm": work.window.mean}


def _end(p: LiveParameters, s: LiveState, work: Running) -> tuple[LiveState, Efforts]:
    """The plan has been worked off: was its last move on target?"""
    move = work.progress.move
    found = {"moves": move + 1, **(_result(s, work) if move >= 0 else {})}
    if move < 0:
        good = False
    elif work.plan.stage[move] == 0:
        good = (
            work.progress.phase == SETTLING
            and abs(found["error_counts"]) <= s.laws.sequence.tolerance
        )
    else:
        good = abs(found["error_mm"]) <= p.settings.fine.band
    if good:
        s, notices = t.conclude(p, s, m.READY, (m.DONE, t.PROGRAMME_DONE), found)
        return s, Efforts(notices=notices)
    if s.mode == m.MOVING_MICRO:
        s, notices = t.conclude(p, s, m.STOPPED, (m.STALLED, t.STALLED), found)
    else:
        s = s._replace(drive=s.drive._replace(memory=REST))
        s, notices = brake.start(p, s, m.STALLED, t.STALLED)
    return s, Efforts(notices=notices)
