"""Set points that a client streams, and hold times."""

from __future__ import annotations

import math
from typing import Any

from macromicro.control.arrival import TICK
from macromicro.control.live import messages as m
from macromicro.control.live import tracking
from macromicro.control.live import transitions as t
from macromicro.control.live.leading import REST, Aim, Piece
from macromicro.control.live.messages import Evidence, Notice
from macromicro.control.live.parameters import LiveParameters
from macromicro.control.live.state import Followed, Jogged, LiveState, Motion
from macromicro.control.live.tracking import Limits


def bounds(p: LiveParameters, s: LiveState, motion: Motion) -> tuple[float, float]:
    """Soft limits of the stage that follows, m."""
    q = s.limits
    if motion.kind == f"follow {m.MICRO}":
        return q.micro_low, q.micro_high
    return q.macro_low * p.settings.pitch, q.macro_high * p.settings.pitch


def take_set_point(
    p: LiveParameters, s: LiveState, position: float, velocity: float, age: float
) -> tuple[LiveState, tuple[Notice, ...]]:
    """The machine after a set point that is `age` seconds old; nothing where it does not follow."""
    work, motion = s.work, s.motion
    if not isinstance(work, Followed) or motion is None or work.ending:
        return s, ()
    low, high = bounds(p, s, motion)
    clipped = not low <= position <= high
    since = s.time - min(max(age, 0.0), work.hold)
    work = work._replace(
        heard=s.time,
        place=position,
        speed=velocity,
        since=since,
        points=work.points + 1,
        clipped=work.clipped + clipped,
    )
    s = s._replace(work=work)
    if not clipped or work.clipped > 1:
        return s, ()
    place = p.settings.place
    names = (f"position_{place.unit}", f"low_{place.unit}", f"high_{place.unit}")
    values = (each * place.per for each in (position, low, high))
    facts: Evidence = dict(zip(names, values, strict=True))
    return s, (t.report(s, "follow", "set point clipped to the soft limits", facts),)


def renew(s: LiveState) -> LiveState:
    """The machine after its client has renewed a jog."""
    if not isinstance(s.work, Jogged):
        return s
    return s._replace(work=s.work._replace(renewed=s.time))


def has_lapsed(s: LiveState) -> bool:
    """Whether a jog was not renewed, or no set point came, for the hold time."""
    work = s.work
    if isinstance(work, Jogged):
        return work.hold > 0.0 and s.time - work.renewed > work.hold + TICK
    if isinstance(work, Followed):
        return not work.ending and s.time - work.heard > work.hold + TICK
    return False


def facts(work: Any) -> Evidence:
    """The evidence of what a hold time has ended, or of what was followed."""
    found: Evidence = {"hold_s": work.hold}
    if isinstance(work, Followed):
        found |= {"set_points": work.points, "clipped": work.clipped}
    return found


def lacking(left: int, cut_off: Evidence | None) -> Evidence:
    """What a programme has left out at its end; nothing if all moves were made."""
    found: Evidence = {"moves_left": left} if left else {}
    return found | {f"cut_off_{name}": value for name, value in (cut_off or {}).items()}


def led(
    work: Followed,
    rates: tuple[float, float, float],
    ends: tuple[float, float],
    here: Aim,
    now: float,
    dt: float,
    offset: float = 0.0,
) -> tuple[Followed, Aim, Aim, tuple[Piece, ...]]:
    """The set point of a stage from `here` towards the client's, within speed, acceleration and
    jerk: the work after it, the client's, this period's, and where its polynomial changes.

    `here` is in the encoder's own frame, which is `offset` ahead of that of the soft limits `ends`.
    """
    low, high = ends
    # What begins outside of the limits comes back.
    least, most = min(low + offset, here.position), max(high + offset, here.position)
    limits = Limits(*rates, least, most)
    track = tracking.start(limits, here) if work.track is None else work.track
    goal = target(work, now, low, high, here.position - offset)
    goal = goal._replace(position=goal.position + offset)
    track, aim, later = tracking.step(limits, track, goal, dt)
    return work._replace(track=track), goal, aim, later


def target(work: Followed, now: float, low: float, high: float, here: float) -> Aim:
    """The set point now, which goes on with its velocity; at a soft limit it stands."""
    if math.isnan(work.place):
        return REST._replace(position=here)
    place = work.place if work.ending else work.place + work.speed * (now - work.since)
    if not low < place < high or work.ending:
        return REST._replace(position=min(max(place, low), high))
    return Aim(place, work.speed, 0.0, 0.0)
