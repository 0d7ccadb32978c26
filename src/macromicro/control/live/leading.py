"""The set point of a stage: profiles, ramps and deceleration."""

from __future__ import annotations

import math
from collections.abc import Iterable
from sys import float_info
from typing import NamedTuple

from macromicro.control.arrival import TICK
from macromicro.control.live import brake
from macromicro.control.live.messages import Evidence, Notice
from macromicro.control.live.parameters import LiveParameters
from macromicro.control.live.state import LiveState
from macromicro.motion import Segment, s_curve
from macromicro.types import QUIET, Lines

NEVER = -1  # number of no motion


class Ready(NamedTuple):
    # tolerance, dwell: m, and the time within it, s
    tolerance: float
    dwell: float
    patience: float  # longest wait for that after the profile's end, s


class Seek(NamedTuple):
    """How a stage finds a switch or an index pulse."""

    line: str  # of `types.Lines`: "limit_low", "home", or "" for an index pulse alone
    # whether the stage may stand below the switch while it is off, which it then finds upwards
    above: bool
    pulse: bool  # whether an index pulse names the place: the first one above the switch
    spacing: float  # from one pulse to the next, m; 0: there is one
    margin: float  # distance of switch and pulse, m, below which it is not sure which pulse it is
    rise: float  # speed off the switch and to the pulse, m/s


class Touch(NamedTuple):
    """How a stage finds the lower end stop, or with `seek` a switch."""

    speed: float  # of the search, m/s
    slow: float  # of the touch that counts, m/s
    effort: float  # greatest effort meanwhile, V
    lead: float  # farthest that the set point runs ahead of the stage, m
    stand: float  # time without motion against that effort which is taken for the stop, s
    give: float  # way that counts as no motion, and by which two touches may differ, m
    back: float  # way back between them, m
    place: float  # where the stage is while it leans on the stop, or at the switch or the pulse, m
    patience: float  # longest search, s
    seek: Seek | None = None  # how it finds a switch; None: the stop
    out: float = math.nan  # where it goes then, m; NaN: to the lowest target
    reveal: float = math.inf  # time within which a free stage moves under the guard's `lean`, s


class Guide(NamedTuple):
    # velocity, acceleration, jerk: limits, m/s and so on
    velocity: float
    acceleration: float
    jerk: float
    arrival: Ready
    # low, high: where the guard's soft limits are once the place is known, m
    low: float
    high: float
    touch: Touch | None = None  # how it finds its place; None: its sensor knows it
    leave: float = math.inf  # speed off a tripped limit switch, m/s
    rise: float = 0.0  # time from the enable line until the drive gives an effort, s
    heats: bool = False  # whether holding heats the actuator: stopped, it is let go
    # whether friction and a known weight hold it: its law restarts where it comes to rest
    rubs: bool = False


class Aim(NamedTuple):
    """A set point with its derivatives; the jerk is constant until the next one."""

    # position, velocity, acceleration, jerk: m, as the encoder has it, and m/s and so on
    position: float
    velocity: float
    acceleration: float
    jerk: float


REST = Aim(0.0, 0.0, 0.0, 0.0)
Piece = tuple[float, Aim]  # when it begins, s, and the set point there


class Course(NamedTuple):
    """What law and guard of the stage are given for the coming period."""

    on: bool = False  # whether the stage is under control; else its effort is 0
    aim: Aim = REST  # its set point at the begin of the period
    # low, high: soft limits, m as the encoder has it
    low: float = -math.inf
    high: float = math.inf
    effort: float = math.inf  # maximum effort, V
    restart: int = 0  # with another number than before, the law restarts
    waiting: bool = False  # whether the drive is being switched on: the law gives no effort yet
    homing: bool = False  # whether the lower limit switch is looked for
    speed: float = math.inf  # greatest speed that the guard allows, m/s
    # longest time under the guard's `lean` without motion, s; infinite: that of the settings
    leant: float = math.inf
    later: tuple[Piece, ...] = ()  # where the polynomial of its set point changes in the period
    origin: float = math.nan  # position 0, m as the encoder has it; NaN: not known


