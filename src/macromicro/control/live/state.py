"""What the live machine remembers. Raw counts are the encoder's own, without an offset."""

from __future__ import annotations

import math
from typing import NamedTuple

from macromicro.control import macro, settings
from macromicro.control.live import survey
from macromicro.control.live.messages import DISABLED, Evidence
from macromicro.control.live.parameters import LiveParameters, SoftLimits
from macromicro.control.live.survey import NOTHING, Survey
from macromicro.control.macro import Memory
from macromicro.control.settings import Control
from macromicro.control.supervisor import Plan, Progress, Supervisor

NAN = math.nan


class Seen(NamedTuple):
    """Last good readings: encoder [raw counts], speed [count/s], standing: time without a new
    count [s], fine: contraction [mm]; whole position [m]. NaN before the first."""

    encoder: float
    speed: float
    standing: float
    fine: float
    position: float


class Frame(NamedTuple):
    """Where coordinate 0 is: `offset` [raw counts], NaN before the first sample, which then
    has the coordinate `first`. `zero` [m]: where the relative reading is zero. `named`: is the
    offset that of a homing or of a kept position, trusted or not?"""

    offset: float
    first: float
    trusted: bool
    zero: float
    named: bool = False


class Drive(NamedTuple):
    """References [raw counts], [mm], memories of the laws, and a laser reset still to give."""

    macro_reference: float
    micro_reference: float
    memory: Memory
    integral: float
    reset: bool


class Motion(NamedTuple):
    """The motion under way, as accepted: target [m], coarse [raw counts], fine [mm], or NaN."""

    id: int
    kind: str
    target: float
    coarse: float
    fine: float
    began: float


class Approach(NamedTuple):
    """Macro move: within tolerance since `inside` or NaN; settling since `entered`."""

    inside: float
    entered: float


class Window(NamedTuple):
    """Micro errors of the present window: sum [mm] and number; mean [mm] of the window before,
    and for how long such means have been on target [s]; last reading [V], and whether the
    present window has seen another one."""

    total: float
    number: int
    mean: float
    held: float
    hall: float = NAN
    lives: bool = False


EMPTY = Window(0.0, 0, NAN, 0.0)


class Settle(NamedTuple):
    """Micro move since `entered`, the encoder then at `base` [raw counts]; errors by the Hall
    sensor, and by the laser of an absolute move."""

    entered: float
    base: float
    window: Window
    witness: Window = EMPTY


class Search(NamedTuple):
    """Homing: phase, since when, where it began [raw counts] and the stop, once felt; `sure`: at
    the same place for the second time; where the stop is `expected` [raw counts], or NaN, and the
    speed of the search [count/s], NaN before its first period."""

    phase: int
    since: float
    origin: float
    stop: float
    sure: bool = False
    expected: float = NAN
    pace: float = NAN


class Jogged(NamedTuple):
    """Jog: speed wanted and present speed of the reference [count/s | mm/s], how long the
    reference has been held back by the carriage [s]; the micro-stage at its limit."""

    goal: float
    speed: float
    held_back: float
    settle: Settle


class Braking(NamedTuple):
    """Coming to rest since `since`: speed of the reference [count/s], how it will be
    reported, where it began [raw counts], the way that it may take [counts], what is to be told
    at its end beside these, and where the motion was to end [raw counts], or NaN."""

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
    """A programme: plan in raw counts, the supervisor's progress, time of its start [s]; `over`:
    when its plan was completed [s], or NaN; what the first move cut off lacked, if any."""

    plan: Plan
    progress: Progress
    start: float
    window: Window
    over: float
    cut_off: Evidence | None


Work = Approach | Settle | Search | Jogged | Braking | Running


class Trouble(NamedTuple):
    """A latched fault: when [s], and what the guard said."""

    time: float
    words: str
    evidence: Evidence


class LiveState(NamedTuple):
    """The machine. `control` are the settings in force, `laws` the same for the kernels,
    `limits` the soft limits in force; `time` [s] has no leaps, the samples' is `shift` ahead;
    `survey` is what the laser tells beside the encoder; `target` [m]: what is being held after
    an absolute move, or NaN; `given`: ids so far; `doubt`: why the Hall sensor's readings are
    no contraction, or ""."""

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
    target: float
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

    `coordinate` [counts, homed frame]: where the carriage was left, as kept from the run
    before; the encoder's first count is given that name. `trusted`: is it known to stand
    there still? Without a coordinate the place is not trusted.
    """
    kept = NAN if coordinate is None else float(coordinate)
    known = math.isfinite(kept)
    first = kept if known else 0.0
    return LiveState(
        DISABLED,
        0.0,
        p.control,
        settings.prepare(p.control, False, p.calibration),
        p.settings.limits,
        Seen(NAN, 0.0, 0.0, NAN, NAN),
        Frame(NAN, first, trusted and known, 0.0, known),
        Drive(0.0, 0.0, REST, 0.0, False),
        None,
        None,
        NAN,
        0.0,
        None,
        0,
    )


def now(s: LiveState) -> float:
    """Time [s] of the last sample, as the rig tells it."""
    return s.time + s.shift


def uncertainty(p: LiveParameters, s: LiveState) -> float:
    """Half width [m] of the interval that holds the position: by laser where it knows the
    encoder's edges, else half a count, and more on a fast way or where the laser has it
    elsewhere; infinite where the frame is not trusted, or the contraction is not known."""
    if by_laser(p, s):
        return s.survey.half
    if not s.frame.trusted or s.doubt:
        return math.inf
    pitch = p.settings.pitch
    elsewhere = survey.contradiction(s.survey, s.seen.position, pitch, s.frame.offset)
    jerked = p.settings.edges.bounce if abs(s.seen.speed) > p.settings.edges.fastest else 0.0
    return max(0.5 * pitch + jerked, elsewhere)


def by_laser(p: LiveParameters, s: LiveState) -> bool:
    """Is the position the laser's? Else the encoder's and the Hall sensor's."""
    return s.frame.trusted and s.survey.half < 0.5 * p.settings.pitch


def position(p: LiveParameters, s: LiveState) -> float:
    """Of the whole positioner [m] by the last readings."""
    if by_laser(p, s):
        return survey.whole(s.survey, p.settings.pitch, s.frame.offset)
    return coordinate(s) * p.settings.pitch + s.seen.fine * 1e-3


def carriage(p: LiveParameters, s: LiveState) -> float:
    """Of the carriage [m]: a count's middle, or by laser its place within the count."""
    if by_laser(p, s):
        return s.seen.position - s.seen.fine * 1e-3
    return coordinate(s) * p.settings.pitch


def coordinate(s: LiveState) -> float:
    """Macro position [counts, homed frame]; NaN before the first sample."""
    return s.seen.encoder - s.frame.offset


def busy(s: LiveState) -> bool:
    """Is a motion under way, its braking included?"""
    return s.motion is not None
