"""State of the live machine. Raw counts are the encoder's own, without an offset."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from macromicro.control import macro, micro, settings
from macromicro.control.live import messages as m
from macromicro.control.live import survey
from macromicro.control.live.parameters import LiveParameters, SoftLimits
from macromicro.control.live.survey import NOTHING, Survey
from macromicro.control.macro import Memory
from macromicro.control.outside import Kept
from macromicro.control.settings import Control
from macromicro.control.supervisor import Plan, Progress, Supervisor

NAN = math.nan


class Seen(NamedTuple):
    """Last good readings; NaN before the first."""

    encoder: float  # raw counts
    speed: float  # counts/s
    standing: float  # time without a new count, s
    fine: float  # contraction, m
    position: float  # position of the whole positioner, m


class Frame(NamedTuple):
    """Where coordinate 0 is."""

    offset: float  # raw counts; NaN before the first sample
    first: float  # coordinate that the first sample has, counts
    trusted: bool  # whether the position is known
    zero: float  # where the relative reading is zero, m
    # whether the offset is that of a homing or of a kept position, trusted or not
    named: bool = False
    # whether a carriage bears the micro-stage: without one the place cannot be lost
    carriage: bool = True


class Drive(NamedTuple):
    """Set points and memories of the laws."""

    macro_reference: float  # raw counts
    micro_reference: float  # m
    memory: Memory  # memory of the macro law
    integral: float  # integral of the micro law, V
    reset: bool  # whether a laser reset is still to be given
    fine: Kept = ()  # memory of a law of the micro-stage that drives instead of the PI


class Motion(NamedTuple):
    id: int  # 1, 2,
    kind: str
    target: float  # m, or NaN
    coarse: float  # raw counts, or NaN
    fine: float  # m, or NaN
    began: float  # s


class Approach(NamedTuple):
    inside: float  # since when it is within the tolerance, s, or NaN
    entered: float  # since when it is settling, s, or NaN


class Window(NamedTuple):
    """Micro errors of the present window, and results of full ones."""

    total: float  # sum, m
    number: int
    mean: float  # mean of the window before, m
    held: float  # for how long such means have been on target, s
    hall: float = NAN  # last reading, V
    lives: bool = False  # whether the present window has seen another one


EMPTY = Window(0.0, 0, NAN, 0.0)


class Settle(NamedTuple):
    entered: float
    base: float  # encoder then, raw counts
    window: Window  # errors by the Hall sensor
    witness: Window = EMPTY  # errors by the laser, of an absolute move


class Search(NamedTuple):
    phase: int  # SEARCH, PUSH or BACK of `homing`
    since: float
    origin: float  # where it began, raw counts
    stop: float  # where the stop was felt, raw counts, or NaN
    sure: bool = False  # whether at the same place for the second time
    expected: float = NAN  # where the stop is expected, raw counts, or NaN
    pace: float = NAN  # speed of the search, counts/s; NaN before its first period
    lowest: float = NAN  # lowest count since it last moved by more than it dithers
    rested: float = NAN
    tries: int = 0  # how often what was found has not been found again


class Jogged(NamedTuple):
    goal: float  # requested speed, counts/s or m/s
    speed: float  # speed of the reference at present, in the same unit
    held_back: float  # for how long the carriage has held the reference back, s
    settle: Settle  # the micro-stage's arrival at its limit
    hold: float  # for how long it goes on unless it is renewed, s; 0: without end
    renewed: float  # when it was, s


class Followed(NamedTuple):
    """Set points that a client streams."""

    hold: float  # longest time without one, s
    heard: float  # when the last one came, s
    place: float = NAN  # the last one, m of the homed frame; NaN: none yet
    speed: float = NAN  # m/s
    since: float = NAN  # when the set point was there, s
    track: Any = None  # `tracking.Track`: the way of the stage's set point
    points: int = 0
    clipped: int = 0  # how many of them were beyond the soft limits
    settle: Settle = Settle(NAN, NAN, EMPTY)  # the arrival at the last one, once it is
    ending: bool = False  # whether it ends at the last one
    held_back: float = 0.0  # as of `Jogged`


class Braking(NamedTuple):
    since: float
    until: float  # until when it may last, s
    speed: float  # speed of the reference, counts/s
    outcome: str  # how it will be reported
    cause: str
    origin: float  # where it began, raw counts
    allowed: float  # way that it may take, counts
    found: m.Evidence  # what else is reported at its end
    goal: float = NAN  # where the motion was to end, raw counts, or NaN


class Running(NamedTuple):
    plan: Plan  # macro targets in raw counts
    progress: Progress
    start: float
    window: Window  # errors of the last move, a fine one
    over: float  # when the plan was completed, s, or NaN
    cut_off: m.Evidence | None  # what the first move cut off lacked, if any


class Played(NamedTuple):
    """A programme of a stage led by set points."""

    plan: Any  # moves and their profiles, in m of the homed frame
    progress: Any  # state of their sequence
    start: float  # when it began, s; NaN: the stage is on its way to where it begins
    cut_off: m.Evidence | None  # what the first move cut off lacked, if any


Work = Approach | Settle | Search | Jogged | Followed | Braking | Running | Played


class Trouble(NamedTuple):
    time: float
    words: str
    evidence: m.Evidence  # numbers and words by name


class Targets(NamedTuple):
    """Targets of the present or last move, where relative moves start; NaN without one."""

    whole: float = NAN  # m
    macro: float = NAN  # counts of the homed frame
    micro: float = NAN  # m


NOWHERE = Targets()


class LiveState(NamedTuple):
    mode: int  # index into `messages.MODES`
    time: float  # without leaps, s
    control: Control
    laws: Supervisor  # the same for the kernels
    limits: SoftLimits
    seen: Seen
    frame: Frame
    drive: Drive
    motion: Motion | None
    work: Work | None
    target: Targets  # of the move under way or of the last one
    fan: float  # 0 or 1
    fault: Trouble | None
    given: int  # ids so far
    survey: Survey = NOTHING
    shift: float = 0.0  # by how much the samples' time is ahead of `time`, s
    doubt: str = ""  # why the Hall sensor's readings are no contraction, or ""


REST = macro.rest(0.0)


def begin(
    p: LiveParameters, coordinate: float | None = None, *, trusted: bool = False
) -> LiveState:
    """The machine before its first sample: disabled, nothing moves."""
    alone = m.MACRO not in p.stages
    kept = NAN if coordinate is None else float(coordinate)
    known = not alone and math.isfinite(kept)
    first = kept if known else 0.0
    laws = settings.prepare(p.control, False, p.calibration, p.settings.pitch)
    return LiveState(
        m.DISABLED,
        0.0,
        p.control,
        laws,
        p.settings.limits,
        Seen(NAN, 0.0, 0.0, NAN if m.MICRO in p.stages else 0.0, NAN),
        Frame(NAN, first, (trusted and known) or alone, 0.0, known, not alone),
        Drive(0.0, 0.0, REST, 0.0, False, micro.begin(laws.fine)),
        None,
        None,
        NOWHERE,
        0.0,
        None,
        0,
    )


# The two that follow run each period. They call the constructor, which takes a third of the time
# of `_replace`.
def with_sample(
    s: LiveState, times: tuple[float, float], seen: Seen, frame: Frame, watched: Survey
) -> LiveState:
    """The machine after a sample."""
    time, shift = times
    return LiveState(
        s.mode, time, s.control, s.laws, s.limits, seen, frame, s.drive, s.motion, s.work,
        s.target, s.fan, s.fault, s.given, watched, shift, s.doubt,
    )  # fmt: skip


def with_work(s: LiveState, drive: Drive, work: Work | None) -> LiveState:
    """The machine after a period of its work."""
    return LiveState(
        s.mode, s.time, s.control, s.laws, s.limits, s.seen, s.frame, drive, s.motion, work,
        s.target, s.fan, s.fault, s.given, s.survey, s.shift, s.doubt,
    )  # fmt: skip


def now(s: LiveState) -> float:
    return s.time + s.shift


def uncertainty(p: LiveParameters, s: LiveState) -> float:
    """Half width of the interval that holds the position."""
    if by_laser(p, s):
        return s.survey.half
    if not s.frame.trusted or s.doubt:
        return math.inf
    pitch = p.settings.pitch
    elsewhere = survey.contradiction(s.survey, s.seen.position, pitch, s.frame.offset)
    jerked = p.settings.edges.bounce if abs(s.seen.speed) > p.settings.edges.fastest else 0.0
    return max(0.5 * pitch + jerked, elsewhere)


def by_laser(p: LiveParameters, s: LiveState) -> bool:
    """Whether the position comes from the laser, or from encoder and Hall sensor."""
    return s.frame.trusted and s.survey.half < 0.5 * p.settings.pitch


def position(p: LiveParameters, s: LiveState) -> float:
    if by_laser(p, s):
        return survey.whole(s.survey, p.settings.pitch, s.frame.offset)
    return coordinate(s) * p.settings.pitch + s.seen.fine


def carriage(p: LiveParameters, s: LiveState) -> float:
    """Position of the carriage: the middle of a count, or within it by the laser."""
    if by_laser(p, s):
        return s.seen.position - s.seen.fine
    return coordinate(s) * p.settings.pitch


def coordinate(s: LiveState) -> float:
    return s.seen.encoder - s.frame.offset


def busy(s: LiveState) -> bool:
    """Whether a motion is under way, its braking included."""
    return s.motion is not None


def target(p: LiveParameters, s: LiveState) -> float:
    """Target of the whole positioner."""
    whole, macro, micro = s.target
    if not math.isnan(whole):
        return whole
    return carriage(p, s) + micro if m.MICRO in p.stages else macro * p.settings.pitch


def goal(p: LiveParameters, s: LiveState) -> float:
    """Where the whole positioner is going, or rests on target."""
    known = target(p, s)
    if not math.isnan(known):
        return known
    if s.mode in (m.MOVING_MICRO, m.HOLDING):
        return carriage(p, s) + s.drive.micro_reference
    if s.mode in (m.MOVING_MACRO, m.SETTLING):
        return (s.drive.macro_reference - s.frame.offset) * p.settings.pitch
    return NAN
