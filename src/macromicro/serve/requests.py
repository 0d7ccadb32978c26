"""What a client may ask of the machine: the table behind all protocols."""

from __future__ import annotations

from typing import Any, NamedTuple

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Refused
from macromicro.place import LENGTH, Place

EVERYONE = "all"  # whoever is connected
TOKEN = "token"  # who has given the token, where there is one
CONTROL = "control"  # who holds control, the token given
STOPS = "all, at once"  # whoever is connected, before all that waits

MOVES, WAKES, ENDS = "moves", "wakes", "ends"


class Field(NamedTuple):
    """One value of a request, as the message has it: from `lo` to `hi` in `unit` ("" for a flag).

    `key`: its name in JSON; `ends`: the soft limits ("whole", "macro", "micro") whose ends may
    be given by name; `choices`: words, one of which it is.
    """

    name: str
    unit: str = ""
    lo: float = 0.0
    hi: float = 0.0
    key: str = "value"
    ends: str = ""
    choices: tuple[str, ...] = ()


class RequestType(NamedTuple):
    """One kind of request.

    `name`: in JSON; `message`: its class; `header`: in SCPI, "{stage}" standing for one of the
    first field's choices; `text`: for the manual; `access`: who may; `effect`: MOVES something,
    WAKES the machine so that something could move, ENDS a motion and nothing else, or none of
    them; `replaces`: may it replace a motion under way? `motion`: what the motion is called
    before its target.
    """

    name: str
    message: Any
    header: str
    text: str
    fields: tuple[Field, ...] = ()
    access: str = CONTROL
    effect: str = ""
    replaces: bool = False
    motion: str = ""

    def words(self, values: tuple[Any, ...], place: Place = LENGTH) -> str:
        """A motion with its target: "move to 12 mm"; `place`: what places are counted in."""
        shown = [
            _shown(f.unit, v, place) for f, v in zip(self.fields, values, strict=True) if f.unit
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
        "The whole positioner to a position: macro-stage, wait, micro-stage; or the "
        "micro-stage alone where that reaches it.",
        (Field("position", "m", -10.0, 10.0, ends="whole"),),
        effect=MOVES,
        replaces=True,
        motion="move to",
    ),
    RequestType(
        "move by",
        m.MoveBy,
        "MOVE:RELative",
        "The whole positioner by a distance, from the target of the last move, else from where it "
        "is.",
        (Field("distance", "m", -10.0, 10.0),),
        effect=MOVES,
        replaces=True,
        motion="move by",
    ),
    RequestType(
        "move macro",
        m.MoveMacro,
        "MOVE:MACRo",
        "The macro-stage alone; the micro-stage goes off.",
        (Field("position", "counts", -1e6, 1e6, ends="macro"),),
        effect=MOVES,
        replaces=True,
        motion="macro move to",
    ),
    RequestType(
        "move micro",
        m.MoveMicro,
        "MOVE:MICRo",
        "The micro-stage alone, to a contraction; the macro-stage stands.",
        (Field("contraction", "m", -1.0, 1.0, ends="micro"),),
        effect=MOVES,
        replaces=True,
        motion="micro move to",
    ),
    RequestType(
        "move macro by",
        m.MoveMacroBy,
        "MOVE:MACRo:RELative",
        "The macro-stage alone by some counts, from its last target, else from where it is; the "
        "micro-stage goes off.",
        (Field("distance", "counts", -1e6, 1e6),),
        effect=MOVES,
        replaces=True,
        motion="macro move by",
    ),
    RequestType(
        "move micro by",
        m.MoveMicroBy,
        "MOVE:MICRo:RELative",
        "The micro-stage alone by a distance, from the contraction that it holds, else from where "
        "it is.",
        (Field("distance", "m", -1.0, 1.0),),
        effect=MOVES,
        replaces=True,
        motion="micro move by",
    ),
    RequestType(
        "move point",
        m.MovePoint,
        "MOVE:POINt",
        "Both axes of a machine of two to a point, on a straight line.",
        (
            Field("x", "m", -10.0, 10.0, key="x", ends="x"),
            Field("y", "m", -10.0, 10.0, key="y", ends="y"),
        ),
        effect=MOVES,
        replaces=True,
        motion="move to",
    ),
    RequestType(
        "move point by",
        m.MovePointBy,
        "MOVE:POINt:RELative",
        "Both axes of a machine of two by a distance, on a straight line, each from the target "
        "that it holds, else from where it is.",
        (
            Field("x", "m", -10.0, 10.0, key="x"),
            Field("y", "m", -10.0, 10.0, key="y"),
        ),
        effect=MOVES,
        replaces=True,
        motion="move by",
    ),
    RequestType(
        "move axis",
        m.MoveAxis,
        "MOVE:{stage}",
        "The {stage} of a machine of two alone; the other one stands.",
        (
            Field("axis", key="axis", choices=m.AXES),
            Field("position", "m", -10.0, 10.0, ends="{stage}"),
        ),
        effect=MOVES,
        replaces=True,
        motion="move axis to",
    ),
    RequestType(
        "move axis by",
        m.MoveAxisBy,
        "MOVE:{stage}:RELative",
        "The {stage} of a machine of two alone by a distance, from the target that it holds, else "
        "from where it is.",
        (
            Field("axis", key="axis", choices=m.AXES),
            Field("distance", "m", -10.0, 10.0),
        ),
        effect=MOVES,
        replaces=True,
        motion="move axis by",
    ),
    RequestType(
        "stop",
        m.Stop,
        "STOP",
        "Decelerate; *OPC? waits for rest. What this client has sent before and is not done "
        "yet is dropped.",
        access=STOPS,
        effect=ENDS,
    ),
    RequestType(
        "emergency",
        m.EmergencyStop,
        "ABORt",
        "Emergency stop: all outputs safe before the next control step, the positioner "
        "disabled. What this client has sent before and is not done yet is dropped.",
        access=STOPS,
        effect=ENDS,
    ),
    RequestType(
        "jog",
        m.Jog,
        "JOG:{stage}",
        "The {stage} at a speed until the next JOG; 0 ends it. *OPC? waits for it only "
        "once it is being ended.",
        (
            Field("stage", key="stage", choices=(*m.STAGES, *m.AXES)),
            Field("speed", "m/s", -1.0, 1.0, key="speed"),
        ),
        effect=MOVES,  # unless its speed is 0
    ),
    RequestType(
        "home",
        m.Home,
        "HOME",
        "Find the low end stop; the position is trusted afterwards.",
        effect=MOVES,
        motion="homing",
    ),
    RequestType("zero", m.Zero, "ZERO", "Laser and relative reading to zero here."),
    RequestType(
        "enable",
        m.Enable,
        "ENABle",
        "From disabled to ready; as it is where it is enabled. Nothing moves.",
        effect=WAKES,
    ),
    RequestType("disable", m.Disable, "DISable", "Both stages off at once.", effect=ENDS),
    RequestType("fan", m.Fan, "FAN", "The actuator's fan.", (Field("state", key="on"),)),
    RequestType(
        "clear",
        m.ClearFault,
        "FAULt:CLEar",
        "Clear a fault whose cause is gone: to disabled.",
        effect=WAKES,
    ),
    # What these carry (a plan, pairs, three pairs of ends) each protocol reads in its own way.
    RequestType(
        "programme", m.Programme, "PROGram:RUN", "Run it.", effect=MOVES, motion="programme"
    ),
    RequestType("gains", m.SetGains, "GAIN", "Set it."),
    RequestType(
        "set speed",
        m.SetSpeed,
        "SPEed:{stage}",
        "The fastest that moves of the {stage} go, from the next one on: of a machine of one "
        "stage or of two axes, up to the speed of its settings. Programmes and jogs have their "
        "own; not while it moves.",
        (
            Field("stage", key="stage", choices=(m.MACRO, *m.AXES)),
            Field("speed", "m/s", 0.0, 1e3, key="speed"),
        ),
    ),
    RequestType(
        "limits", m.SetLimits, "LIMit:DEFault", "The limits that the machine was started with."
    ),
)
KINDS = {each.name: each for each in REQUESTS}
_EFFECTS = {each.message: each.effect for each in REQUESTS} | {m.LinkLost: ENDS}


