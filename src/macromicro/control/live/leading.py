"""The set point that leads a stage: profiles, ramps and coming to rest."""

from __future__ import annotations

import math
from sys import float_info
from typing import NamedTuple

from macromicro.control.arrival import TICK
from macromicro.motion import Segment, s_curve
from macromicro.types import QUIET, Lines

NEVER = -1  # number of no motion


class Ready(NamedTuple):
    """When a stage counts as arrived.

    Attributes
    ----------
    tolerance, dwell : float
        m, and the time within it, s.
    patience : float
        Longest wait for that after the profile's end, s.
    """

    tolerance: float
    dwell: float
    patience: float


class Seek(NamedTuple):
    """How a stage finds a switch or an index pulse, which names its place.

    Attributes
    ----------
    line : str
        Of `types.Lines`: "limit_low", "home", or "" for an index pulse alone.
    above : bool
        Whether the stage may stand below the switch while it is off, which it then finds upwards.
    pulse : bool
        Whether an index pulse names the place: the first one above the switch.
    spacing : float
        From one pulse to the next, m; 0: there is one.
    margin : float
        Distance of switch and pulse, m, below which it is not sure which pulse it is.
    rise : float
        Speed off the switch and to the pulse, m/s.
    """

    line: str
    above: bool
    pulse: bool
    spacing: float
    margin: float
    rise: float


class Touch(NamedTuple):
    """How a stage finds the lower end stop, which names its place; or, with `seek`, a switch.

    Attributes
    ----------
    speed : float
        Of the search, m/s.
    slow : float
        Of the touch that counts, m/s.
    effort : float
        Greatest effort meanwhile, V.
    lead : float
        Farthest that the set point runs ahead of the stage, m.
    stand : float
        Time without motion against that effort which is taken for the stop, s.
    give : float
        Way that counts as no motion, and by which two touches may differ, m.
    back : float
        Way back between them, m.
    place : float
        Where the stage is while it leans on the stop, or at the switch or the pulse, m.
    patience : float
        Longest search, s.
    seek : Seek | None
        How it finds a switch; None: the stop.
    out : float
        Where it goes then, m; NaN: to the lowest target.
    reveal : float
        Time within which a free stage moves under the guard's `lean`, s.
    """

    speed: float
    slow: float
    effort: float
    lead: float
    stand: float
    give: float
    back: float
    place: float
    patience: float
    seek: Seek | None = None
    out: float = math.nan
    reveal: float = math.inf


class Guide(NamedTuple):
    """What leads a stage.

    Attributes
    ----------
    velocity, acceleration, jerk : float
        Limits, m/s and so on.
    arrival : Ready
        When it has arrived.
    low, high : float
        Where the guard's soft limits are once the place is known, m.
    touch : Touch | None
        How it finds its place; None: its sensor knows it.
    leave : float
        Speed off a tripped limit switch, m/s.
    rise : float
        Time from the enable line until the drive gives an effort, s.
    heats : bool
        Whether holding heats the actuator: stopped, it is let go.
    """

    velocity: float
    acceleration: float
    jerk: float
    arrival: Ready
    low: float
    high: float
    touch: Touch | None = None
    leave: float = math.inf
    rise: float = 0.0
    heats: bool = False


class Aim(NamedTuple):
    """A set point with its derivatives, of constant jerk until the next one.

    Attributes
    ----------
    position, velocity, acceleration, jerk : float
        m, as the encoder has it, and m/s and so on.
    """

    position: float
    velocity: float
    acceleration: float
    jerk: float


REST = Aim(0.0, 0.0, 0.0, 0.0)


class Course(NamedTuple):
    """What the law of the stage and its guard are given for the coming period.

    Attributes
    ----------
    on : bool
        Whether the stage is under control; else its effort is 0.
    aim : Aim
        Its set point at the begin of the period.
    low, high : float
        Soft limits, m as the encoder has it.
    effort : float
        Greatest effort, V.
    restart : int
        With another number than before, the law begins anew.
    waiting : bool
        Whether the drive is being switched on: the law gives no effort yet.
    homing : bool
        Whether the lower limit switch is looked for.
    speed : float
        Greatest speed that the guard allows, m/s.
    leant : float
        Longest time under the guard's `lean` without motion, s; infinite: that of the settings.
    """

    on: bool = False
    aim: Aim = REST
    low: float = -math.inf
    high: float = math.inf
    effort: float = math.inf
    restart: int = 0
    waiting: bool = False
    homing: bool = False
    speed: float = math.inf
    leant: float = math.inf


