"""Homing of a stage: by touch, on a switch, at an index pulse, or at the one next to a switch.

By touch it finds its lower end stop twice, the second time slowly.
"""

from __future__ import annotations

import math

from macromicro.control import arrival
from macromicro.control.arrival import TICK
from macromicro.control.live import messages as m
from macromicro.control.live import transitions as t
from macromicro.control.live.leading import (
    NEVER,
    REST,
    Guide,
    Guided,
    Period,
    Seek,
    Step,
    Touch,
    ahead,
    at,
    lead,
    ramp,
    to_rest,
)
from macromicro.control.live.messages import Evidence
from macromicro.control.live.parameters import LiveParameters
from macromicro.control.live.state import LiveState, Search

DOWN, BACK, OUT = range(3)  # by touch
_LEG = -2  # number of the profiles of a homing, which no motion has


def touch_stop(now: Period, s: LiveState, g: Guided) -> Step:
    work, motion, touch = s.work, s.motion, now.q.touch
    assert isinstance(work, Search) and motion is not None and touch is not None
    if s.time - motion.began >= touch.patience - TICK:
        return to_rest(now.p, s, g, m.STALLED, t.STALLED)
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
    g, late = lead(_gently(q, touch), g, _LEG, goal, s.time, dt)
    if late < 0.0:
        return s, g, ()
    inside = arrival.since(q.arrival, goal - place, g.inside, s.time)
    g = g._replace(inside=inside)
    if not arrival.arrived(q.arrival, inside, s.time):
        return s, g, ()
    if not known:
        s = s._replace(work=work._replace(phase=DOWN, origin=s.seen.encoder))
        return s, g._replace(there=math.nan, motion=NEVER), ()
    offset = float(round(work.stop - touch.place / p.settings.pitch))
    s, notices = t.homed(p, s, offset, work.stop)
    return s, g._replace(motion=NEVER), notices


def _gently(q: Guide, touch: Touch) -> Guide:
    return q._replace(velocity=min(touch.speed, q.velocity))


def _down(now: Period, touch: Touch, s: LiveState, work: Search, g: Guided) -> Step:
    p, q, place, dt = now
    pitch, second = p.settings.pitch, not math.isnan(work.stop)
    speed = touch.slow if second else touch.speed
    g = g._replace(aim=ramp(q, at(g.aim, dt), -speed, dt))
    g, held = ahead(touch, g, place)
    pushed = is_revealed(touch, work, g, place, pitch)
    if math.isnan(g.there) or abs(place - g.there) > touch.give or not (held or pushed):
        return s, g._replace(there=place, since=s.time), ()
    if s.time - g.since < touch.stand - TICK and not pushed:
        return s, g, ()
    sure = abs(place - work.stop * pitch) <= touch.give  # never of the first, whose stop is NaN
    cause = "end stop confirmed" if sure else "end stop found"
    event = t.report(s, "move", cause, {"stop_raw_counts": s.seen.encoder})
    felt = work._replace(phase=OUT if sure else BACK, stop=s.seen.encoder, sure=sure)
    aim = REST._replace(position=place)  # what pushed against the stop is forgotten
    g = g._replace(aim=aim, restart=g.restart + 1, motion=NEVER, there=math.nan)
    return s._replace(work=felt), g, (event,)


def is_revealed(touch: Touch, work: Search, g: Guided, place: float, pitch: float) -> bool:
    """Whether a stage has stood long enough under a push that moves a free one."""
    unmoved = abs(place - work.origin * pitch) <= touch.give
    return g.leaning >= (min(touch.reveal, touch.stand) if unmoved else touch.stand) - TICK


SEEK, RISE, _, UP, EDGE, PULSE, CHECK = range(7)  # else; `OUT` as by touch
HOLDS, LOOKS = 2.5e-3, 2  # s, and looks; a switch that says the same for longer has turned
TRIES = 4  # times that an edge or pulse may be found elsewhere
SAME = 2.5  # counts between two findings of one pulse
_WHY = {
    SEEK: "it came to rest, and no switch was on",
    RISE: "it came to rest with the switch still on",
    UP: "it came to rest above, and no switch was on",
    EDGE: "it came to rest before the switch was on again",
    PULSE: "it came to rest, and no index pulse came",
}


def seek_switch(now: Period, s: LiveState, g: Guided) -> Step:
    (p, q, place, dt), work, motion = now, s.work, s.motion
    touch = q.touch
    assert isinstance(work, Search) and motion is not None and touch is not None
    seek = touch.seek
    assert seek is not None
    if s.time - motion.began >= touch.patience - TICK:
        return to_rest(p, s, g, m.STALLED, t.STALLED)
    if work.phase == OUT:
        return leave(now, touch, s, work, g)
    slow = {SEEK: -touch.speed, UP: touch.speed, EDGE: -touch.slow, CHECK: -seek.rise}
    g = g._replace(aim=ramp(q, at(g.aim, dt), slow.get(work.phase, seek.rise), dt))
    g, held = ahead(touch, g, place)
    if math.isnan(g.there) or not held or abs(place - g.there) > touch.give:
        g = g._replace(there=place, since=s.time)
    stands = s.time - g.since >= touch.stand - TICK
    stands = stands or is_revealed(touch, work, g, place, p.settings.pitch)
    return _judge(now, touch, s, work, g, stands)


def on(seek: Seek, g: Guided) -> bool:
    return seek.line != "" and bool(getattr(g.lines, seek.line) == 1.0)


def debounce(g: Guided, said: bool, now: float, here: float, dt: float) -> Guided:
    """The debounced state of a switch, and the count at which it began."""
    if said == g.switch:
        return g._replace(turned=math.nan)
    if math.isnan(g.turned):
        return g._replace(turned=now, edge=here)
    if now - g.turned < max(HOLDS, LOOKS * dt) - TICK:
        return g
    return g._replace(switch=said, turned=math.nan)