def ends(request: Any) -> bool:
    """Does it end a motion, and nothing else? Such a request is never void."""
    if isinstance(request, m.Jog):
        return isinstance(request.speed, int | float) and request.speed == 0.0
    return _EFFECTS.get(type(request)) == ENDS


def moves(request: Any) -> bool:
    """Would something move?"""
    return _EFFECTS.get(type(request)) == MOVES and not ends(request)


def begins(request: Any) -> bool:
    """Would something move, or could it from then on? Behind a stop it would be a surprise."""
    return moves(request) or _EFFECTS.get(type(request)) == WAKES


_AGAIN = "ask again, if it is still wanted"
OVERTAKEN = Refused("a stop came before it began", _AGAIN)
TOO_LATE = Refused("it came too late: the loop had been held up", _AGAIN)


class Order(NamedTuple):
    """A request, `asked` for at one time and void from another one on (`until`) [ns of the
    monotonic clock]. `trial`: only tell whether it would be refused now."""

    serial: int
    request: Any
    asked: int
    until: int
    trial: bool = False


def void(order: Order, emergency: int, now: int) -> Refused | None:
    """Why nothing is to be done about it `now`, after an emergency stop of the time
    `emergency`; None if it is to be done [ns]."""
    if ends(order.request):
        return None
    if order.asked <= emergency:
        return OVERTAKEN
    return TOO_LATE if now > order.until else None
