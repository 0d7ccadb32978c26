"""Homing of a stage that is led: its lower end stop is felt for twice, and names the place.

The set point runs down, never farther than `lead` ahead of the stage, and the effort is limited
to what moves a free stage and is no danger at the stop. Where the stage stands against that for
`stand`, it has met something. It backs off and feels for it again, slowly; what is met twice at the
same place is the stop. Then it leaves for the lowest target.
"""

from __future__ import annotations

import math

from macromicro.control import arrival
from macromicro.control.arrival import TICK
from macromicro.control.live import brake
from macromicro.control.live import messages as m
from macromicro.control.live import transitions as t
from macromicro.control.live.leading import (
    NEVER,
    REST,
    Guide,
    Guided,
    Touch,
    ahead,
    at,
    led,
    ramped,
)
from macromicro.control.live.messages import Notice
from macromicro.control.live.parameters import LiveParameters
from macromicro.control.live.state import Frame, LiveState, Search, position

DOWN, BACK, OUT = range(3)
_LEG = -2  # number of the profiles of a homing, which no motion has


def step(
    p: LiveParameters, q: Guide, s: LiveState, g: Guided, place: float, dt: float
) -> tuple[LiveState, Guided, tuple[Notice, ...]]:
    """One period of homing.

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
    work, motion, touch = s.work, s.motion, q.touch
    assert isinstance(work, Search) and motion is not None and touch is not None
    if s.time - motion.began >= touch.patience - TICK:
        s, notices = brake.start(p, s, m.STALLED, t.STALLED)
        return s, g, notices
    if work.phase == DOWN:
        return _down(p, q, touch, s, work, g, place, dt)
    return leave(p, q, touch, s, work, g, place, dt)


def leave(
    p: LiveParameters,
    q: Guide,
    touch: Touch,
    s: LiveState,
    work: Search,
    g: Guided,
    place: float,
    dt: float,
) -> tuple[LiveState, Guided, tuple[Notice, ...]]:
    """One period on the way back before the next touch; or, with what was found, to the lowest
    target, where the place is known.

    Parameters
    ----------
    p : LiveParameters
        Parameters of the live machine.
    q : Guide
        What leads the stage.
    touch : Touch
        How it finds its place.
    s : LiveState
        State of the live machine.
    work : Search
        How far the homing is.
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
    known = work.phase == OUT
    stop = work.stop * p.settings.pitch
    out = p.settings.limits.whole_low if math.isnan(touch.out) else touch.out
    goal = stop - touch.place + out if known else stop + touch.back
    g, late = led(_gently(q, touch), g, _LEG, goal, s.time, dt)
    if late < 0.0:
        return s, g, ()
    inside = arrival.since(q.arrival, goal - place, g.inside, s.time)
    g = g._replace(inside=inside)
    if not arrival.arrived(q.arrival, inside, s.time):
        return s, g, ()
    if not known:
        s = s._replace(work=work._replace(phase=DOWN, origin=s.seen.encoder))
        return s, g._replace(there=math.nan, motion=NEVER), ()
    return _homed(p, s, work, g, touch)


def _gently(q: Guide, touch: Touch) -> Guide:
    """The limits of the motion at the speed of a search."""
    return q._replace(velocity=min(touch.speed, q.velocity))


def _down(
    p: LiveParameters,
    q: Guide,
    touch: Touch,
    s: LiveState,
    work: Search,
    g: Guided,
    place: float,
    dt: float,
) -> tuple[LiveState, Guided, tuple[Notice, ...]]:
    pitch, second = p.settings.pitch, not math.isnan(work.stop)
    speed = touch.slow if second else touch.speed
    g = g._replace(aim=ramped(q, at(g.aim, dt), -speed, dt))
    g, held = ahead(touch, g, place)
    pushed = revealed(touch, work, g, place, pitch)
    if math.isnan(g.there) or abs(place - g.there) > touch.give or not (held or pushed):
        return s, g._replace(there=place, since=s.time), ()
    if s.time - g.since < touch.stand - TICK and not pushed:
        return s, g, ()
    sure = abs(place - work.stop * pitch) <= touch.give  # never of the first, whose stop is NaN
    cause = "end stop confirmed" if sure else "end stop found"
    event = t.reported(s, "move", cause, {"stop_raw_counts": s.seen.encoder})
    felt = work._replace(phase=OUT if sure else BACK, stop=s.seen.encoder, sure=sure)
    aim = REST._replace(position=place)  # what pushed against the stop is forgotten
    g = g._replace(aim=aim, restart=g.restart + 1, motion=NEVER, there=math.nan)
    return s._replace(work=felt), g, (event,)


def revealed(touch: Touch, work: Search, g: Guided, place: float, pitch: float) -> bool:
    """Whether a stage has stood for long enough under a push that moves a free one.

    One that has not moved since this way began is at the stop already, or shows no motion: it is
    not pushed for longer than it takes to see that.

    Parameters
    ----------
    touch : Touch
        How it finds its place.
    work : Search
        How far the homing is; its `origin` is where this way began.
    g : Guided
        State of the set point.
    place : float
        Where the stage is, m.
    pitch : float
        Way per count, m.

    Returns
    -------
    bool
        True: it stands.
    """
    unmoved = abs(place - work.origin * pitch) <= touch.give
    return g.leaning >= (min(touch.reveal, touch.stand) if unmoved else touch.stand) - TICK


def _homed(
    p: LiveParameters, s: LiveState, work: Search, g: Guided, touch: Touch
) -> tuple[LiveState, Guided, tuple[Notice, ...]]:
    """At the lowest target: the place is known from here on."""
    offset = float(round(work.stop - touch.place / p.settings.pitch))
    found = {
        "offset_raw_counts": offset,
        "stop_raw_counts": work.stop,
        "shift_counts": offset - s.frame.offset,
    }
    s = s._replace(frame=Frame(offset, 0.0, True, s.frame.zero, named=True))
    s = s._replace(seen=s.seen._replace(position=position(p, s)))
    trust = t.reported(s, "trust", "homed", {"trusted": True, **found})
    s, notices = t.conclude(p, s, m.READY, (m.DONE, t.HOMED), found)
    return s, g._replace(motion=NEVER), (trust, *notices)
