"""Requests to the live machine, its replies and its events; all messages pickle."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from macromicro.control.live import parameters
from macromicro.control.live.parameters import SoftLimits

(DISABLED, HOMING, READY, MOVING_MACRO, SETTLING, MOVING_MICRO, HOLDING, FAULT, STOPPED) = range(9)
MODES = (
    "disabled",
    "homing",
    "ready",
    "moving-macro",
    "settling",
    "moving-micro",
    "holding",
    "fault",
    "stopped",
)
MOVING = (HOMING, MOVING_MACRO, SETTLING, MOVING_MICRO)

DONE = "done"  # on target and settled; the only success
STOPPED_BY_REQUEST = "stopped"
EMERGENCY = "emergency"
FAULTED = "fault"
LIMIT = "limit"
STALLED = "stalled"
LOST = "lost"
SUPERSEDED = "superseded"
OUTCOMES = (DONE, STOPPED_BY_REQUEST, EMERGENCY, FAULTED, LIMIT, STALLED, LOST, SUPERSEDED)

STAGES = parameters.STAGES
MACRO, MICRO = STAGES
AXES = ("x", "y")  # stages of the machine `xy`; of others of several stages their own names
ALL = "all"  # of them

Evidence = dict[str, Any]  # numbers and words by name; the unit is in the name ("error_mm")


class Enable(NamedTuple):
    """From disabled to ready; nothing moves."""

    client: str = ""


class Disable(NamedTuple):
    """Both stages off at once; a motion under way ends as "stopped"."""

    client: str = ""


class Home(NamedTuple):
    """Find the low end stop and set the position."""

    client: str = ""


class MoveTo(NamedTuple):
    """Move the whole positioner: macro, wait, micro; or the micro-stage alone."""

    position: float  # m
    client: str = ""
    # here and in other moves: a motion under way (no homing, no braking) ends as "superseded" and
    # this one begins where that one is; else the move is refused
    replace: bool = False


class MoveBy(NamedTuple):
    """Move by a distance from the last target, else from the present position."""

    distance: float  # m
    client: str = ""
    replace: bool = False  # as for `MoveTo`


class MoveMacro(NamedTuple):
    """Move the macro-stage to a count; the micro-stage goes off."""

    counts: float  # homed frame, a whole number
    client: str = ""
    replace: bool = False  # as for `MoveTo`


class MoveMicro(NamedTuple):
    """Move the micro-stage to a contraction; the macro-stage stands."""

    position: float  # m
    client: str = ""
    replace: bool = False  # as for `MoveTo`


class MoveMacroBy(NamedTuple):
    """Move the macro-stage by some counts from its last target or position."""

    # it goes to the nearest whole count; the next one adds to the target as it was meant
    counts: float
    client: str = ""
    replace: bool = False  # as for `MoveTo`


class MoveMicroBy(NamedTuple):
    """Move the micro-stage by a distance from its target or position."""

    distance: float  # m
    client: str = ""
    replace: bool = False  # as for `MoveTo`


class MovePoint(NamedTuple):
    """Move several stages to a point on a straight line."""

    to: dict[str, float]  # position of each named stage, m or rad; the others stand
    client: str = ""
    # here and in other moves of axes: a motion under way (no homing, no braking) ends as
    # "superseded", comes to rest on its line or path, and this one begins there
    replace: bool = False


class MovePointBy(NamedTuple):
    """Move several stages by distances on a straight line, each from its target or position."""

    by: dict[str, float]  # distance of each named stage, m or rad
    client: str = ""
    replace: bool = False  # as for `MovePoint`


class MoveAxis(NamedTuple):
    """Move one of several stages."""

    axis: str  # name of the stage
    position: float  # m
    client: str = ""
    replace: bool = False  # as for `MovePoint`


class MoveAxisBy(NamedTuple):
    """Move one of several stages by a distance from its target or position."""

    axis: str  # name of the stage
    distance: float  # m
    client: str = ""
    replace: bool = False  # as for `MovePoint`


class Jog(NamedTuple):
    """Move one stage at a speed until another request; 0 ends it."""

    stage: str  # "macro" or "micro", or the name of one of several
    speed: float  # m/s
    hold: float = 0.0  # it ends unless it is renewed within this time, s; 0: it goes on
    client: str = ""


class Follow(NamedTuple):
    """Follow set points that the client streams, until another request or until none comes."""

    stage: str  # "macro" or "micro", the name of one of several, or `ALL`
    hold: float  # longest time without a set point, s: the motion ends as "lost" after it
    client: str = ""


class EndFollow(NamedTuple):
    """Come to rest on the last set point; the motion ends as "done"."""

    client: str = ""


class SetPoint(NamedTuple):
    """A streamed set point. It takes a shorter way than requests, and has no reply."""

    position: float  # m; of the macro-stage that of the carriage, of the micro-stage contraction
    velocity: float = 0.0  # with which the set point goes on until the next one, m/s


class SetPoints(NamedTuple):
    """A streamed set point of all of several stages."""

    each: tuple[tuple[float, float], ...]  # position, m, and velocity, m/s


class Stop(NamedTuple):
    """Decelerate; the micro-stage is held where it is."""

    client: str = ""


class EmergencyStop(NamedTuple):
    """All outputs safe from the next step on; the positioner is disabled."""

    client: str = ""


class Zero(NamedTuple):
    """Set the laser and the relative reading to zero; absolute coordinates stay."""

    client: str = ""


class Fan(NamedTuple):
    on: bool
    client: str = ""


class Programme(NamedTuple):
    # of the two-stage machine `supervisor.Plan`, macro targets in counts of the homed frame, micro
    # targets in m; of a machine of one stage `machines.sequence.Plan`, in m of that frame; of
    # several stages one of these each
    plan: Any
    client: str = ""


class SetGains(NamedTuple):
    """New gains of `control.settings.Control` or of a machine's law, all or none."""

    # pairs of a dotted path ("pd_tuned.now", "sequence.wait") and its value, in the stored unit
    changes: tuple[tuple[str, float | int | str], ...]
    client: str = ""