class Guided(NamedTuple):
    aim: Aim = REST  # the one of the last period
    on: bool = False  # whether the stage is under control
    restart: int = 0  # as of `Course`
    motion: int = NEVER  # number of the motion that the profile is of
    pieces: tuple[Segment, ...] = ()
    began: float = 0.0
    inside: float = math.nan  # since when the stage is within the tolerance, s, or NaN
    there: float = math.nan  # where a search has last seen motion, m, or NaN
    since: float = 0.0
    lines: Lines = QUIET
    # for how long the stage has stood under an effort that moves a free one, s
    leaning: float = 0.0
    # whether the switch that a homing looks for is on, each look for long enough
    switch: bool = False
    turned: float = math.nan  # since when it says otherwise, s; NaN: it does not
    edge: float = math.nan  # where the stage was at the first of these looks, counts
    on_since: float = 0.0  # when the stage was switched on, s
    # off_low, off_high: whether it is on its way back from that limit switch into its soft limits
    off_low: bool = False
    off_high: bool = False
    stood: float = math.inf  # its reading when it last changed, m
    asked: float = 0.0  # where the set point was then, m
    stood_since: float = 0.0
    calm: bool = False  # whether it has been let go where it rests since its last motion
    leant: float = -math.inf  # when it last leaned on something as it came to rest, s
    later: tuple[Piece, ...] = ()  # as of `Course`


Step = tuple[LiveState, Guided, tuple[Notice, ...]]


class Period(NamedTuple):
    """What is the same for whatever a stage does in a control period."""

    p: LiveParameters
    q: Guide
    place: float  # of the stage, m, as the encoder has it
    dt: float  # s


def at(aim: Aim, h: float) -> Aim:
    p, v, a, j = aim
    return Aim(p + h * (v + h * (0.5 * a + h * j / 6.0)), v + h * (a + 0.5 * h * j), a + h * j, j)


def later(pieces: Iterable[Segment], goal: float, begin: float, dt: float) -> tuple[Piece, ...]:
    """Pieces up to a goal, from a time of the coming period on, as far as it reaches them."""
    found = []
    for piece in (*pieces, Segment(math.inf, goal, 0.0, 0.0, 0.0)):
        if begin >= dt - TICK:
            break
        found.append((begin, Aim(*piece[1:])))
        begin += piece.duration
    return tuple(found)


def ramp(q: Guide, aim: Aim, goal: float, dt: float) -> Aim:
    """A set point that approaches a speed at the greatest acceleration."""
    change = min(max(goal - aim.velocity, -q.acceleration * dt), q.acceleration * dt)
    return Aim(aim.position, aim.velocity, change / dt, 0.0)


def decelerate(q: Guide, g: Guided, dt: float) -> Guided:
    """The set point a period later while it decelerates."""
    aim = at(g.aim, dt)
    if abs(aim.velocity) <= q.velocity * 1e-9:
        return g._replace(aim=REST._replace(position=aim.position))
    return g._replace(aim=ramp(q, aim, 0.0, dt))


def lead(
    q: Guide, g: Guided, motion: int, goal: float, now: float, dt: float
) -> tuple[Guided, float]:
    """The set point on the quickest profile to a goal."""
    if g.motion != motion:
        g = decelerate(q, g, dt)
        if g.aim.velocity != 0.0:
            return g, -math.inf
        here = g.aim.position
        way = goal - here
        if abs(way) < float_info.min:  # so short that no time is left of its profile
            way = 0.0
        profile = s_curve(way, q.velocity, q.acceleration, q.jerk, start=here)
        g = g._replace(motion=motion, pieces=profile.segments, began=now, inside=math.nan)
    since = now - g.began
    for k, piece in enumerate(g.pieces):
        left = piece.duration - since
        if left > TICK:
            coming = later(g.pieces[k + 1 :], goal, left, dt)
            return g._replace(aim=at(Aim(*piece[1:]), since), later=coming), -math.inf
        since -= piece.duration
    return g._replace(aim=REST._replace(position=goal)), since


def to_rest(
    p: LiveParameters,
    s: LiveState,
    g: Guided,
    outcome: str,
    cause: str,
    found: Evidence | None = None,
) -> Step:
    """Begin to brake; the motion is reported to have ended like this."""
    s, notices = brake.start(p, s, outcome, cause, found)
    return s, g, notices


def ahead(q: Touch, g: Guided, place: float) -> tuple[Guided, bool]:
    """The set point, no farther ahead of the stage than a search allows."""
    off = g.aim.position - place
    held = place + math.copysign(q.lead, off)
    if abs(off) <= q.lead:
        return g, abs(off) > max(q.lead - q.give, 0.5 * q.lead)
    return g._replace(aim=g.aim._replace(position=held)), True
