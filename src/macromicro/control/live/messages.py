"""What the live positioner is asked, what it answers and what it reports.

Requests are NamedTuples; each carries the name of the client that sent it (for the
events only). Positions of the whole positioner are metres, macro positions counts in the
homed frame, micro positions metres of contraction. All messages pickle.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from macromicro.control.live import parameters
from macromicro.control.live.parameters import SoftLimits

(
    DISABLED,
    HOMING,
    READY,
    MOVING_MACRO,
    SETTLING,
    MOVING_MICRO,
    HOLDING,
    FAULT,
    STOPPED,
) = range(9)
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
AXES = ("x", "y")  # stages of a machine of two axes

Evidence = dict[str, Any]  # numbers and words by name; the unit is in the name ("error_mm")


class Enable(NamedTuple):
    """Disabled to ready. Nothing moves."""

    client: str = ""


class Disable(NamedTuple):
    """Motor and micro-stage off at once; a motion under way ends as "stopped"."""

    client: str = ""


class Home(NamedTuple):
    """Find the low end stop and give the place a known coordinate."""

    client: str = ""


class MoveTo(NamedTuple):
    """The whole positioner to a place: macro, wait, micro; or the micro-stage alone.

    Attributes
    ----------
    position : float
        m.
    client : str
        Who sent it.
    replace : bool
        Here and in other moves: a motion under way (no homing, no braking) ends as "superseded" and
        this one begins where that one is; else the move is refused.
    """

    position: float
    client: str = ""
    replace: bool = False


class MoveBy(NamedTuple):
    """The whole positioner by a distance from the target of the last move, else from the present
    position.

    Attributes
    ----------
    distance : float
        m.
    client : str
        Who sent it.
    replace : bool
        As for `MoveTo`.
    """

    distance: float
    client: str = ""
    replace: bool = False


class MoveMacro(NamedTuple):
    """The macro-stage to a count; the micro-stage goes off.

    Attributes
    ----------
    counts : float
        Homed frame, a whole number.
    client : str
        Who sent it.
    replace : bool
        As for `MoveTo`.
    """

    counts: float
    client: str = ""
    replace: bool = False


class MoveMicro(NamedTuple):
    """The micro-stage to a contraction; the macro-stage stands.

    Attributes
    ----------
    position : float
        m.
    client : str
        Who sent it.
    replace : bool
        As for `MoveTo`.
    """

    position: float
    client: str = ""
    replace: bool = False


class MoveMacroBy(NamedTuple):
    """The macro-stage by some counts from its last target, else from where it is.

    Attributes
    ----------
    counts : float
        It goes to the nearest whole count; the next one adds to the target as it was meant.
    client : str
        Who sent it.
    replace : bool
        As for `MoveTo`.
    """

    counts: float
    client: str = ""
    replace: bool = False


class MoveMicroBy(NamedTuple):
    """The micro-stage by a distance from the target that it holds, else from where it is.

    Attributes
    ----------
    distance : float
        m.
    client : str
        Who sent it.
    replace : bool
        As for `MoveTo`.
    """

    distance: float
    client: str = ""
    replace: bool = False


class MovePoint(NamedTuple):
    """Both axes to a point, on a straight line.

    Attributes
    ----------
    x, y : float
        m.
    client : str
        Who sent it.
    replace : bool
        Here and in other moves of axes: a motion under way (no homing, no braking) ends as
        "superseded", comes to rest on its line or path, and this one begins there.
    """

    x: float
    y: float
    client: str = ""
    replace: bool = False


class MovePointBy(NamedTuple):
    """Both axes by a distance, on a straight line, each from the target that it holds, else from
    where it is.

    Attributes
    ----------
    x, y : float
        m.
    client : str
        Who sent it.
    replace : bool
        As for `MovePoint`.
    """

    x: float
    y: float
    client: str = ""
    replace: bool = False


class MoveAxis(NamedTuple):
    """One axis of two to a place; the other one stands.

    Attributes
    ----------
    axis : str
        One of `AXES`.
    position : float
        m.
    client : str
        Who sent it.
    replace : bool
        As for `MovePoint`.
    """

    axis: str
    position: float
    client: str = ""
    replace: bool = False


class MoveAxisBy(NamedTuple):
    """One axis of two by a distance from the target that it holds, else from where it is.

    Attributes
    ----------
    axis : str
        One of `AXES`.
    distance : float
        m.
    client : str
        Who sent it.
    replace : bool
        As for `MovePoint`.
    """

    axis: str
    distance: float
    client: str = ""
    replace: bool = False


class Jog(NamedTuple):
    """One stage at a speed until another request; 0 ends it.

    A jog of the same stage under way takes the new speed and keeps its id.

    Attributes
    ----------
    stage : str
        "macro" or "micro", or one of `AXES`.
    speed : float
        m/s.
    client : str
        Who sent it.
    """

    stage: str
    speed: float
    client: str = ""


class Stop(NamedTuple):
    """Decelerate. The micro-stage stops where it is and is held there."""

    client: str = ""


class EmergencyStop(NamedTuple):
    """All outputs safe from the very next step; leaves the positioner disabled."""

    client: str = ""


class Zero(NamedTuple):
    """Set the laser and the relative reading to zero here. Absolute coordinates stay."""

    client: str = ""


class Fan(NamedTuple):
    """Fan on or off."""

    on: bool
    client: str = ""


class Programme(NamedTuple):
    """Run a plan.

    Attributes
    ----------
    plan : Any
        Of the two-stage machine `supervisor.Plan`, macro targets in counts of the homed frame,
        micro targets in m; of a machine of one stage `machines.sequence.Plan`, in m of that frame;
        of two axes a pair of these.
    client : str
        Who sent it.
    """

    plan: Any
    client: str = ""


class SetGains(NamedTuple):
    """New values of gains (of `control.settings.Control`, or of a machine's law), all or none.

    Attributes
    ----------
    changes : tuple[tuple[str, float | int | str], ...]
        Pairs of a dotted path ("pd_tuned.now", "sequence.wait") and its value, in the stored unit.
    client : str
        Who sent it.
    """

    changes: tuple[tuple[str, float | int | str], ...]
    client: str = ""


class SetSpeed(NamedTuple):
    """The fastest that the moves of a stage which is led by set points go, from the next one on.

    Attributes
    ----------
    stage : str
        "macro", or one of `AXES`.
    speed : float
        m/s, up to that of the machine's settings.
    client : str
        Who sent it.
    """

    stage: str
    speed: float
    client: str = ""


class SetLimits(NamedTuple):
    """Soft limits for whatever moves from now on, within the machine's own.

    Attributes
    ----------
    limits : SoftLimits | None
        None for the machine's own.
    client : str
        Who sent it.
    """

    limits: SoftLimits | None = None
    client: str = ""


class ClearFault(NamedTuple):
    """Fault to disabled.

    Attributes
    ----------
    gone : bool
        Whether the caller has renewed the guard and the cause is away.
    client : str
        Who sent it.
    """

    gone: bool = False
    client: str = ""


class LinkLost(NamedTuple):
    """The client in control is gone; motion ends as "lost".

    Attributes
    ----------
    action : str
        "stop": come to rest, micro-stage off; "hold": come to rest, the micro-stage is held where
        it is.
    client : str
        Who it was.
    """

    action: str = "stop"
    client: str = ""


ONE_MOVES = (MoveTo, MoveBy, MoveMacro, MoveMacroBy, MoveMicro, MoveMicroBy)
AXES_MOVES = (MovePoint, MovePointBy, MoveAxis, MoveAxisBy)

Request = (
    Enable
    | Disable
    | Home
    | MoveTo
    | MoveBy
    | MoveMacro
    | MoveMicro
    | MoveMacroBy
    | MoveMicroBy
    | MovePoint
    | MovePointBy
    | MoveAxis
    | MoveAxisBy
    | Jog
    | Stop
    | EmergencyStop
    | Zero
    | Fan
    | Programme
    | SetGains
    | SetSpeed
    | SetLimits
    | ClearFault
    | LinkLost
)


class Change(NamedTuple):
    """A setting that was changed.

    Attributes
    ----------
    path : str
        Dotted path within the gains.
    old : float | int | str
        Value before, in the stored unit.
    new : float | int | str
        Value in force.
    """

    path: str
    old: float | int | str
    new: float | int | str


class Accepted(NamedTuple):
    """The request is being done.

    Attributes
    ----------
    id : int
        Number of the motion it began (1, 2, ...), else 0.
    changes : tuple[Change, ...]
        Settings that it changed.
    """

    id: int = 0
    changes: tuple[Change, ...] = ()


class Refused(NamedTuple):
    """Nothing was changed and nothing moves.

    Attributes
    ----------
    reason : str
        Why.
    remedy : str
        What would help.
    beyond : bool
        Whether a value is out of range; else it is not the time for the request.
    """

    reason: str
    remedy: str
    beyond: bool = False


Reply = Accepted | Refused


class Event(NamedTuple):
    """Something happened.

    Attributes
    ----------
    time : float
        Time of the samples, s.
    kind : str
        "mode" (a transition), "move" (a programme's next move, or one cut off), "trust", "gains",
        "limits", "zero", "fan".
    from_mode : str
        By name.
    to_mode : str
        By name.
    cause : str
        A word or two, for "mode" one of the table's.
    evidence : Evidence
        Numbers and words by name, the unit in the name.
    """

    time: float
    kind: str
    from_mode: str
    to_mode: str
    cause: str
    evidence: Evidence


class Finished(NamedTuple):
    """The one end of an accepted motion.

    Attributes
    ----------
    id : int
        Number of the motion.
    outcome : str
        One of `OUTCOMES`.
    position : float
        Where the whole positioner is then, m.
    uncertainty : float
        How well that is known, m; infinite where never homed.
    evidence : Evidence
        Numbers and words by name, the unit in the name.
    """

    id: int
    outcome: str
    position: float
    uncertainty: float
    evidence: Evidence


Notice = Event | Finished