class SetSpeed(NamedTuple):
    """Maximum speed of moves led by set points, from the next one on."""

    stage: str  # "macro", or the name of one of several
    speed: float  # m/s, up to that of the machine's settings
    client: str = ""


class SetLimits(NamedTuple):
    """Soft limits from now on, within the machine's own."""

    limits: SoftLimits | None = None  # None for the machine's own
    client: str = ""


class ClearFault(NamedTuple):
    """From fault to disabled."""

    gone: bool = False  # whether the caller has renewed the guard and the cause is away
    client: str = ""


class LinkLost(NamedTuple):
    """The client in control is gone; motion ends as "lost"."""

    # "stop": come to rest, micro-stage off; "hold": come to rest, the micro-stage is held where it
    # is
    action: str = "stop"
    client: str = ""


ONE_MOVES = (MoveTo, MoveBy, MoveMacro, MoveMacroBy, MoveMicro, MoveMicroBy)
AXES_MOVES = (MovePoint, MovePointBy, MoveAxis, MoveAxisBy)
_OneMove = MoveTo | MoveBy | MoveMacro | MoveMacroBy | MoveMicro | MoveMicroBy
_AxesMove = MovePoint | MovePointBy | MoveAxis | MoveAxisBy
_Motion = _OneMove | _AxesMove | Home | Jog | Follow | EndFollow | Programme
_Setting = SetGains | SetSpeed | SetLimits | Zero | Fan
_End = Stop | EmergencyStop | Disable | LinkLost
Request = _Motion | _Setting | _End | Enable | ClearFault

LONGEST_HOLD, SHORTEST_HOLD = 1.0, 0.01  # s, of streamed set points
JOG_HOLD = 10.0  # s, at most


class Change(NamedTuple):
    path: str  # dotted path within the gains
    old: float | int | str  # value before, in the stored unit
    new: float | int | str


class Accepted(NamedTuple):
    """The request is being executed."""

    id: int = 0  # number of the motion it began (1, 2, ...), else 0
    changes: tuple[Change, ...] = ()  # settings that it changed


class Refused(NamedTuple):
    """Nothing was changed and nothing moves."""

    reason: str
    remedy: str
    beyond: bool = False  # whether a value is out of range; else it is not the time for the request


Reply = Accepted | Refused


class Event(NamedTuple):
    time: float  # time of the samples, s
    # "mode" (a transition), "move" (a programme's next move, or one cut off), "trust", "gains",
    # "limits", "zero", "fan"
    kind: str
    from_mode: str
    to_mode: str
    cause: str  # A word or two, for "mode" one of the table's
    evidence: Evidence  # numbers and words by name, the unit in the name


class Finished(NamedTuple):
    """The end of an accepted motion."""

    id: int
    outcome: str  # one of `OUTCOMES`
    position: float  # where the whole positioner is then, m
    uncertainty: float  # how well that is known, m; infinite where never homed
    evidence: Evidence  # numbers and words by name, the unit in the name
    time: float = math.nan  # when, s; NaN where the loop was gone before it could say it


Notice = Event | Finished