class Guided(NamedTuple):
    """State of the set point.

    Attributes
    ----------
    aim : Aim
        The one of the last period.
    on : bool
        Whether the stage is under control.
    restart : int
        As of `Course`.
    motion : int
        Number of the motion that the profile is of.
    pieces : tuple[Segment, ...]
        The profile.
    began : float
        When it began, s.
    inside : float
        Since when the stage is within the tolerance, s, or NaN.
    there : float
        Where a search has last seen motion, m, or NaN.
    since : float
        When, s.
    lines : Lines
        What the switches say.
    leaning : float
        For how long the stage has stood under an effort that moves a free one, s.
    switch : bool
        Whether the switch that a homing looks for is on, each look for long enough.
    turned : float
        Since when it says otherwise, s; NaN: it does not.
    edge : float
        Where the stage was at the first of these looks, counts.
    on_since : float
        When the stage was switched on, s.
    off_low, off_high : bool
        Whether it is on its way back from that limit switch into its soft limits.
    """

    aim: Aim = REST
    on: bool = False
    restart: int = 0
    motion: int = NEVER
    pieces: tuple[Segment, ...] = ()
    began: float = 0.0
    inside: float = math.nan
    there: float = math.nan
    since: float = 0.0
    lines: Lines = QUIET
    leaning: float = 0.0
    switch: bool = False
    turned: float = math.nan
    edge: float = math.nan
    on_since: float = 0.0
    off_low: bool = False
    off_high: bool = False


def at(aim: Aim, h: float) -> Aim:
    """A set point a time `h` later.

    Parameters
    ----------
    aim : Aim
        Now.
    h : float
        s.

    Returns
    -------
    Aim
        Of the same jerk.
    """
    p, v, a, j = aim
    return Aim(p + h * (v + h * (0.5 * a + h * j / 6.0)), v + h * (a + 0.5 * h * j), a + h * j, j)


def ramped(q: Guide, aim: Aim, goal: float, dt: float) -> Aim:
    """A set point that comes nearer to a speed, at the greatest acceleration.

    Parameters
    ----------
    q : Guide
        What leads the stage.
    aim : Aim
        The set point now.
    goal : float
        m/s.
    dt : float
        Control period, s.

    Returns
    -------
    Aim
        Now, with the acceleration until the next period.
    """
    change = min(max(goal - aim.velocity, -q.acceleration * dt), q.acceleration * dt)
    return Aim(aim.position, aim.velocity, change / dt, 0.0)


def braked(q: Guide, g: Guided, dt: float) -> Guided:
    """The set point a period later on its way to rest, or at rest.

    Parameters
    ----------
    q : Guide
        What leads the stage.
    g : Guided
        State of the set point.
    dt : float
        Control period, s.

    Returns
    -------
    Guided
        New state.
    """
    aim = at(g.aim, dt)
    if abs(aim.velocity) <= q.velocity * 1e-9:
        return g._replace(aim=REST._replace(position=aim.position))
    return g._replace(aim=ramped(q, aim, 0.0, dt))


def led(
    q: Guide, g: Guided, motion: int, goal: float, now: float, dt: float
) -> tuple[Guided, float]:
    """The set point on the quickest profile to a goal, from where it comes to rest.

    Parameters
    ----------
    q : Guide
        What leads the stage.
    g : Guided
        State of the set point.
    motion : int
        Number of the motion; another one than before begins a profile.
    goal : float
        m.
    now : float
        s.
    dt : float
        Control period, s.

    Returns
    -------
    guided : Guided
        New state.
    late : float
        Time since the profile's end, s; below 0 before.
    """
    if g.motion != motion:
        g = braked(q, g, dt)
        if g.aim.velocity != 0.0:
            return g, -math.inf
        here = g.aim.position
        way = goal - here
        if abs(way) < float_info.min:  # so short that no time is left of its profile
            way = 0.0
        profile = s_curve(way, q.velocity, q.acceleration, q.jerk, start=here)
        g = g._replace(motion=motion, pieces=profile.segments, began=now, inside=math.nan)
    since = now - g.began
    for piece in g.pieces:
        if since < piece.duration - TICK:
            return g._replace(aim=at(Aim(*piece[1:]), since)), -math.inf
        since -= piece.duration
    return g._replace(aim=REST._replace(position=goal)), since


def ahead(q: Touch, g: Guided, place: float) -> tuple[Guided, bool]:
    """The set point no farther ahead of the stage than a search allows.

    A stage whose reading dithers by less than `give` stands, and holds the set point back.

    Parameters
    ----------
    q : Touch
        How the stage finds its place.
    g : Guided
        State of the set point.
    place : float
        Where the stage is, m.

    Returns
    -------
    guided : Guided
        New state.
    held : bool
        Whether the stage holds the set point back.
    """
    off = g.aim.position - place
    held = place + math.copysign(q.lead, off)
    if abs(off) <= q.lead:
        return g, abs(off) > max(q.lead - q.give, 0.5 * q.lead)
    return g._replace(aim=g.aim._replace(position=held)), True
