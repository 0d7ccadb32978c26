"""A live stage led by set points follows those that a client streams."""

from __future__ import annotations

import math

from macromicro.control.arrival import TICK
from macromicro.control.live import alone, brake, following, tracking
from macromicro.control.live import messages as m
from macromicro.control.live import transitions as t
from macromicro.control.live.guided import let_go, reached, slowed
from macromicro.control.live.leading import Guided, Period, Step, braked, ramped
from macromicro.control.live.state import Followed, LiveState, Targets
from macromicro.control.live.tracking import Limits


def step(now: Period, s: LiveState, g: Guided) -> Step:
    """One period of a stage led by set points."""
    (p, q, place, dt), work, motion = now, s.work, s.motion
    assert isinstance(work, Followed) and motion is not None
    if g.motion != motion.id:  # the set point comes to rest first
        g = braked(q, g, dt)
        if g.aim.velocity != 0.0:
            return s, g, ()
        g, work = g._replace(motion=motion.id, inside=math.nan), work._replace(track=None)
    offset = s.frame.offset * p.settings.pitch
    low, high = following.bounds(p, s, motion)
    here = g.aim if work.track is None else work.track.aim
    # What begins outside of the limits comes back.
    least, most = min(low + offset, here.position), max(high + offset, here.position)
    limits = Limits(slowed(q, g).velocity, q.acceleration, q.jerk, least, most)
    track = tracking.start(limits, here) if work.track is None else work.track
    if following.lapsed(s):
        g = g._replace(aim=ramped(q, track.aim, 0.0, dt))
        s, notices = brake.start(p, s, m.LOST, t.LAPSED, following.facts(work))
        return s, g, notices
    goal = following.target(work, s.time, low, high, here.position - offset)
    goal = goal._replace(position=goal.position + offset)
    track, aim, later = tracking.step(limits, track, goal, dt)
    g = g._replace(aim=aim, later=later)
    s = s._replace(work=work._replace(track=track))
    if not work.ending or aim != goal:
        return s, g, ()
    entered = s.time if math.isnan(work.settle.entered) else work.settle.entered
    s = s._replace(work=work._replace(track=track, settle=work.settle._replace(entered=entered)))
    g, there = reached(q, g, goal.position, place, s.time)
    unit = p.settings.place
    found = {f"error_{unit.fine}": (goal.position - place) * unit.fines, **following.facts(work)}
    if there:
        whole = goal.position - offset
        s = s._replace(target=Targets(whole, alone.nearest(whole, p.settings.pitch)))
        s, event = t.go(s, m.SETTLING, t.ARRIVED, found)
        s, notices = t.conclude(p, s, m.READY, (m.DONE, t.SETTLED), found)
        return s, g, (event, *notices)
    if s.time - entered >= q.arrival.patience - TICK:
        s, notices = brake.start(p, s, m.STALLED, t.STALLED, found)
        return s, let_go(g, place), notices
    return s, g, ()
