"""The table of requests behind all protocols."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Refused
from macromicro.place import LENGTH, Place

EVERYONE = "all"  # any connected client
TOKEN = "token"  # clients that gave the token, if one is required
CONTROL = "control"  # the holder of control
STOPS = "all, at once"  # any connected client, past every queue

MOVES, WAKES, ENDS = "moves", "wakes", "ends"
_POINTS = (m.MovePoint, m.MovePointBy)


class Field(NamedTuple):
    """One value of a request, as the message has it."""

    name: str
    unit: str = ""  # "" for a flag
    lo: float = 0.0
    hi: float = 0.0
    key: str = "value"  # name in JSON
    ends: str = ""  # soft limits that may be given by name: "whole", "macro", "micro"
    choices: tuple[str, ...] = ()
    default: float | None = None  # what is meant where it is left out; None: it is needed


class RequestType(NamedTuple):
    """One kind of request."""

    name: str  # in JSON
    message: Any
    header: str  # in SCPI; {stage} stands for a choice of the first field
    text: str
    fields: tuple[Field, ...] = ()
    access: str = CONTROL
    effect: str = ""  # MOVES, WAKES, ENDS or ""; what begins a `motion` moves
    motion: str = ""  # name of the motion that it begins, before its target

    @property
    def replaces(self) -> bool:
        """Whether it may replace a motion under way."""
        return "replace" in self.message._fields

    @property
    def is_point(self) -> bool:
        """Whether its fields are coordinates, some of which may be left out."""
        return self.message in _POINTS

    def request(self, *values: Any, **given: Any) -> Any:
        """The message of some values, one for each field; None: not of this stage of a point."""
        if self.is_point:
            each = zip(self.fields, values, strict=True)
            values = ({field.name: value for field, value in each if value is not None},)
        elif self.message is m.SetPoints:
            half = len(values) // 2
            values = (tuple(zip(values[:half], values[half:], strict=True)),)
        return self.message(*values, **given)

    def words(self, values: tuple[Any, ...], place: Place = LENGTH) -> str:
        """A motion with its target: "move to 12 mm"."""
        shown = [
            _shown(f.unit, v, place)
            for f, v in zip(self.fields, values, strict=False)
            if f.unit and v is not None
        ]
        return " ".join((self.motion, *shown))


def _shown(unit: str, value: float, place: Place) -> str:
    if unit == "m":
        return f"{value * place.per:.6g} {place.unit}"
    return f"{value:.0f} counts" if unit == "counts" else f"{value:.6g} {unit}"


# Lengths: wider than any machine's travel; what is out of the soft limits is refused with their
# values.
REQUESTS: tuple[RequestType, ...] = (
    RequestType(
        "move to",
        m.MoveTo,
        "MOVE[:ABSolute]",
        "Move the whole positioner to a position: macro-stage, wait, micro-stage; or the "
        "micro-stage alone if it reaches the position.",
        (Field("position", "m", -10.0, 10.0, ends="whole"),),
        motion="move to",
    ),
    RequestType(
        "move by",
        m.MoveBy,
        "MOVE:RELative",
        "Move the whole positioner by a distance from the target of the last move, else from its "
        "position.",
        (Field("distance", "m", -10.0, 10.0),),
        motion="move by",
    ),
    RequestType(
        "move macro",
        m.MoveMacro,
        "MOVE:MACRo",
        "Move the macro-stage alone; the micro-stage is switched off.",
        (Field("position", "counts", -1e6, 1e6, ends="macro"),),
        motion="macro move to",
    ),
    RequestType(
        "move micro",
        m.MoveMicro,
        "MOVE:MICRo",
        "Move the micro-stage alone to a contraction.",
        (Field("contraction", "m", -1.0, 1.0, ends="micro"),),
        motion="micro move to",
    ),
    RequestType(
        "move macro by",
        m.MoveMacroBy,
        "MOVE:MACRo:RELative",
        "Move the macro-stage alone by some counts from its last target, else from its position; "
        "the micro-stage is switched off.",
        (Field("distance", "counts", -1e6, 1e6),),
        motion="macro move by",
    ),
    RequestType(
        "move micro by",
        m.MoveMicroBy,
        "MOVE:MICRo:RELative",
        "Move the micro-stage alone by a distance from the contraction that it holds, else from "
        "its position.",
        (Field("distance", "m", -1.0, 1.0),),
        motion="micro move by",
    ),
    RequestType(
        "move point",
        m.MovePoint,
        "MOVE:POINt",
        "Move all stages of a machine of several to a point on a straight line, in their order.",
        (
            Field("x", "m", -10.0, 10.0, key="x", ends="x"),
            Field("y", "m", -10.0, 10.0, key="y", ends="y"),
        ),
        motion="move to",
    ),
    RequestType(
        "move point by",
        m.MovePointBy,
        "MOVE:POINt:RELative",
        "Move all stages of a machine of several by distances on a straight line, each from the "
        "target that it holds, else from its position.",
        (Field("x", "m", -10.0, 10.0, key="x"), Field("y", "m", -10.0, 10.0, key="y")),
        motion="move by",
    ),
    RequestType(
        "move axis",
        m.MoveAxis,
        "MOVE:{stage}",
        "Move the {stage} of a machine of several stages alone.",
        (
            Field("axis", key="axis", choices=m.AXES),
            Field("position", "m", -10.0, 10.0, ends="{stage}"),
        ),
        motion="move axis to",
    ),
    RequestType(
        "move axis by",
        m.MoveAxisBy,
        "MOVE:{stage}:RELative",
        "Move the {stage} of a machine of several stages alone by a distance from the target that "
        "it holds, else from its position.",
        (Field("axis", key="axis", choices=m.AXES), Field("distance", "m", -10.0, 10.0)),
        motion="move axis by",
    ),
    RequestType(
        "stop",
        m.Stop,
        "STOP",
        "Decelerate; *OPC? waits for rest. Pending commands of this client are dropped.",
        access=STOPS,
        effect=ENDS,
    ),
    RequestType(
        "emergency",
        m.EmergencyStop,
        "ABORt",
        "Emergency stop: safe outputs before the next control step, the positioner "
        "disabled. Pending commands of this client are dropped.",
        access=STOPS,
        effect=ENDS,
    ),
    RequestType(
        "jog",
        m.Jog,
        "JOG:{stage}",
        "Move the {stage} at a speed until the next JOG; 0 ends it. With a hold time it ends as "
        "lost unless another JOG renews it within that time. *OPC? waits only for its "
        "deceleration.",
        (
            Field("stage", key="stage", choices=(*m.STAGES, *m.AXES)),
            Field("speed", "m/s", -1.0, 1.0, key="speed"),
            Field("hold", "s", 0.0, m.JOG_HOLD, key="hold", default=0.0),
        ),
        effect=MOVES,  # unless its speed is 0
    ),
    RequestType(
        "follow",
        m.Follow,
        "FOLLow:{stage}",
        "Follow set points of FOLLow:POINt with the {stage} until FOLLow:END, a stop or another "
        "motion; without a set point for the hold time it comes to rest, and the motion ends as "
        "lost.",
        (
            Field("stage", key="stage", choices=(*m.STAGES, *m.AXES, m.ALL)),
            Field("hold", "s", m.SHORTEST_HOLD, m.LONGEST_HOLD, key="hold"),
        ),
        motion="follow",
    ),
    RequestType(
        "end follow",
        m.EndFollow,
        "FOLLow:END",
        "Come to rest on the last set point; the motion ends as done.",
        effect=ENDS,
    ),
    RequestType(
        "home", m.Home, "HOME", "Find the low end stop and set the position.", motion="homing"
    ),
    RequestType("zero", m.Zero, "ZERO", "Set the laser and the relative reading to zero."),
    RequestType(
        "enable",
        m.Enable,
        "ENABle",
        "From disabled to ready; no effect if enabled. Nothing moves.",
        effect=WAKES,
    ),
    RequestType("disable", m.Disable, "DISable", "Switch both stages off at once.", effect=ENDS),
    RequestType("fan", m.Fan, "FAN", "Switch the actuator's fan.", (Field("state", key="on"),)),
    RequestType(
        "clear",
        m.ClearFault,
        "FAULt:CLEar",
        "Clear a fault whose cause is gone; the machine is disabled.",
        effect=WAKES,
    ),
    # What these carry (a plan, pairs, three pairs of ends) each protocol reads in its own way.
    RequestType("programme", m.Programme, "PROGram:RUN", "Run it.", motion="programme"),
    RequestType("gains", m.SetGains, "GAIN", "Set it."),
    RequestType(
        "set speed",
        m.SetSpeed,
        "SPEed:{stage}",
        "Maximum speed of moves of the {stage}, from the next one on, up to that of the settings; "
        "not of programmes and jogs, not on the two-stage machine, and not while it moves.",
        (
            Field("stage", key="stage", choices=(m.MACRO, *m.AXES)),
            Field("speed", "m/s", 0.0, 1e3, key="speed"),
        ),
    ),
    RequestType(
        "limits",
        m.SetLimits,
        "LIMit:DEFault",
        "Reset the soft limits to those at the machine's start.",
    ),
)
# Set points: they cost no reply, no queue and no file. The machine follows the newest one.
STREAMED: tuple[RequestType, ...] = (
    RequestType(
        "point",
        m.SetPoint,
        "FOLLow:POINt",
        "Set point of a FOLLow, which continues with the velocity (0 unless given) until the next "
        "one; beyond the soft limits it is clipped.",
        (
            Field("position", "m", -10.0, 10.0),
            Field("velocity", "m/s", -1e3, 1e3, key="velocity", default=0.0),
        ),
    ),
    RequestType(
        "points",
        m.SetPoints,
        "FOLLow:POINt:ALL",
        "Set point of a FOLLow:ALL: all stages, and their velocities.",
        (
            Field("x", "m", -10.0, 10.0, key="x"),
            Field("y", "m", -10.0, 10.0, key="y"),
            Field("x velocity", "m/s", -1e3, 1e3, key="x_velocity", default=0.0),
            Field("y velocity", "m/s", -1e3, 1e3, key="y_velocity", default=0.0),
        ),
    ),
)


def of_axes(axes: tuple[str, ...]) -> dict[str, RequestType]:
    """The requests of a machine of these stages; of one without named stages those of `AXES`."""
    return _of(REQUESTS, axes or m.AXES)


def streamed(axes: tuple[str, ...]) -> dict[str, RequestType]:
    """The set points of a machine of these stages."""
    return _of(STREAMED, axes or m.AXES)


@cache
def _of(kinds: tuple[RequestType, ...], axes: tuple[str, ...]) -> dict[str, RequestType]:
    return {each.name: _with_axes(each, axes) for each in kinds}


def _with_axes(kind: RequestType, axes: tuple[str, ...]) -> RequestType:
    if kind.is_point:
        like = kind.fields[0]
        each = ((axis, axis if like.ends else "") for axis in axes)
        fields = tuple(like._replace(name=axis, key=axis, ends=ends) for axis, ends in each)
        return kind._replace(fields=fields)
    if kind.message is m.SetPoints:
        place, speed = kind.fields[0], kind.fields[-1]
        places = tuple(place._replace(name=axis, key=axis) for axis in axes)
        speeds = (speed._replace(name=f"{a} velocity", key=f"{a}_velocity") for a in axes)
        return kind._replace(fields=(*places, *speeds))
    fields = tuple(
        field._replace(choices=_named(field.choices, axes))
        if set(m.AXES) <= set(field.choices)
        else field
        for field in kind.fields
    )
    return kind._replace(fields=fields)


def _named(choices: tuple[str, ...], axes: tuple[str, ...]) -> tuple[str, ...]:
    """Choices among stages, with these instead of `AXES`."""
    others = tuple(choice for choice in choices if choice not in (*m.AXES, m.ALL))
    return (*others, *axes, *((m.ALL,) if m.ALL in choices else ()))


KINDS = of_axes(m.AXES)
POINTS = streamed(m.AXES)
_EFFECTS = {each.message: each.effect or (MOVES if each.motion else "") for each in REQUESTS}
_EFFECTS[m.LinkLost] = ENDS


def ends(request: Any) -> bool:
    """Whether it only ends a motion; such a request never expires."""
    if isinstance(request, m.Jog):
        return isinstance(request.speed, int | float) and request.speed == 0.0
    return _EFFECTS.get(type(request)) == ENDS


def moves(request: Any) -> bool:
    return _EFFECTS.get(type(request)) == MOVES and not ends(request)


def begins(request: Any) -> bool:
    """Whether something moves, or could from then on."""
    return moves(request) or _EFFECTS.get(type(request)) == WAKES


def place(point: m.SetPoint | m.SetPoints) -> tuple[tuple[float, float], ...]:
    """Position and velocity of each stage at a set point."""
    return point.each if isinstance(point, m.SetPoints) else ((point.position, point.velocity),)


_AGAIN = "ask again if still needed"
OVERTAKEN = Refused("a stop came before it began", _AGAIN)
TOO_LATE = Refused("it came too late: the loop was delayed", _AGAIN)


class Order(NamedTuple):
    """A request with its time and expiry on the monotonic clock."""

    serial: int
    request: Any
    asked: int  # ns
    until: int  # ns
    trial: bool = False  # only check whether it would be refused


def void(order: Order, emergency: int, now: int) -> Refused | None:
    """Why an order is late, or older than an emergency stop; else None (times in ns)."""
    if ends(order.request):
        return None
    if order.asked <= emergency:
        return OVERTAKEN
    return TOO_LATE if now > order.until else None
