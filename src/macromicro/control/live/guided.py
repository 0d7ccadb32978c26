"""A live stage moved by set points that its own law follows at its own period.

Positions are in m of the encoder's own frame, as in `Course`; those of `LiveState` in counts.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from macromicro.control import arrival
from macromicro.control.arrival import TICK
from macromicro.control.live import _seeking, alone, following, survey
from macromicro.control.live import brake as braking
from macromicro.control.live import messages as m
from macromicro.control.live import transitions as t
from macromicro.control.live.leading import (
    NEVER,
    REST,
    Course,
    Guide,
    Guided,
    Period,
    Step,
    Touch,
    ahead,
    at,
    decelerate,
    lead,
    ramp,
    to_rest,
)
from macromicro.control.live.machine import Look, perceive
from macromicro.control.live.messages import Notice
from macromicro.control.live.parameters import LiveParameters
from macromicro.control.live.state import (
    Approach,
    Braking,
    Followed,
    Jogged,
    LiveState,
    Search,
    Targets,
)
from macromicro.types import QUIET, Lines, Sample

HASTE, SURGE = 2.0, 0.25  # times what was asked, and of the greatest speed, before it is known
CHANGED = 1.5  # counts; a reading that dithers by less stands
HUSH = 0.25  # of arrival.dwell: a reading that stands for less may only be coarse
PUSHES = 0.5  # of arrival.tolerance: a law pushes a stage that rests farther from its set point
CALM = 2.5  # of arrival.dwell: what a stage that has arrived may still be pushed without motion
BEHIND = 1.5  # of arrival.tolerance: how far a stage may stop short of a set point that slows down,
LAST = 2.0  # and periods of the set point's braking by which it may rest before
SPRING = 0.1  # s in which a stage springs back from a stop that it leaned on
SPARE = 0.1  # s; beyond what is taken for the stop, until the guard takes it for a fault
DEAD = "the reading did not change while the stage decelerated: it may have moved unseen"
STANDS = {
    "reason": "the motor pushes and the reading does not change: the stage is blocked, at an end "
    "of its way, or its encoder or motor is not connected"
}
Work = Callable[[Period, LiveState, Guided], Step]
Brake = Callable[[Guide, Guided, float], tuple[Guided, bool]]


def step(
    p: LiveParameters,
    q: Guide,
    s: LiveState,
    g: Guided,
    sample: Sample,
    dt: float,
    look: Look = survey.look,
    works: Mapping[type, Work] | None = None,
    lines: Lines = QUIET,
) -> tuple[LiveState, Guided, Course, tuple[Notice, ...]]:
    s, sample = perceive(p, s, sample, dt, look)
    place = s.seen.encoder * p.settings.pitch
    g = _note_reading(p, g._replace(lines=lines, later=()), place, s.time)
    if q.touch is not None and q.touch.seek is not None:
        said = _seeking.on(q.touch.seek, g)
        g = _seeking.debounce(g, said, s.time, s.seen.encoder, dt)
    g = _mark_limit(q, s, g, place - s.frame.offset * p.settings.pitch)
    released = q.heats and s.mode == m.STOPPED and s.work is None
    origin = s.frame.offset * p.settings.pitch if s.frame.trusted else math.nan
    if s.mode in (m.DISABLED, m.FAULT) or released:  # else it has been seen, or was not enabled
        return s, g._replace(on=False), Course(origin=origin), ()
    if not g.on:  # the law begins where the stage is
        g = _without_memory(g, place)._replace(on_since=s.time)
    if s.time - g.on_since < q.rise - TICK:
        g = _without_memory(g, place)
        waiting = Course(True, g.aim, restart=g.restart, waiting=True, origin=origin)
        return s, g, waiting, ()
    notices: tuple[Notice, ...] = ()
    work = None if s.work is None else (WORKS if works is None else works).get(type(s.work))
    if work is not None:
        s, g, notices = work(Period(p, q, place, dt), s, g._replace(calm=False))
    else:
        g = _calm(q, decelerate(q, g, dt), place, s.time)
    low, high, offset = -math.inf, math.inf, s.frame.offset * p.settings.pitch
    effort = speed = leant = math.inf
    homing = isinstance(s.work, Search)
    if s.frame.trusted:
        low = -math.inf if g.off_low else q.low + offset
        high = math.inf if g.off_high else q.high + offset
    elif q.touch is not None:
        effort, leant = q.touch.effort, leans(q.touch, s.work)
        speed = HASTE * max(q.touch.speed, abs(g.aim.velocity)) + SURGE * q.velocity
    on = s.mode not in (m.DISABLED, m.FAULT)
    course = Course(
        on, g.aim, low, high, effort, g.restart, False, homing, speed, leant, g.later, origin
    )
    return s, g._replace(on=on), course, notices


def _note_reading(p: LiveParameters, g: Guided, place: float, now: float) -> Guided:
    """Remember the set point at the last change of the reading."""
    if abs(place - g.stood) <= CHANGED * p.settings.pitch:
        return g
    return g._replace(stood=place, asked=g.aim.position, stood_since=now)


def _calm(q: Guide, g: Guided, place: float, now: float) -> Guided:
    """Switch the law off once, after a motion has ended on a stage that friction holds."""
    if (
        not q.rubs
        or g.calm
        or not _stands(g)
        or now - g.stood_since < CALM * q.arrival.dwell - TICK
    ):
        return g
    pushes = abs(g.aim.position - g.stood) > PUSHES * q.arrival.tolerance
    return (let_go(g, place) if pushes else g)._replace(calm=True)


def leans(q: Touch, work: Any) -> float:
    """The longest time that a stage of unknown position may stand and push."""
    if not isinstance(work, Search):
        return q.reveal + SPARE
    away = q.seek is None and work.phase in (_seeking.BACK, _seeking.OUT)
    return q.reveal if away else q.stand + SPARE


def _without_memory(g: Guided, place: float) -> Guided:
    return let_go(g, place)._replace(on=True, inside=math.nan, there=math.nan)


def _mark_limit(q: Guide, s: LiveState, g: Guided, place: float) -> Guided:
    """Limit the speed from a tripped limit switch on until the stage is within its soft limits."""
    low = g.lines.limit_low != 0.0 or (g.off_low and s.frame.trusted and place < q.low)
    high = g.lines.limit_high != 0.0 or (g.off_high and s.frame.trusted and place > q.high)
    return g._replace(off_low=low, off_high=high)


def slow_limits(q: Guide, g: Guided) -> Guide:
    """The motion limits of a stage that may be returning from a limit switch."""
    if g.off_low or g.off_high:
        return q._replace(velocity=min(q.velocity, q.leave))
    return q


def _home(now: Period, s: LiveState, g: Guided) -> Step:
    touch = now.q.touch
    assert touch is not None
    search = _seeking.touch_stop if touch.seek is None else _seeking.seek_switch
    return search(now, s, g)


def follow(now: Period, s: LiveState, g: Guided) -> Step:
    (p, q, place, dt), motion = now, s.motion
    assert motion is not None
    goal = motion.coarse * p.settings.pitch
    g, late = lead(slow_limits(q, g), g, motion.id, goal, s.time, dt)
    if late < 0.0:
        return s, g, ()
    g, there = has_reached(q, g, goal, place, s.time)
    unit = p.settings.place
    found = {f"error_{unit.fine}": (goal - place) * unit.fines, "seconds": s.time - motion.began}
    if there:
        s, notices = t.arrived(p, s, found)
        return s, g, notices
    if late >= q.arrival.patience - TICK:
        return to_rest(p, s, let_go(g, place), m.STALLED, t.STALLED, found)
    return s, g, ()


def follow_points(now: Period, s: LiveState, g: Guided) -> Step:
    """One period behind the set points that a client streams."""
    (p, q, place, dt), work, motion = now, s.work, s.motion
    assert isinstance(work, Followed) and motion is not None
    if g.motion != motion.id:  # the set point comes to rest first
        g = decelerate(q, g, dt)
        if g.aim.velocity != 0.0:
            return s, g, ()
        g, work = g._replace(motion=motion.id, inside=math.nan), work._replace(track=None)
    offset = s.frame.offset * p.settings.pitch
    here = g.aim if work.track is None else work.track.aim
    if following.has_lapsed(s):
        g = g._replace(aim=ramp(q, here, 0.0, dt))
        return to_rest(p, s, g, m.LOST, t.LAPSED, following.facts(work))
    rates = slow_limits(q, g).velocity, q.acceleration, q.jerk
    ends = following.bounds(p, s, motion)
    work, goal, aim, later = following.led(work, rates, ends, here, s.time, dt, offset)
    g = g._replace(aim=aim, later=later)
    if not work.ending or aim != goal:
        return s._replace(work=work), g, ()
    entered = s.time if math.isnan(work.settle.entered) else work.settle.entered
    s = s._replace(work=work._replace(settle=work.settle._replace(entered=entered)))
    g, there = has_reached(q, g, goal.position, place, s.time)
    unit = p.settings.place
    found = {f"error_{unit.fine}": (goal.position - place) * unit.fines, **following.facts(work)}
    if there:
        whole = goal.position - offset
        s = s._replace(target=Targets(whole, alone.nearest(whole, p.settings.pitch)))
        s, notices = t.arrived(p, s, found)
        return s, g, notices
    if s.time - entered >= q.arrival.patience - TICK:
        return to_rest(p, s, let_go(g, place), m.STALLED, t.STALLED, found)
    return s, g, ()


def let_go(g: Guided, place: float) -> Guided:
    """The set point where the stage stands, so that nothing pushes."""
    aim = REST._replace(position=place)
    return g._replace(aim=aim, restart=g.restart + 1, motion=NEVER, asked=place)


def has_reached(q: Guide, g: Guided, goal: float, place: float, now: float) -> tuple[Guided, bool]:
    inside = arrival.since(q.arrival, goal - place, g.inside, now)
    return g._replace(inside=inside), arrival.arrived(q.arrival, inside, now)


def _stands(g: Guided) -> bool:
    return g.aim == REST._replace(position=g.aim.position)


def _alone(q: Guide, g: Guided, dt: float) -> tuple[Guided, bool]:
    """Its own way to rest, and whether the set point is there."""
    g = decelerate(q, g, dt)
    return g, _stands(g)


def _is_unanswered(q: Guide, g: Guided, dt: float) -> bool:
    """Whether the set point has moved on while the reading has not changed."""
    short = BEHIND * q.arrival.tolerance + 0.5 * q.acceleration * (LAST * dt) ** 2
    return abs(g.aim.position - g.asked) > short


def slow_down(now: Period, s: LiveState, g: Guided, brake: Brake = _alone) -> Step:
    """One period of coming to rest: the set point first, then the stage."""
    (p, q, place, dt), work = now, s.work
    assert isinstance(work, Braking)
    if g.motion != NEVER:  # the profile is given up
        g = g._replace(motion=NEVER, inside=math.nan)
    if not s.frame.trusted and g.leaning > 0.0:
        g = g._replace(leant=s.time)
    springs = q.rubs and s.time - g.leant < SPRING
    apart = g.aim.position != place
    if springs or (
        not s.frame.trusted and apart and g.aim.velocity == 0.0 and math.isnan(g.inside)
    ):
        # What leaned on something is let go: it is held where it is.
        g = let_go(g, place)
    stood = s.time - max(g.stood_since, g.leant)
    dead = q.rubs and stood >= HUSH * q.arrival.dwell - TICK and _is_unanswered(q, g, dt)
    g, stands = brake(q, g, dt)
    off = g.aim.position - place
    inside = arrival.since(q.arrival, off, g.inside, s.time) if stands else math.nan
    g = g._replace(inside=inside)
    rested = q.heats or (arrival.arrived(q.arrival, inside, s.time) and not springs)
    lost: tuple[Notice, ...] = ()
    rested = rested or (q.rubs and stands and stood >= q.arrival.dwell - TICK)
    if dead:
        s, lost = t.distrust(s, DEAD)
    if q.rubs and (dead or rested):  # no push that its reading does not answer drives it on
        g = let_go(g, place)
    if not rested and s.time < work.until + q.arrival.patience - TICK:
        return s, g, lost
    s, notices = braking.end(p, s, work, rested)
    return s, g if rested else let_go(g, place), (*lost, *notices)


def jog(now: Period, s: LiveState, g: Guided) -> Step:
    """One period of a jog, which decelerates towards its limit and ends there."""
    (p, q, place, dt), work = now, s.work
    assert isinstance(work, Jogged)
    pitch, aim = p.settings.pitch, at(g.aim, dt)
    if following.has_lapsed(s):
        g = g._replace(aim=ramp(q, aim, 0.0, dt))
        return to_rest(p, s, g, m.LOST, t.LAPSED, following.facts(work))
    goal = work.goal * pitch
    if g.off_low or g.off_high:
        goal = math.copysign(min(abs(goal), q.leave), goal)
    if s.frame.trusted:
        bound = s.limits.macro_high if goal > 0.0 else s.limits.macro_low
        way = math.copysign(1.0, goal) * ((bound + s.frame.offset) * pitch - aim.position)
        # Of the way that is left, one period's is kept in hand.
        left = max(way - abs(aim.velocity) * dt, 0.0)
        goal = math.copysign(min(abs(goal), math.sqrt(2.0 * q.acceleration * left)), goal)
        g = g._replace(aim=ramp(q, aim, goal, dt))
        if left <= 0.0:
            return to_rest(p, s, g, m.LIMIT, t.LIMIT)
        return s, g, ()
    g = g._replace(aim=ramp(q, aim, goal, dt))
    if q.touch is None:
        return s, g, ()
    g, leant = ahead(q.touch, g, place)
    s = s._replace(work=work._replace(held_back=work.held_back + dt if leant else 0.0))
    patience = p.settings.jogging.patience
    if work.held_back >= patience - TICK or g.leaning >= min(patience, q.touch.reveal):
        return to_rest(p, s, let_go(g, place), m.STALLED, t.STALLED, STANDS)
    return s, g, ()


WORKS: dict[type, Work] = {
    Approach: follow,
    Braking: slow_down,
    Followed: follow_points,
    Jogged: jog,
    Search: _home,
}
