"""Commands that begin or end motions."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

from macromicro.control.live.messages import ALL, AXES, STAGES, Enable, Refused
from macromicro.serve import unconfirmed
from macromicro.serve.requests import POINTS, Field, RequestType, ends, of_axes, stream_requests
from macromicro.serve.scpi._parameters import Flag, Number, Parameter, Word
from macromicro.serve.scpi._session import Session
from macromicro.serve.scpi.command import Answer, Call, Command, Handler, command, mnemonic, number
from macromicro.serve.scpi.errors import ScpiError, quote

_ENDS = ("MINimum", "MAXimum")
_WAY = Word("way", ("REPLace",), optional=True)  # the motion under way ends as superseded
_WHICH = Word("end", _ENDS, optional=True)


def commands(
    name: str,
    act: Handler | None = None,
    parameters: tuple[Parameter, ...] | None = None,
    axes: tuple[str, ...] = AXES,
) -> Iterator[Command]:
    """The SCPI commands of a request type, one for each choice in its header."""
    kind = (of_axes(axes) | stream_requests(axes))[name]
    by_header = "{" in kind.header
    for choice in kind.fields[0].choices if by_header else (None,):
        fixed = () if choice is None else (choice,)
        node = "" if choice is None else mnemonic(choice)
        fields = tuple(_of(field, choice) for field in kind.fields[len(fixed) :])
        taken = (*map(_parameter, fields), *([_WAY] if kind.replaces else []))
        yield Command(
            kind.header.format(stage=node),
            act or _ordering(kind, fields, fixed),
            kind.text.format(stage=_stage_name(choice)),
            taken if parameters is None else parameters,
            access=kind.access,
            streamed=kind.name in POINTS,
        )


def _stage_name(choice: str | None) -> str:
    if choice == ALL:
        return "stages together"
    return f"{choice}-stage" if choice in STAGES else f"axis {choice}"


def _of(field: Field, choice: str | None) -> Field:
    """A field whose limits are those of the stage in the header."""
    return field._replace(ends=field.ends.format(stage=choice))


def _parameter(field: Field) -> Parameter:
    if not field.unit:
        return Flag(field.name)
    return Number(
        field.name,
        field.unit,
        field.lo,
        field.hi,
        whole=field.unit == "counts",
        instead=_ENDS if field.ends else (),
        optional=field.default is not None,
    )


def _value(session: Session, field: Field, given: Any) -> Any:
    """The given value, what is meant where none is, or the limit in force."""
    if given is None:
        return field.default
    if isinstance(given, str):
        return session.instrument.limit(field.ends, given)
    return given


def _ordering(kind: RequestType, fields: tuple[Field, ...], fixed: tuple[str, ...]) -> Handler:
    async def act(call: Call) -> Answer:
        session = call.session
        given = zip(fields, call.values, strict=False)
        values = (*fixed, *(_value(session, field, value) for field, value in given))
        request = kind.request(*values)
        if kind.replaces and call.values[-1]:
            request = request._replace(replace=True)
        motion = await session.order(request)
        if kind.motion:
            session.began(motion, kind.words(values, session.instrument.place))
        elif ends(request):
            session.ends(motion)
        return None

    return act


def _point(name: str, axes: tuple[str, ...] = AXES) -> Handler:
    """Show the machine a streamed set point."""
    kind = stream_requests(axes)[name]

    def act(call: Call) -> Answer:
        session = call.session
        given = zip(kind.fields, call.values, strict=True)
        point = kind.request(*(_value(session, field, value) for field, value in given))
        refused = session.station.point(session.name, point)
        if refused is not None:
            held = session.station.holder == session.name
            raise ScpiError(-221 if held else -203, f"{refused.reason}; {refused.remedy}")
        return None

    return act


def _position_query(kind: str, unit: str, target: Callable[[Session], float]) -> Handler:
    """The target or a limit, in counts or in the display unit."""

    def act(call: Call) -> Answer:
        (end,) = call.values
        found = call.session.instrument.limit(kind, end) if end else target(call.session)
        scale = {"m": call.session.instrument.place.per}.get(unit, 1.0)
        return number(round(found * scale, 9))

    return act


async def stop(call: Call) -> Answer:
    """Decelerate all motion."""
    session = call.session
    reply = await session.stop()
    if isinstance(reply, Refused):
        raise ScpiError(-221, f"{reply.reason}; {reply.remedy}")
    session.ends(session.station.snapshot().motion)
    return None


async def _abort(call: Call) -> Answer:
    if math.isnan(await call.session.emergency()):
        raise ScpiError(-240, unconfirmed.words(unconfirmed.EMERGENCY_STOP))
    return None


async def _enable(call: Call) -> Answer:
    session = call.session
    try:
        await session.order(Enable())
    except ScpiError as refused:
        if refused.number != -221 or not session.snapshot().enabled:
            raise
    return None


def _outcome(call: Call) -> Answer:
    end = call.session.station.finished(int(call.values[0]), 0.0)
    if end is None:
        return f'"unknown",{number(float("nan"))},{number(float("nan"))},""'
    per = call.session.instrument.place.per
    where = f"{number(end.position * per)},{number(end.uncertainty * per)}"
    facts = ", ".join(f"{name} {value}" for name, value in end.evidence.items())
    return f"{quote(end.outcome)},{where},{quote(facts[:1000])}"


def _speeds(axes: tuple[str, ...] = AXES) -> Iterator[Command]:
    """The `SPEed` queries of each stage."""
    stages = of_axes(axes)["set speed"].fields[0].choices
    for each, stage in zip(commands("set speed", axes=axes), stages, strict=True):

        def act(call: Call, stage: str = stage) -> Answer:
            instrument = call.session.instrument
            return number(round(instrument.speed(stage) * instrument.place.per, 9))

        yield Command(
            f"{each.header}?",
            act,
            f"Maximum speed of moves of the {_stage_name(stage)}.",
            answer="speed mm/s; 9.91E37 if the law sets it",
        )


_BY_AXES = (
    *("move point", "move point by", "move axis", "move axis by"),
    *("jog", "follow", "set speed"),
)


def of_stages(axes: tuple[str, ...]) -> Iterator[Command]:
    """The commands of a machine of several stages that name its stages."""
    for name in _BY_AXES:
        yield from commands(name, axes=axes)
    yield from commands("points", _point("points", axes), axes=axes)
    yield from _speeds(axes)


COMMANDS = (
    *commands("move to"),
    command(
        "MOVE[:ABSolute]?",
        _position_query("whole", "m", lambda session: session.snapshot().target_m),
        (_WHICH,),
    ),
    *commands("move by"),
    *commands("move macro"),
    command(
        "MOVE:MACRo?",
        _position_query("macro", "counts", lambda session: session.snapshot().macro_reference),
        (_WHICH,),
    ),
    *commands("move macro by"),
    *commands("move micro"),
    command(
        "MOVE:MICRo?",
        _position_query("micro", "m", lambda session: session.snapshot().micro_reference_m),
        (_WHICH,),
    ),
    *commands("move micro by"),
    command("MOVE:NUMBer?", lambda call: str(call.session.snapshot().motion)),
    command("MOVE:OUTCome?", _outcome, (Number("motion", lo=1, hi=1e9, whole=True),)),
    *commands("stop", stop),
    *commands("emergency", _abort),
    *commands("jog"),
    *commands("follow"),
    *commands("end follow"),
    *(command for name in POINTS for command in commands(name, _point(name))),
    *commands("set speed"),
    *_speeds(),
    *commands("home"),
    *commands("zero"),
    *commands("enable", _enable),
    *commands("disable"),
    *commands("fan"),
    *commands("clear"),
)
