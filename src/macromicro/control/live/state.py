"""What the live machine remembers. Raw counts are the encoder's own, without an offset."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from macromicro.control import macro, micro, settings
from macromicro.control.live import survey
from macromicro.control.live.messages import (
    DISABLED,
    HOLDING,
    MACRO,
    MICRO,
    MOVING_MACRO,
    MOVING_MICRO,
    SETTLING,
    Evidence,
)
from macromicro.control.live.parameters import LiveParameters, SoftLimits
from macromicro.control.live.survey import NOTHING, Survey
from macromicro.control.macro import Memory
from macromicro.control.outside import Kept
from macromicro.control.settings import Control
from macromicro.control.supervisor import Plan, Progress, Supervisor

NAN = math.nan


class Seen(NamedTuple):
    """Last good readings; NaN before the first.

    Attributes
    ----------
    encoder : float
        Raw counts.
    speed : float
        counts/s.
    standing : float
        Time without a new count, s.
    fine : float
        Contraction, m.
    position : float
        Position of the whole positioner, m.
    """

    encoder: float
    speed: float
    standing: float
    fine: float
    position: float


class Frame(NamedTuple):
    """Where coordinate 0 is.

    Attributes
    ----------
    offset : float
        Raw counts; NaN before the first sample.
    first : float
        Coordinate that the first sample has, counts.
    trusted : bool
        Whether the position is known.
    zero : float
        Where the relative reading is zero, m.
    named : bool
        Whether the offset is that of a homing or of a kept position, trusted or not.
    carriage : bool
        Whether a carriage bears the micro-stage: without one the place cannot be lost.
    """

    offset: float
    first: float
    trusted: bool
    zero: float
    named: bool = False
    carriage: bool = True


class Drive(NamedTuple):
    """What the laws follow and remember.

    Attributes
    ----------
    macro_reference : float
        Raw counts.
    micro_reference : float
        m.
    memory : Memory
        Memory of the macro law.
    integral : float
        Integral of the micro law, V.
    reset : bool
        Whether a laser reset is still to be given.
    fine : Kept
        Memory of a law of the micro-stage that drives instead of the PI.
    """

    macro_reference: float
    micro_reference: float
    memory: Memory
    integral: float
    reset: bool
    fine: Kept = ()


class Motion(NamedTuple):
    """The motion under way, as accepted.

    Attributes
    ----------
    id : int
        1, 2, ...
    kind : str
        Kind in words.
    target : float
        m, or NaN.
    coarse : float
        Raw counts, or NaN.
    fine : float
        m, or NaN.
    began : float
        s.
    """

    id: int
    kind: str
    target: float
    coarse: float
    fine: float
    began: float


class Approach(NamedTuple):
    """A macro move.

    Attributes
    ----------
    inside : float
        Since when it is within the tolerance, s, or NaN.
    entered : float
        Since when it is settling, s, or NaN.
    """

    inside: float
    entered: float


class Window(NamedTuple):
    """Micro errors of the present window, and what full ones have shown.

    Attributes
    ----------
    total : float
        Sum, m.
    number : int
        How many.
    mean : float
        Mean of the window before, m.
    held : float
        For how long such means have been on target, s.
    hall : float
        Last reading, V.
    lives : bool
        Whether the present window has seen another one.
    """

    total: float
    number: int
    mean: float
    held: float
    hall: float = NAN
    lives: bool = False


EMPTY = Window(0.0, 0, NAN, 0.0)


class Settle(NamedTuple):
    """A micro move.

    Attributes
    ----------
    entered : float
        Since when, s.
    base : float
        Encoder then, raw counts.
    window : Window
        Errors by the Hall sensor.
    witness : Window
        Errors by the laser, of an absolute move.
    """

    entered: float
    base: float
    window: Window
    witness: Window = EMPTY


class Search(NamedTuple):
    """Homing.

    Attributes
    ----------
    phase : int
        SEARCH, PUSH or BACK of `homing`.
    since : float
        Since when, s.
    origin : float
        Where it began, raw counts.
    stop : float
        Where the stop was felt, raw counts, or NaN.
    sure : bool
        Whether at the same place for the second time.
    expected : float
        Where the stop is expected, raw counts, or NaN.
    pace : float
        Speed of the search, counts/s; NaN before its first period.
    lowest : float
        Lowest count since it last moved by more than it dithers.
    rested : float
        Since when, s, or NaN.
    tries : int
        How often what was found has not been found again.
    """

    phase: int
    since: float
    origin: float
    stop: float
    sure: bool = False
    expected: float = NAN
    pace: float = NAN
    lowest: float = NAN
    rested: float = NAN
    tries: int = 0


class Jogged(NamedTuple):
    """A jog.

    Attributes
    ----------
    goal : float
        Requested speed, counts/s or m/s.
    speed : float
        Speed of the reference at present, in the same unit.
    held_back : float
        For how long the carriage has held the reference back, s.
    settle : Settle
        The micro-stage's arrival at its limit.
    """

    goal: float
    speed: float
    held_back: float
    settle: Settle


class Braking(NamedTuple):
    """Coming to rest.

    Attributes
    ----------
    since : float
        Since when, s.
    until : float
        Until when it may last, s.
    speed : float
        Speed of the reference, counts/s.
    outcome : str
        How it will be reported.
    cause : str
        Likewise.
    origin : float
        Where it began, raw counts.
    allowed : float
        Way that it may take, counts.
    found : Evidence
        What else is reported at its end.
    goal : float
        Where the motion was to end, raw counts, or NaN.
    """

    since: float
    until: float
    speed: float
    outcome: str
    cause: str
    origin: float
    allowed: float
    found: Evidence
    goal: float = NAN


class Running(NamedTuple):
    """A programme.

    Attributes
    ----------
    plan : Plan
        Macro targets in raw counts.
    progress : Progress
        The supervisor's state.
    start : float
        When it began, s.
    window : Window
        Errors of the last move, a fine one.
    over : float
        When the plan was completed, s, or NaN.
    cut_off : Evidence | None
        What the first move cut off lacked, if any.
    """

    plan: Plan
    progress: Progress
    start: float
    window: Window
    over: float
    cut_off: Evidence | None


class Played(NamedTuple):
    """A programme of a stage that is led by set points.

    Attributes
    ----------
    plan : Any
        Moves and their profiles, in m of the homed frame.
    progress : Any
        State of their sequence.
    start : float
        When it began, s; NaN: the stage is on its way to where it begins.
    cut_off : Evidence | None
        What the first move cut off lacked, if any.
    """

    plan: Any
    progress: Any
    start: float
    cut_off: Evidence | None


Work = Approach | Settle | Search | Jogged | Braking | Running | Played


class Trouble(NamedTuple):
    """A latched fault.

    Attributes
    ----------
    time : float
        When, s.
    words : str
        What happened.
    evidence : Evidence
        Numbers and words by name.
    """

    time: float
    words: str
    evidence: Evidence


class Targets(NamedTuple):
    """Targets of the move under way, or of the last one: a relative move starts there. NaN where
    there is none: what stops a stage otherwise, or leads it without a target, forgets it."""

    whole: float = NAN  # m
    macro: float = NAN  # counts of the homed frame
    micro: float = NAN  # m


NOWHERE = Targets()


class LiveState(NamedTuple):
    """State of the live machine.

    Attributes
    ----------
    mode : int
        Index into `messages.MODES`.
    time : float
        Without leaps, s.
    control : Control
        Settings in force.
    laws : Supervisor
        The same for the kernels.
    limits : SoftLimits
        Soft limits in force.
    seen : Seen
        Last good readings.
    frame : Frame
        Where coordinate 0 is.
    drive : Drive
        What the laws follow and remember.
    motion : Motion | None
        The one under way.
    work : Work | None
        How far the motion is.
    target : Targets
        Of the move under way or of the last one.
    fan : float
        0 or 1.
    fault : Trouble | None
        The latched one.
    given : int
        Ids so far.
    survey : Survey
        What the laser shows beside the encoder.
    shift : float
        By how much the samples' time is ahead of `time`, s.
    doubt : str
        Why the Hall sensor's readings are no contraction, or "".
    """

    mode: int
    time: float
    control: Control
    laws: Supervisor
    limits: SoftLimits
    seen: Seen
    frame: Frame
    drive: Drive
    motion: Motion | None
    work: Work | None
    target: Targets
    fan: float
    fault: Trouble | None
    given: int
    survey: Survey = NOTHING
    shift: float = 0.0
    doubt: str = ""


REST = macro.rest(0.0)


def begin(
    p: LiveParameters, coordinate: float | None = None, *, trusted: bool = False
) -> LiveState:
    """The machine before its first sample: disabled, nothing moves.

    Parameters
    ----------
    p : LiveParameters
        Parameters of the live machine.
    coordinate : float | None, optional
        Where the carriage was left, as kept from the run before, counts of the homed frame; the
        encoder's first count is given that name. Without it the place is not trusted.
    trusted : bool, optional
        Whether it is known to stand there still.

    Returns
    -------
    LiveState
        State.
    """
    alone = MACRO not in p.stages
    kept = NAN if coordinate is None else float(coordinate)
    known = not alone and math.isfinite(kept)
    first = kept if known else 0.0
    laws = settings.prepare(p.control, False, p.calibration, p.settings.pitch)
    return LiveState(
        DISABLED,
        0.0,
        p.control,
        laws,
        p.settings.limits,
        Seen(NAN, 0.0, 0.0, NAN if MICRO in p.stages else 0.0, NAN),
        Frame(NAN, first, (trusted and known) or alone, 0.0, known, not alone),
        Drive(0.0, 0.0, REST, 0.0, False, micro.begun(laws.fine)),
        None,
        None,
        NOWHERE,
        0.0,
        None,
        0,
    )


# The two that follow run each period. They call the constructor, which takes a third of the time
# of `_replace`.
def perceived(
    s: LiveState, times: tuple[float, float], seen: Seen, frame: Frame, watched: Survey
) -> LiveState:
    """The machine after a sample was taken in.

    Parameters
    ----------
    s : LiveState
        State of the live machine.
    times : tuple[float, float]
        New `time` and `shift`, s.
    seen : Seen
        New readings.
    frame : Frame
        New frame.
    watched : Survey
        New survey.

    Returns
    -------
    LiveState
        New state.
    """
    time, shift = times
    return LiveState(
        s.mode, time, s.control, s.laws, s.limits, seen, frame, s.drive, s.motion, s.work,
        s.target, s.fan, s.fault, s.given, watched, shift, s.doubt,
    )  # fmt: skip


def driven(s: LiveState, drive: Drive, work: Work | None) -> LiveState:
    """The machine after a period of its work.

    Parameters
    ----------
    s : LiveState
        State of the live machine.
    drive : Drive
        New drive.
    work : Work | None
        How far the motion is now.

    Returns
    -------
    LiveState
        New state.
    """
    return LiveState(
        s.mode, s.time, s.control, s.laws, s.limits, s.seen, s.frame, drive, s.motion, work,
        s.target, s.fan, s.fault, s.given, s.survey, s.shift, s.doubt,
    )  # fmt: skip


def now(s: LiveState) -> float:
    """Time of the last sample, as the rig gives it.

    Parameters
    ----------
    s : LiveState
        State of the live machine.

    Returns
    -------
    float
        s.
    """
    return s.time + s.shift


def uncertainty(p: LiveParameters, s: LiveState) -> float:
    """Half width of the interval that holds the position.

    By laser where it knows the encoder's edges, else half a count, and more on a fast way or where
    the laser has it elsewhere.

    Parameters
    ----------
    p : LiveParameters
        Parameters of the live machine.
    s : LiveState
        State of the live machine.

    Returns
    -------
    float
        m; infinite where the frame is not trusted, or the contraction is not known.
    """
    if by_laser(p, s):
        return s.survey.half
    if not s.frame.trusted or s.doubt:
        return math.inf
    pitch = p.settings.pitch
    elsewhere = survey.contradiction(s.survey, s.seen.position, pitch, s.frame.offset)
    jerked = p.settings.edges.bounce if abs(s.seen.speed) > p.settings.edges.fastest else 0.0
    return max(0.5 * pitch + jerked, elsewhere)


def by_laser(p: LiveParameters, s: LiveState) -> bool:
    """Whether the position is the laser's; else it is the encoder's and the Hall sensor's.

    Parameters
    ----------
    p : LiveParameters
        Parameters of the live machine.
    s : LiveState
        State of the live machine.

    Returns
    -------
    bool
        True if so.
    """
    return s.frame.trusted and s.survey.half < 0.5 * p.settings.pitch


def position(p: LiveParameters, s: LiveState) -> float:
    """Position of the whole positioner by the last readings.

    Parameters
    ----------
    p : LiveParameters
        Parameters of the live machine.
    s : LiveState
        State of the live machine.

    Returns
    -------
    float
        m.
    """
    if by_laser(p, s):
        return survey.whole(s.survey, p.settings.pitch, s.frame.offset)
    return coordinate(s) * p.settings.pitch + s.seen.fine


def carriage(p: LiveParameters, s: LiveState) -> float:
    """Position of the carriage: a count's middle, or by laser its place within the count.

    Parameters
    ----------
    p : LiveParameters
        Parameters of the live machine.
    s : LiveState
        State of the live machine.

    Returns
    -------
    float
        m.
    """
    if by_laser(p, s):
        return s.seen.position - s.seen.fine
    return coordinate(s) * p.settings.pitch


def coordinate(s: LiveState) -> float:
    """Macro position.

    Parameters
    ----------
    s : LiveState
        State of the live machine.

    Returns
    -------
    float
        counts of the homed frame; NaN before the first sample.
    """
    return s.seen.encoder - s.frame.offset


def busy(s: LiveState) -> bool:
    """Whether a motion is under way, its braking included.

    Parameters
    ----------
    s : LiveState
        State of the live machine.

    Returns
    -------
    bool
        True if so.
    """
    return s.motion is not None


def target(p: LiveParameters, s: LiveState) -> float:
    """Target of the whole positioner, of the move under way or of the last one.

    Parameters
    ----------
    p : LiveParameters
        Parameters of the live machine.
    s : LiveState
        State of the live machine.

    Returns
    -------
    float
        m, or NaN.
    """
    whole, macro, micro = s.target
    if not math.isnan(whole):
        return whole
    return carriage(p, s) + micro if MICRO in p.stages else macro * p.settings.pitch


def goal(p: LiveParameters, s: LiveState) -> float:
    """Where the whole positioner is going, or rests on target.

    A jog or a programme goes where its set point is now.

    Parameters
    ----------
    p : LiveParameters
        Parameters of the live machine.
    s : LiveState
        State of the live machine.

    Returns
    -------
    float
        m; NaN where it goes nowhere and rests on no target.
    """
    known = target(p, s)
    if not math.isnan(known):
        return known
    if s.mode in (MOVING_MICRO, HOLDING):
        return carriage(p, s) + s.drive.micro_reference
    if s.mode in (MOVING_MACRO, SETTLING):
        return (s.drive.macro_reference - s.frame.offset) * p.settings.pitch
    return NAN
