"""What the live machine remembers. Raw counts are the encoder's own, without an offset."""

from __future__ import annotations

import math
from typing import NamedTuple

from macromicro.control import settings
from macromicro.control.live.messages import DISABLED, Evidence
from macromicro.control.live.parameters import LiveParameters
from macromicro.control.macro import MacroMemory
from macromicro.control.settings import Control
from macromicro.control.supervisor import Plan, Progress, Supervisor

NAN = math.nan
TICK = 1e-9  # slack of comparisons of times


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
    has the coordinate `first`. `zero` [m]: where the relative reading is zero."""

    offset: float
    first: float
    trusted: bool
    zero: float


class Drive(NamedTuple):
    """References [raw counts], [mm], memories of the laws, and a laser reset still to give."""

    macro_reference: float
    micro_reference: float
    memory: MacroMemory
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
    and for how long such means have been on target [s]."""

    total: float
    number: int
    mean: float
    held: float


class Settle(NamedTuple):
    """Micro move since `entered`, the encoder then at `base` [raw counts]."""

    entered: float
    base: float
    window: Window


class Search(NamedTuple):
    """Homing: phase, since when, where it began [raw counts] and the stop, once felt."""

    phase: int
    since: float
    origin: float
    stop: float


class Jogged(NamedTuple):
    """Jog: speed wanted and present speed of the reference [count/s | mm/s], how long the
    reference has been held back by the carriage [s]; the micro-stage at its limit."""

    goal: float
    speed: float
    held_back: float
    settle: Settle


class Braking(NamedTuple):
    """Coming to rest since `since`: speed of the reference [count/s], how it will be
    reported, where it began [raw counts], and the way that it may take [counts]."""

    since: float
    until: float
    speed: float
    outcome: str
    cause: str
    origin: float
    allowed: float


class Running(NamedTuple):
    """A programme: plan in raw counts, the supervisor's progress, time of its start [s]."""

    plan: Plan
    progress: Progress
    start: float
    window: Window


Work = Approach | Settle | Search | Jogged | Braking | Running


class Trouble(NamedTuple):
    """A latched fault: when [s], and what the guard said."""

    time: float
    words: str
    evidence: Evidence


class LiveState(NamedTuple):
    """The machine. `control` are the settings in force, `laws` the same for the kernels;
    `target` [m]: what is being held after an absolute move, or NaN; `given`: ids so far."""

    mode: int
    time: float
    control: Control
    laws: Supervisor
    seen: Seen
    frame: Frame
    drive: Drive
    motion: Motion | None
    work: Work | None
    target: float
    fan: float
    fault: Trouble | None
    given: int


EMPTY = Window(0.0, 0, NAN, 0.0)
REST = MacroMemory(0.0, 0.0)


def begin(
    p: LiveParameters, coordinate: float | None = None, *, trusted: bool = False
) -> LiveState:
    """The machine before its first sample: disabled, nothing moves.

    `coordinate` [counts, homed frame]: where the carriage was left, as kept from the run
    before; the encoder's first count is given that name. `trusted`: is it known to stand
    there still? Without a coordinate the place is not trusted.
    """
    known = coordinate is not None and math.isfinite(coordinate)
    first = float(coordinate) if coordinate is not None and known else 0.0
    return LiveState(
        DISABLED,
        0.0,
        p.control,
        settings.prepare(p.control, False, p.calibration),
        Seen(NAN, 0.0, 0.0, NAN, NAN),
        Frame(NAN, first, trusted and known, 0.0),
        Drive(0.0, 0.0, REST, 0.0, False),
        None,
        None,
        NAN,
        0.0,
        None,
        0,
    )


def uncertainty(p: LiveParameters, s: LiveState) -> float:
    """Half width [m] of the interval that holds the position: half a count, as the place of
    the encoder's edges is not calibrated; infinite where the frame is not trusted."""
    return 0.5 * p.settings.pitch if s.frame.trusted else math.inf


def coordinate(s: LiveState) -> float:
    """Macro position [counts, homed frame]; NaN before the first sample."""
    return s.seen.encoder - s.frame.offset


def busy(s: LiveState) -> bool:
    """Is a motion under way, its braking included?"""
    return s.motion is not None
