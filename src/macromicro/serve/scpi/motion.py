"""What moves the positioner, and what ends it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from macromicro.control.live.messages import (
    MACRO,
    MICRO,
    ClearFault,
    Disable,
    Enable,
    Fan,
    Home,
    Jog,
    MoveBy,
    MoveMacro,
    MoveMicro,
    MoveTo,
    Zero,
)
from macromicro.serve.scpi.answers import number
from macromicro.serve.scpi.command import ALWAYS, CONTROL, Answer, Call, Command, Handler
from macromicro.serve.scpi.errors import ScpiError, quoted
from macromicro.serve.scpi.parameters import Flag, Number, Word
from macromicro.serve.scpi.status import OFF

if TYPE_CHECKING:
    from macromicro.serve.scpi.session import Session

_ENDS = ("MINimum", "MAXimum")
# Wider than any machine's travel: what is out of the soft limits is told with their values.
_LENGTH = Number("position", "m", -10.0, 10.0)
_COUNTS = Number("position", "counts", -1e6, 1e6, whole=True, instead=_ENDS)
_SPEED = Number("speed", "m/s", -1.0, 1.0)
_WAY = Word("way", ("REPLace",), optional=True)  # the motion under way ends as superseded
_WHICH = Word("end", _ENDS, optional=True)


def _wanted(call: Call, kind: str) -> float:
    """The position that is asked for: a number, or an end of what is allowed now."""
    value = call.values[0]
    return call.session.device.extreme(kind, value) if isinstance(value, str) else float(value)


def _absolute(call: Call) -> Answer:
    session, position = call.session, _wanted(call, "whole")
    motion = session.order(MoveTo(position, session.client, bool(call.values[1])))
    session.began(motion, f"move to {position * 1e3:.6g} mm")
    return None


def _relative(call: Call) -> Answer:
    session, (distance, way) = call.session, call.values
    motion = session.order(MoveBy(distance, session.client, bool(way)))
    session.began(motion, f"move by {distance * 1e3:.6g} mm")
    return None


def _macro(call: Call) -> Answer:
    session, counts = call.session, _wanted(call, "macro")
    motion = session.order(MoveMacro(counts, session.client, bool(call.values[1])))
    session.began(motion, f"macro move to {counts:.0f} counts")
    return None


def _micro(call: Call) -> Answer:
    session, contraction = call.session, _wanted(call, "micro")
    if not isinstance(call.values[0], str):
        contraction = round(contraction * 1e3, 9)
    motion = session.order(MoveMicro(contraction, session.client, bool(call.values[1])))
    session.began(motion, f"micro move to {contraction:.6g} mm")
    return None


def _asked(kind: str, scale: float, target: Callable[[Session], float]) -> Handler:
    """The target, or an end of what is allowed now, times `scale`."""

    def act(call: Call) -> Answer:
        (end,) = call.values
        found = call.session.device.extreme(kind, end) if end else target(call.session)
        return number(round(found * scale, 9))

    return act


def _jog(stage: str) -> Handler:
    def act(call: Call) -> Answer:
        session, (speed,) = call.session, call.values
        motion = session.order(Jog(stage, speed, session.client))
        if speed == 0.0:
            session.ends(motion)
        return None

    return act


def stop(call: Call) -> Answer:
    """Decelerate, whatever moves."""
    call.session.stop()
    return None


def _abort(call: Call) -> Answer:
    call.session.emergency()
    return None


def _home(call: Call) -> Answer:
    session = call.session
    session.began(session.order(Home(session.client)), "homing")
    return None


def _enable(call: Call) -> Answer:
    session = call.session
    try:
        session.order(Enable(session.client))
    except ScpiError as refused:
        if refused.number != -221 or session.snapshot().mode in OFF:
            raise
    return None


def _disable(call: Call) -> Answer:
    call.session.order(Disable(call.session.client))
    return None


def _zero(call: Call) -> Answer:
    call.session.order(Zero(call.session.client))
    return None


def _fan(call: Call) -> Answer:
    call.session.order(Fan(call.values[0], call.session.client))
    return None


def _clear(call: Call) -> Answer:
    call.session.order(ClearFault(client=call.session.client))
    return None


def _outcome(call: Call) -> Answer:
    end = call.session.device.station.finished(int(call.values[0]), 0.0)
    if end is None:
        return f'"unknown",{number(float("nan"))},{number(float("nan"))},""'
    where = f"{number(end.position * 1e3)},{number(end.uncertainty * 1e3)}"
    facts = ", ".join(f"{name} {value}" for name, value in end.evidence.items())
    return f"{quoted(end.outcome)},{where},{quoted(facts[:1000])}"


COMMANDS = (
    Command(
        "MOVE[:ABSolute]",
        _absolute,
        "The whole positioner to a position: macro-stage, wait, micro-stage; or the "
        "micro-stage alone where that reaches it.",
        (_LENGTH._replace(instead=_ENDS), _WAY),
        access=CONTROL,
    ),
    Command(
        "MOVE[:ABSolute]?",
        _asked("whole", 1e3, lambda session: session.device.target()),
        "Where the whole positioner is going or is held; or between which ends it may be told "
        "to go.",
        (_WHICH,),
        answer="position mm; 9.91E37 where it goes nowhere and holds nothing",
    ),
    Command(
        "MOVE:RELative",
        _relative,
        "The whole positioner by a distance, from the target that is held, else from where it is.",
        (_LENGTH._replace(name="distance"), _WAY),
        access=CONTROL,
    ),
    Command(
        "MOVE:MACRo",
        _macro,
        "The macro-stage alone; the micro-stage goes off.",
        (_COUNTS, _WAY),
        access=CONTROL,
    ),
    Command(
        "MOVE:MACRo?",
        _asked("macro", 1.0, lambda session: session.snapshot().macro_reference),
        "Its set point, or these ends.",
        (_WHICH,),
        answer="counts",
    ),
    Command(
        "MOVE:MICRo",
        _micro,
        "The micro-stage alone, to a contraction; the macro-stage stands.",
        (_LENGTH._replace(name="contraction", lo=-1.0, hi=1.0, instead=_ENDS), _WAY),
        access=CONTROL,
    ),
    Command(
        "MOVE:MICRo?",
        _asked("micro", 1.0, lambda session: session.snapshot().micro_reference_mm),
        "Its set point, or these ends.",
        (_WHICH,),
        answer="mm",
    ),
    Command(
        "MOVE:NUMBer?",
        lambda call: str(call.session.snapshot().motion),
        "The motion under way, whoever began it.",
        answer="number, 0 for none",
    ),
    Command(
        "MOVE:OUTCome?",
        _outcome,
        "How a motion ended.",
        (Number("motion", lo=1, hi=1e9, whole=True),),
        answer='"outcome", position mm, uncertainty mm, "evidence"; "unknown" where it has not '
        "ended or is not known",
    ),
    Command(
        "STOP",
        stop,
        "Decelerate; *OPC? waits for rest. What this client has sent before and is not done "
        "yet is dropped.",
        access=ALWAYS,
    ),
    Command(
        "ABORt",
        _abort,
        "Emergency stop: all outputs safe before the next control step, the positioner "
        "disabled. What this client has sent before and is not done yet is dropped.",
        access=ALWAYS,
    ),
    Command(
        "JOG:MACRo",
        _jog(MACRO),
        "The macro-stage at a speed until told otherwise; 0 ends it. *OPC? waits for it only "
        "once it is being ended.",
        (_SPEED,),
        access=CONTROL,
    ),
    Command(
        "JOG:MICRo",
        _jog(MICRO),
        "The micro-stage at a speed, likewise.",
        (_SPEED,),
        access=CONTROL,
    ),
    Command(
        "HOME",
        _home,
        "Find the low end stop; the position is trusted afterwards.",
        access=CONTROL,
    ),
    Command("ZERO", _zero, "Laser and relative reading to zero here.", access=CONTROL),
    Command(
        "ENABle",
        _enable,
        "From disabled to ready; as it is where it is enabled. Nothing moves.",
        access=CONTROL,
    ),
    Command("DISable", _disable, "Both stages off at once.", access=CONTROL),
    Command("FAN", _fan, "The actuator's fan.", (Flag("state"),), access=CONTROL),
    Command(
        "FAULt:CLEar", _clear, "Clear a fault whose cause is gone: to disabled.", access=CONTROL
    ),
)
