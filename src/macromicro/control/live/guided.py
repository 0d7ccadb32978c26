"""A live stage that is led by set points: its own law follows them, at its own period.

`accept` and the table of transitions are those of every live machine, whose macro-stage this is.
What differs is how a motion is carried out: by profiles within the limits of the motion, from the
set point of now. Enabled, the stage is held by its law wherever it rests.

Positions are in m of the encoder's own frame, as in `Course`; those of `LiveState` in its counts.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from macromicro.control import arrival
from macromicro.control.arrival import TICK
from macromicro.control.live import brake, seeking, survey, touching
from macromicro.control.live import messages as m
from macromicro.control.live import transitions as t
from macromicro.control.live.leading import (
    NEVER,
    REST,
    Course,
    Guide,
    Guided,
    Touch,
    ahead,
    at,
    braked,
    led,
    ramped,
)
from macromicro.control.live.machine import Look, perceive
from macromicro.control.live.messages import Notice
from macromicro.control.live.parameters import LiveParameters
from macromicro.control.live.state import Approach, Braking, Jogged, LiveState, Search
from macromicro.types import QUIET, Lines, Sample

HASTE, SURGE = 2.0, 0.25  # times what was asked, and of the greatest speed, before it is known
SPARE = 0.1  # s; beyond what is taken for the stop, until the guard takes it for a fault
STANDS = {
    "reason": "the motor pushes and the reading does not change: the stage is blocked, at an end "
    "of its way, or its encoder or motor is not connected"
}
Step = tuple[LiveState, Guided, tuple[Notice, ...]]
Work = Callable[[LiveParameters, Guide, LiveState, Guided, float, float], Step]
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
    """One control period of the live machine.

    Parameters
    ----------
    p : LiveParameters
        Parameters of the live machine.
    q : Guide
        What leads the stage.
    s : LiveState
        State of the live machine.
    g : Guided
        State of the set point.
    sample : Sample
        What the rig shows.
    dt : float
        Control period, s.
    look : Look, optional
        As of `machine.step`.
    works : Mapping[type, Work] | None, optional
        How each kind of motion is carried out; None: `WORKS`.
    lines : Lines, optional
        What its switches say.

    Returns
    -------
    state : LiveState
        New state.
    guided : Guided
        New state of the set point.
    course : Course
        Where the law is to lead the stage until the next period.
    notices : tuple[Notice, ...]
        What happened.
    """
    s, sample = perceive(p, s, sample, dt, look)
    place = s.seen.encoder * p.settings.pitch
    g = g._replace(lines=lines)
    if q.touch is not None and q.touch.seek is not None:
        said = seeking.on(q.touch.seek, g)
        g = seeking.debounced(g, said, s.time, s.seen.encoder, dt)
    g = _marked(q, s, g, place - s.frame.offset * p.settings.pitch)
    released = q.heats and s.mode == m.STOPPED and s.work is None
    if s.mode in (m.DISABLED, m.FAULT) or released:  # else it has been seen, or was not enabled
        return s, g._replace(on=False), Course(), ()
    if not g.on:  # the law begins where the stage is
        g = _fresh(g, place)._replace(on_since=s.time)
    if s.time - g.on_since < q.rise - TICK:
        g = _fresh(g, place)
        return s, g, Course(on=True, aim=g.aim, restart=g.restart, waiting=True), ()
    notices: tuple[Notice, ...] = ()
    work = None if s.work is None else (WORKS if works is None else works).get(type(s.work))
    if work is not None:
        s, g, notices = work(p, q, s, g, place, dt)
    else:
        g = braked(q, g, dt)
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
        on, g.aim, low, high, effort, g.restart, homing=homing, speed=speed, leant=leant
    )
    return s, g._replace(on=on), course, notices


def leans(q: Touch, work: Any) -> float:
    """The longest time that a stage whose place is not known may stand and be pushed.

    Parameters
    ----------
    q : Touch
        How it finds its place.
    work : Any
        What it is doing.

    Returns
    -------
    float
        s: while the stop is felt for, a little more than that takes; else what a free stage needs
        to move, and a little more.
    """
    if not isinstance(work, Search):
        return q.reveal + SPARE
    away = q.seek is None and work.phase in (touching.BACK, touching.OUT)
    return q.reveal if away else q.stand + SPARE


def _fresh(g: Guided, place: float) -> Guided:
    """The set point where the stage is, for a law that begins anew."""
    return let_go(g, place)._replace(on=True, inside=math.nan, there=math.nan)


def _marked(q: Guide, s: LiveState, g: Guided, place: float) -> Guided:
    """From a tripped limit switch on, until it is back within its soft limits, a stage goes
    slowly, and is not stopped by these."""
    low = g.lines.limit_low != 0.0 or (g.off_low and s.frame.trusted and place < q.low)
    high = g.lines.limit_high != 0.0 or (g.off_high and s.frame.trusted and place > q.high)
    return g._replace(off_low=low, off_high=high)


def slowed(q: Guide, g: Guided) -> Guide:
    """The limits of the motion of a stage that may be on its way back from a limit switch.

    Parameters
    ----------
    q : Guide
        What leads the stage.
    g : Guided
        State of the set point.

    Returns
    -------
    Guide
        At the speed off a limit switch, if it is.
    """
    if g.off_low or g.off_high:
        return q._replace(velocity=min(q.velocity, q.leave))
    return q


def _home(p: LiveParameters, q: Guide, s: LiveState, g: Guided, place: float, dt: float) -> Step:
    """One period of homing, on the stop or on a switch."""
    touch = q.touch
    assert touch is not None
    search = touching.step if touch.seek is None else seeking.step
    return search(p, q, s, g, place, dt)


def follow(p: LiveParameters, q: Guide, s: LiveState, g: Guided, place: float, dt: float) -> Step:
    """One period of a move.

    Parameters
    ----------
    p : LiveParameters
        Parameters of the live machine.
    q : Guide
        What leads the stage.
    s : LiveState
        State of the live machine.
    g : Guided
        State of the set point.
    place : float
        Where the stage is, m.
    dt : float
        Control period, s.

    Returns
    -------
    state : LiveState
        New state.
    guided : Guided
        New state of the set point.
    notices : tuple[Notice, ...]
        What happened.
    """
    motion = s.motion
    assert motion is not None
    goal = motion.coarse * p.settings.pitch
    g, late = led(slowed(q, g), g, motion.id, goal, s.time, dt)
    if late < 0.0:
        return s, g, ()
    g, there = reached(q, g, goal, place, s.time)
    unit = p.settings.place
    found = {f"error_{unit.fine}": (goal - place) * unit.fines, "seconds": s.time - motion.began}
    if there:
        s, event = t.go(s, m.SETTLING, t.ARRIVED, found)
        s, notices = t.conclude(p, s, m.READY, (m.DONE, t.SETTLED), found)
        return s, g, (event, *notices)
    if late >= q.arrival.patience - TICK:
        s, notices = brake.start(p, s, m.STALLED, t.STALLED, found)
        return s, let_go(g, place), notices
    return s, g, ()


def let_go(g: Guided, place: float) -> Guided:
    """The set point where the stage stands, so that nothing pushes any more.

    Parameters
    ----------
    g : Guided
        State of the set point.
    place : float
        Where the stage is, m.

    Returns
    -------
    Guided
        For a law that restarts there.
    """
    return g._replace(aim=REST._replace(position=place), restart=g.restart + 1, motion=NEVER)


def reached(q: Guide, g: Guided, goal: float, place: float, now: float) -> tuple[Guided, bool]:
    """Whether a stage has arrived at the end of a profile.

    Parameters
    ----------
    q : Guide
        What leads the stage.
    g : Guided
        State of the set point.
    goal : float
        m.
    place : float
        Where the stage is, m.
    now : float
        s.

    Returns
    -------
    guided : Guided
        New state.
    there : bool
        Within the tolerance for long enough.
    """
    inside = arrival.since(q.arrival, goal - place, g.inside, now)
    return g._replace(inside=inside), arrival.arrived(q.arrival, inside, now)


def _alone(q: Guide, g: Guided, dt: float) -> tuple[Guided, bool]:
    """Its own way to rest; and whether the set point is there."""
    g = braked(q, g, dt)
    return g, g.aim == REST._replace(position=g.aim.position)


def slow_down(
    p: LiveParameters,
    q: Guide,
    s: LiveState,
    g: Guided,
    place: float,
    dt: float,
    brake: Brake = _alone,
) -> Step:
    """One period of coming to rest: the set point first, then the stage.

    Parameters
    ----------
    p : LiveParameters
        Parameters of the live machine.
    q : Guide
        What leads the stage.
    s : LiveState
        State of the live machine.
    g : Guided
        State of the set point.
    place : float
        Where the stage is, m.
    dt : float
        Control period, s.
    brake : Brake, optional
        The set point a period later on its way to rest, and whether it is there.

    Returns
    -------
    state : LiveState
        New state.
    guided : Guided
        New state of the set point.
    notices : tuple[Notice, ...]
        What happened.
    """
    work = s.work
    assert isinstance(work, Braking)
    if g.motion != NEVER:  # the profile is given up
        g = g._replace(motion=NEVER, inside=math.nan)
    apart = g.aim.position != place
    if not s.frame.trusted and apart and g.aim.velocity == 0.0 and math.isnan(g.inside):
        # What leaned on something is let go: it is held where it is.
        g = let_go(g, place)
    g, stands = brake(q, g, dt)
    off = g.aim.position - place
    inside = arrival.since(q.arrival, off, g.inside, s.time) if stands else math.nan
    g = g._replace(inside=inside)
    rested = q.heats or arrival.arrived(q.arrival, inside, s.time)
    if not rested and s.time < work.until + q.arrival.patience - TICK:
        return s, g, ()
    evidence = {"way_counts": s.seen.encoder - work.origin, "cause": work.cause, **work.found}
    if not rested:
        evidence["rest"] = "did not come to rest in time"
        g = let_go(g, place)
    s, notices = t.finished(p, s, work.outcome if rested else m.STALLED, evidence)
    return s, g, notices


def jog(p: LiveParameters, q: Guide, s: LiveState, g: Guided, place: float, dt: float) -> Step:
    """One period of a jog: it slows down towards its limit, and ends there.

    Parameters
    ----------
    p : LiveParameters
        Parameters of the live machine.
    q : Guide
        What leads the stage.
    s : LiveState
        State of the live machine.
    g : Guided
        State of the set point.
    place : float
        Where the stage is, m.
    dt : float
        Control period, s.

    Returns
    -------
    state : LiveState
        New state.
    guided : Guided
        New state of the set point.
    notices : tuple[Notice, ...]
        What happened.
    """
    work = s.work
    assert isinstance(work, Jogged)
    pitch, aim = p.settings.pitch, at(g.aim, dt)
    goal = work.goal * pitch
    if g.off_low or g.off_high:
        goal = math.copysign(min(abs(goal), q.leave), goal)
    if s.frame.trusted:
        bound = s.limits.macro_high if goal > 0.0 else s.limits.macro_low
        way = math.copysign(1.0, goal) * ((bound + s.frame.offset) * pitch - aim.position)
        # Of the way that is left, one period's is kept in hand.
        left = max(way - abs(aim.velocity) * dt, 0.0)
        goal = math.copysign(min(abs(goal), math.sqrt(2.0 * q.acceleration * left)), goal)
        g = g._replace(aim=ramped(q, aim, goal, dt))
        if left <= 0.0:
            s, notices = brake.start(p, s, m.LIMIT, t.LIMIT)
            return s, g, notices
        return s, g, ()
    g = g._replace(aim=ramped(q, aim, goal, dt))
    if q.touch is None:
        return s, g, ()
    g, leant = ahead(q.touch, g, place)
    s = s._replace(work=work._replace(held_back=work.held_back + dt if leant else 0.0))
    patience = p.settings.jogging.patience
    if work.held_back >= patience - TICK or g.leaning >= min(patience, q.touch.reveal):
        s, notices = brake.start(p, s, m.STALLED, t.STALLED, STANDS)
        return s, let_go(g, place), notices
    return s, g, ()


WORKS: dict[type, Work] = {
    Approach: follow,
    Braking: slow_down,
    Jogged: jog,
    Search: _home,
}