def _judge(now: Period, touch: Touch, s: LiveState, work: Search, g: Guided, stands: bool) -> Step:
    """What this period's lines say, and whether the stage stands at an obstacle."""
    p, place = now.p, now.place
    seek, lines = touch.seek, g.lines
    assert seek is not None
    step: Step | None = None
    if not seek.line and work.phase in (SEEK, UP) and not math.isnan(lines.index_count):
        found = work._replace(stop=lines.index_count, expected=-math.inf)
        step = _next(s, found, g, CHECK, "index pulse found")
    elif work.phase in (SEEK, UP) and g.switch:
        step = _next(s, work._replace(expected=math.nan), g, RISE, "switch found")
    elif work.phase == SEEK and (stands or lines.limit_low == 1.0) and _may_turn(seek):
        if stands:  # what pushed is forgotten
            g = g._replace(aim=REST._replace(position=place), restart=g.restart + 1)
        step = _next(s, work, g, UP, "end of travel")
    elif work.phase == RISE:
        free = math.nan if g.switch else g.edge if math.isnan(work.expected) else work.expected
        risen = place >= free * p.settings.pitch + touch.back
        s = s._replace(work=work._replace(expected=free, phase=EDGE if risen else RISE))
    elif work.phase == EDGE and g.switch:
        step = _edge(now, seek, s, work, g)
    elif work.phase == PULSE:
        step = _pulse(now, touch, seek, s, work, g)
    elif work.phase == CHECK and (stands or place <= work.stop * p.settings.pitch - touch.back):
        step = _next(s, work, g, PULSE, "again")
    if step is None and stands:
        step = _given_up(p, s, g, {"reason": _WHY[work.phase]})
    return (s, g, ()) if step is None else step


def _edge(now: Period, seek: Seek, s: LiveState, work: Search, g: Guided) -> Step:
    """Compare a slowly found edge with the previous one."""
    p, place = now.p, now.place
    apart = abs(g.edge - work.stop) * p.settings.pitch
    if not apart <= seek.margin:
        if work.tries >= TRIES:
            reason = (
                f"the edge of the switch is at places {1e3 * apart:.4g} mm apart, which is more "
                f"than {1e3 * seek.margin:.4g} mm: check the switch and its wires"
            )
            return _given_up(p, s, g, {"reason": reason})
        again = work._replace(stop=g.edge, expected=math.nan, tries=work.tries + 1)
        return _next(s, again, g, RISE, "switch confirmed")
    if not seek.pulse:
        return _set_position(s, work, g, place, g.edge)
    found = work._replace(expected=g.edge, stop=math.nan, tries=0)
    return _next(s, found, g, PULSE, "switch confirmed")


def _may_turn(seek: Seek) -> bool:
    """Whether the sought switch may lie above the end of travel."""
    return seek.above or not seek.line


def _pulse(
    now: Period, touch: Touch, seek: Seek, s: LiveState, work: Search, g: Guided
) -> Step | None:
    """Verify the first index pulse above the edge."""
    p, place = now.p, now.place
    pitch, count = p.settings.pitch, g.lines.index_count
    if not count >= work.expected:
        return _no_pulse(now, touch, seek, s, work, g)
    above = (count - work.expected) * pitch
    near = min(above, seek.spacing - above) if seek.spacing > 0.0 else above
    if seek.line and near < seek.margin:
        reason = (
            f"the index pulse is {1e3 * near:.4g} mm from the edge of the switch, which is "
            f"uncertain by {1e3 * seek.margin:.4g} mm: move the switch"
        )
        return _given_up(p, s, g, {"reason": reason, "index_from_switch_um": 1e6 * near})
    if abs(count - work.stop) <= SAME:
        return _set_position(s, work, g, place, count)
    if work.tries >= TRIES:
        return _given_up(p, s, g, {"reason": "the index pulses come at varying positions"})
    found = work._replace(stop=count, tries=work.tries + 1)
    return _next(s, found, g, CHECK, "index pulse found")


def _no_pulse(
    now: Period, touch: Touch, seek: Seek, s: LiveState, work: Search, g: Guided
) -> Step | None:
    p, place = now.p, now.place
    pitch = p.settings.pitch
    if seek.line and place - work.expected * pitch > 1.5 * seek.spacing > 0.0:
        reason = "no index pulse within 1.5 turns above the switch"
        return _given_up(p, s, g, {"reason": reason})
    if not place > work.stop * pitch + touch.back:  # NaN: none has come yet
        return None
    again = work._replace(stop=math.nan, tries=work.tries + 1)
    if again.tries > TRIES:
        return _given_up(p, s, g, {"reason": "an index pulse came only once"})
    return _next(s, again, g, PULSE if seek.line else SEEK, "index pulse not confirmed")


def _next(s: LiveState, work: Search, g: Guided, phase: int, cause: str) -> Step:
    event = t.report(s, "move", cause, {"raw_counts": s.seen.encoder})
    work = work._replace(phase=phase, origin=s.seen.encoder)
    return s._replace(work=work), g._replace(there=math.nan), (event,)


def _set_position(s: LiveState, work: Search, g: Guided, place: float, count: float) -> Step:
    """Set the position by the count of the home position."""
    event = t.report(s, "move", "place found", {"raw_counts": count})
    aim = REST._replace(position=place)
    g = g._replace(aim=aim, restart=g.restart + 1, motion=NEVER, there=math.nan)
    return s._replace(work=work._replace(phase=OUT, stop=count)), g, (event,)


def _given_up(p: LiveParameters, s: LiveState, g: Guided, found: Evidence) -> Step:
    return to_rest(p, s, g, m.STALLED, t.STALLED, found)
