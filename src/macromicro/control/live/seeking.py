"""Homing of a stage that is led on a switch, an index pulse, or the pulse next to a switch.

Down until the switch is on (up, where a cam was below), up until it lets go and a little farther,
and down again slowly: where it trips then is its edge. The place is that of the edge, or of the
first index pulse above it, whose count the counter has captured. Then it leaves for the lowest
target.
"""

from __future__ import annotations

import math

from macromicro.control.arrival import TICK
from macromicro.control.live import brake, touching
from macromicro.control.live import messages as m
from macromicro.control.live import transitions as t
from macromicro.control.live.leading import (
    NEVER,
    REST,
    Guide,
    Guided,
    Seek,
    Touch,
    ahead,
    at,
    ramped,
)
from macromicro.control.live.messages import Evidence, Notice
from macromicro.control.live.parameters import LiveParameters
from macromicro.control.live.state import LiveState, Search

SEEK, RISE, OUT, UP, EDGE, PULSE = range(6)  # OUT as in `touching`
_WHY = {
    SEEK: "it stands, and no switch was on",
    RISE: "it stands, and the switch stays on",
    UP: "it stands above, and no switch was on",
    EDGE: "it stands before the switch is on again",
    PULSE: "it stands, and no index pulse came",
}
Step = tuple[LiveState, Guided, tuple[Notice, ...]]


def step(p: LiveParameters, q: Guide, s: LiveState, g: Guided, place: float, dt: float) -> Step:
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
    seek = touch.seek
    assert seek is not None
    if s.time - motion.began >= touch.patience - TICK:
        s, notices = brake.start(p, s, m.STALLED, t.STALLED)
        return s, g, notices
    if work.phase == OUT:
        return touching.leave(p, q, touch, s, work, g, place, dt)
    goal = {SEEK: -touch.speed, UP: touch.speed, EDGE: -touch.slow}.get(work.phase, seek.rise)
    g = g._replace(aim=ramped(q, at(g.aim, dt), goal, dt))
    g, held = ahead(touch, g, place)
    if math.isnan(g.there) or not held or abs(place - g.there) > touch.give:
        g = g._replace(there=place, since=s.time)
    stands = s.time - g.since >= touch.stand - TICK
    return _judged(p, touch, s, work, g, place, stands)


def _judged(
    p: LiveParameters,
    touch: Touch,
    s: LiveState,
    work: Search,
    g: Guided,
    place: float,
    stands: bool,
) -> Step:
    """What this period's lines say, and whether the stage stands against something."""
    seek, lines, here = touch.seek, g.lines, s.seen.encoder
    assert seek is not None
    on = seek.line != "" and getattr(lines, seek.line) == 1.0
    step: Step | None = None
    if not seek.line and not math.isnan(lines.index_count):
        step = _named(s, work, g, place, lines.index_count)
    elif work.phase in (SEEK, UP) and on:
        step = _next(s, work._replace(expected=math.nan), g, RISE, "switch found")
    elif work.phase == SEEK and (stands or lines.limit_low == 1.0) and _may_turn(seek):
        if stands:  # what pushed is forgotten
            g = g._replace(aim=REST._replace(position=place), restart=g.restart + 1)
        step = _next(s, work, g, UP, "end of the way")
    elif work.phase == RISE:
        free = math.nan if on else here if math.isnan(work.expected) else work.expected
        risen = place >= free * p.settings.pitch + touch.back
        s = s._replace(work=work._replace(expected=free, phase=EDGE if risen else RISE))
    elif work.phase == EDGE and on and seek.pulse:
        step = _next(s, work._replace(expected=here), g, PULSE, "switch confirmed")
    elif work.phase == EDGE and on:
        step = _named(s, work, g, place, here)
    elif work.phase == PULSE:
        step = _pulse(p, seek, s, work, g, place)
    if step is None and stands:
        step = _given_up(p, s, g, {"reason": _WHY[work.phase]})
    return (s, g, ()) if step is None else step


def _may_turn(seek: Seek) -> bool:
    """Whether what is looked for may be above where the way ends."""
    return seek.above or not seek.line


def _pulse(
    p: LiveParameters, seek: Seek, s: LiveState, work: Search, g: Guided, place: float
) -> Step | None:
    """The first index pulse above the edge: is it sure that it is that one?"""
    pitch, count = p.settings.pitch, g.lines.index_count
    if not count >= work.expected:
        gone = place - work.expected * pitch > 1.5 * seek.spacing > 0.0
        reason = "no index pulse within a turn and a half above the switch"
        return _given_up(p, s, g, {"reason": reason}) if gone else None
    above = (count - work.expected) * pitch
    near = min(above, seek.spacing - above) if seek.spacing > 0.0 else above
    if near >= seek.margin:
        return _named(s, work, g, place, count)
    reason = (
        f"the index pulse is {1e3 * near:.4g} mm from the edge of the switch, which is uncertain "
        f"by {1e3 * seek.margin:.4g} mm: move the switch"
    )
    return _given_up(p, s, g, {"reason": reason, "index_from_switch_um": 1e6 * near})


def _next(s: LiveState, work: Search, g: Guided, phase: int, cause: str) -> Step:
    """The next way."""
    event = t.reported(s, "move", cause, {"raw_counts": s.seen.encoder})
    return s._replace(work=work._replace(phase=phase)), g._replace(there=math.nan), (event,)


def _named(s: LiveState, work: Search, g: Guided, place: float, count: float) -> Step:
    """The count of the known place: out from here."""
    event = t.reported(s, "move", "place found", {"raw_counts": count})
    aim = REST._replace(position=place)
    g = g._replace(aim=aim, restart=g.restart + 1, motion=NEVER, there=math.nan)
    return s._replace(work=work._replace(phase=OUT, stop=count)), g, (event,)


def _given_up(p: LiveParameters, s: LiveState, g: Guided, found: Evidence) -> Step:
    s, notices = brake.start(p, s, m.STALLED, t.STALLED, found)
    return s, g, notices
