"""Runs a programme on a live stage: to its start, then its moves."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from macromicro.control.arrival import TICK
from macromicro.control.live import alone, brake
from macromicro.control.live import messages as m
from macromicro.control.live import transitions as t
from macromicro.control.live.guided import reached, slowed
from macromicro.control.live.leading import REST, Aim, Guided, Period, Piece, Step, led
from macromicro.control.live.messages import Evidence, Notice, Refused
from macromicro.control.live.parameters import LiveParameters
from macromicro.control.live.state import NAN, NOWHERE, LiveState, Motion, Played, Targets
from macromicro.control.stage_law import Sample, Target
from macromicro.machines import sequence
from macromicro.machines.sequence import DONE, MOVING, Arrival, Plan, Progress
from macromicro.place import LENGTH, Place

Follow = Callable[[Plan, Arrival, Progress, Sample], tuple[Progress, Target]]


def motion(s: LiveState, plan: Any, pitch: float, unit: Place = LENGTH) -> Motion | Refused:
    """A programme as a motion within the soft limits."""
    if not isinstance(plan, Plan) or not len(plan.target):
        return Refused("no programme is loaded", "load one first")
    low, high = s.limits.macro_low * pitch, s.limits.macro_high * pitch
    places = np.concatenate(([plan.origin], plan.target, plan.pieces[:, 1]))
    for place in (float(places.min()), float(places.max())):
        if not low - pitch <= place <= high + pitch:
            return Refused(
                f"the programme goes to {place * unit.per:.9g} {unit.unit}, beyond the soft limits",
                f"stay within {low * unit.per:.9g} to {high * unit.per:.9g} {unit.unit}",
                True,
            )
    return Motion(s.given + 1, "programme", NAN, NAN, NAN, s.time)


def start(s: LiveState, motion: Motion, plan: Plan) -> tuple[LiveState, tuple[Notice, ...]]:
    """Begin the move to the programme's start."""
    work = Played(plan, sequence.begin(), NAN, None)
    s = s._replace(motion=motion, work=work, target=NOWHERE)
    s, event = t.go(s, m.MOVING_MACRO, t.PROGRAMME, {"moves": len(plan.target)})
    return s, (event,)


def step(now: Period, s: LiveState, g: Guided, follow: Follow = sequence.step) -> Step:
    p, q, place, dt = now
    work, offset = s.work, s.frame.offset * p.settings.pitch
    assert isinstance(work, Played)
    if math.isnan(work.start):
        return _approach(now, s, g)
    plan, before = work.plan, work.progress
    local = Sample(s.time - work.start, place - offset)
    progress, target = follow(plan, Arrival(*q.arrival), before, local)
    aim = _aim(plan, progress, target, local.t, offset)
    g = g._replace(aim=aim, later=_later(plan, progress, local.t, offset, dt))
    unit = p.settings.place
    found: Evidence = {
        "move": before.move,
        f"error_{unit.fine}": (g.aim.position - place) * unit.fines,
    }
    notices: tuple[Notice, ...] = ()
    if before.phase == MOVING and not progress.arrived and _ended(before, progress):
        if math.isnan(plan.start[before.move]):
            s, notices = brake.start(p, s, m.STALLED, t.STALLED, found)
            return s, g, notices
        work = work._replace(cut_off=work.cut_off or found)
        notices = (t.reported(s, "move", "cut off", found),)
    work = work._replace(progress=progress)
    s = s._replace(work=work)
    if progress.phase == DONE:
        s, ends = _end(p, s, work, place - offset)
        return s, g._replace(aim=REST._replace(position=g.aim.position)), (*notices, *ends)
    if progress.move != before.move:
        if s.mode == m.SETTLING:
            s, event = t.go(s, m.MOVING_MACRO, t.NEXT_MOVE, {"move": progress.move})
            notices = (*notices, event)
        there = float(plan.target[progress.move]) * unit.per
        goal = {"move": progress.move, f"target_{unit.unit}": there}
        notices = (*notices, t.reported(s, "move", "next move", goal))
    if progress.arrived and s.mode == m.MOVING_MACRO:
        s, event = t.go(s, m.SETTLING, t.ARRIVED, found)
        notices = (*notices, event)
    return s, g, notices


def _approach(now: Period, s: LiveState, g: Guided) -> Step:
    """One period of the move to the programme's start."""
    p, q, place, dt = now
    work, motion = s.work, s.motion
    assert isinstance(work, Played) and motion is not None
    goal = work.plan.origin + s.frame.offset * p.settings.pitch
    g, late = led(slowed(q, g), g, motion.id, goal, s.time, dt)
    if late < 0.0:
        return s, g, ()
    g, there = reached(q, g, goal, place, s.time)
    if there:
        return s._replace(work=work._replace(start=s.time + dt)), g, ()
    if late >= q.arrival.patience - TICK:
        unit = p.settings.place
        found = {"move": -1, f"error_{unit.fine}": (goal - place) * unit.fines}
        s, notices = brake.start(p, s, m.STALLED, t.STALLED, found)
        return s, g, notices
    return s, g, ()


def _ended(before: Progress, progress: Progress) -> bool:
    """Whether the move that was under way is over."""
    return progress.phase != MOVING or progress.move != before.move


def _aim(plan: Plan, progress: Progress, target: Target, now: float, offset: float) -> Aim:
    """The set point with the jerk of its profile."""
    jerk = 0.0
    if progress.phase == MOVING and now - progress.began < plan.length[progress.move] - TICK:
        jerk = float(plan.pieces[progress.piece, 4])
    position, velocity, acceleration = (float(x) for x in target[:3])
    return Aim(position + offset, velocity, acceleration, jerk)


def _later(
    plan: Plan, progress: Progress, now: float, offset: float, dt: float
) -> tuple[Piece, ...]:
    """The pieces of its profile, and its end, that the coming period reaches."""
    if progress.phase != MOVING:
        return ()
    since = now - progress.began
    last = sequence.piece_at(plan, progress, now + dt)
    rows = plan.pieces[progress.piece + 1 : last + 1].tolist()
    rows.append([plan.length[progress.move], plan.target[progress.move], 0.0, 0.0, 0.0])
    return tuple(
        (begin - since, Aim(place + offset, *rates))
        for begin, place, *rates in rows
        if TICK < begin - since < dt - TICK
    )


def _end(
    p: LiveParameters, s: LiveState, work: Played, place: float
) -> tuple[LiveState, tuple[Notice, ...]]:
    """Finish the plan: complete, and the stage on target or not."""
    plan, move = work.plan, work.progress.move
    left, off = len(plan.target) - move - 1, float(plan.target[move]) - place
    unit = p.settings.place
    found: Evidence = {"moves": move + 1, f"error_{unit.fine}": off * unit.fines}
    if left or work.cut_off is not None:
        found |= {"moves_left": left} if left else {}
        if work.cut_off is not None:
            found |= {f"cut_off_{name}": value for name, value in work.cut_off.items()}
        return brake.start(p, s, m.STALLED, t.STALLED, found)
    whole = float(plan.target[move])
    s = s._replace(target=Targets(whole, alone.nearest(whole, p.settings.pitch)))
    return t.conclude(p, s, m.READY, (m.DONE, t.PROGRAMME_DONE), found)
