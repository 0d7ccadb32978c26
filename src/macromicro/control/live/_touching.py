"""Homing of a stage by touch: it finds its lower end stop twice, the second time slowly."""

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
    Period,
    Step,
    Touch,
    ahead,
    at,
    led,
    ramped,
)
from macromicro.control.live.parameters import LiveParameters
from macromicro.control.live.state import Frame, LiveState, Search, position

DOWN, BACK, OUT = range(3)
_LEG = -2  # number of the profiles of a homing, which no motion has


def step(now: Period, s: LiveState, g: Guided) -> Step:
    work, motion, touch = s.work, s.motion, now.q.touch
    assert isinstance(work, Search) and motion is not None and touch is not None
    if s.time - motion.began >= touch.patience - TICK:
        s, notices = brake.start(now.p, s, m.STALLED, t.STALLED)
        return s, g, notices
    if work.phase == DOWN:
        return _down(now, touch, s, work, g)
    return leave(now, touch, s, work, g)


def leave(now: Period, touch: Touch, s: LiveState, work: Search, g: Guided) -> Step:
    """One period of the way back before the next touch, or to the lowest target."""
    p, q, place, dt = now
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
    return q._replace(velocity=min(touch.speed, q.velocity))


def _down(now: Period, touch: Touch, s: LiveState, work: Search, g: Guided) -> Step:
    p, q, place, dt = now
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
    """Whether a stage has stood long enough under a push that moves a free one."""
    unmoved = abs(place - work.origin * pitch) <= touch.give
    return g.leaning >= (min(touch.reveal, touch.stand) if unmoved else touch.stand) - TICK


def _homed(p: LiveParameters, s: LiveState, work: Search, g: Guided, touch: Touch) -> Step:
    """Set the position at the lowest target."""
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
