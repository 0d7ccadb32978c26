"""The supported GCS 2.0 commands, each with its line of HLP?."""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable, Sequence
from typing import Any, NamedTuple

from macromicro import __version__
from macromicro.arrays import Array
from macromicro.control.live import messages as m
from macromicro.serve.client import Entry
from macromicro.serve.gcs import _errors
from macromicro.serve.gcs._errors import GcsError
from macromicro.serve.gcs._session import MOST, Session
from macromicro.serve.web import bins

Words = Sequence[str]
Answer = str | None
BUSY, READY = chr(176), chr(177)


class Call(NamedTuple):
    """A queued command with its arguments."""

    session: Session
    words: Words
    entry: Entry[Any]


class Command(NamedTuple):
    """One command; `act` returns the answer, or None."""

    act: Callable[[Call], Answer | Awaitable[Answer]]  # what orders is a coroutine
    text: str
    blocks: bool = False  # it computes for long: `act` runs on a thread


def number(word: str) -> float:
    try:
        found = float(word)
    except ValueError:
        raise GcsError(_errors.NO_NUMBER, word[:40]) from None
    if not math.isfinite(found):
        raise GcsError(_errors.NO_NUMBER, word[:40])
    return found


def _axes(call: Call) -> Words:
    """The axes that a command names, or all."""
    named = tuple(word.upper() for word in call.words)
    if not set(named) <= set(call.session.axes):
        raise GcsError(_errors.NO_AXIS, " ".join(named)[:40])
    return named or call.session.axes


def _pairs(call: Call) -> dict[str, float]:
    if not call.words or len(call.words) % 2:
        raise GcsError(_errors.COUNT)
    axes = _axes(call._replace(words=call.words[::2]))
    return dict(zip(axes, map(number, call.words[1::2]), strict=True))


def _each(call: Call, value: Callable[[Session, str], object]) -> str:
    return " \n".join(f"{axis}={value(call.session, axis)}" for axis in _axes(call))


def _flags(value: Callable[[Session, str], bool]) -> Callable[[Call], Answer]:
    return lambda call: _each(call, lambda session, axis: int(value(session, axis)))


def _places(value: Callable[[Session, str], float]) -> Callable[[Call], Answer]:
    """Answer positions in mm, or deg on a rotary machine."""

    def shown(session: Session, axis: str) -> str:
        return f"{value(session, axis) * session.instrument.place.per:.7f}"

    return lambda call: _each(call, shown)


def _position(session: Session, axis: str) -> float:
    now = session.station.snapshot()
    return now.position_m if axis == "1" else now.axes[session.axes.index(axis)].position_m


def _target(session: Session, axis: str) -> float:
    """The target of the last move, else the position."""
    now = session.station.snapshot()
    target = now.target_m if axis == "1" else now.axes[session.axes.index(axis)].target_m
    return _position(session, axis) if math.isnan(target) else target


def _limit(which: str) -> Callable[[Session, str], float]:
    return lambda session, axis: session.instrument.limit(
        "whole" if axis == "1" else axis.lower(), which
    )


def _is_referenced(session: Session, axis: str) -> bool:
    now = session.station.snapshot()
    return now.trusted and now.mode != m.MODES[m.HOMING]


async def _move(call: Call, one: Any, point: Any, axis: Any) -> Answer:
    """The move requests for the given values."""
    session = call.session
    per = session.instrument.place.per
    found = {axis: value / per for axis, value in _pairs(call).items()}
    if session.axes == ("1",):
        await session.move(one(found["1"], replace=True), call.entry)
    elif len(found) > 1:
        places = {name.lower(): value for name, value in found.items()}
        await session.move(point(places), call.entry)
    else:
        ((name, value),) = found.items()
        await session.move(axis(name.lower(), value), call.entry)
    return None


async def _mov(call: Call) -> Answer:
    return await _move(call, m.MoveTo, m.MovePoint, m.MoveAxis)


async def _mvr(call: Call) -> Answer:
    return await _move(call, m.MoveBy, m.MovePointBy, m.MoveAxisBy)


async def _svo(call: Call) -> Answer:
    states = set(_pairs(call).values())
    if len(states) > 1 or not states <= {0.0, 1.0}:
        raise GcsError(_errors.OUT_OF_RANGE)
    wanted = states == {1.0}
    if wanted != call.session.servo:
        await call.session.order(m.Enable() if wanted else m.Disable(), call.entry)
    return None


async def _frf(call: Call) -> Answer:
    _axes(call)
    session = call.session
    try:
        await session.move(m.Home(), call.entry)
    except GcsError:
        if not (session.servo and _is_referenced(session, "")):  # an absolute sensor needs none
            raise
    return None


def _stage(axis: str) -> str:
    """Name of an axis on the machine."""
    return m.MACRO if axis == "1" else axis.lower()


def _velocity(session: Session, axis: str) -> float:
    """Maximum speed of moves, or of jogs if the law sets that of moves."""
    own = session.instrument.speed(_stage(axis))
    return session.instrument.settings.live.jogging.macro if math.isnan(own) else own


async def _vel(call: Call) -> Answer:
    session = call.session
    per, most = session.instrument.place.per, session.instrument.settings.facts.speeds
    pairs = {axis: value / per for axis, value in _pairs(call).items()}
    for axis, value in pairs.items():
        now, stage = _velocity(session, axis), _stage(axis)
        if stage not in most and abs(value - now) > 1e-6 * now:
            raise GcsError(_errors.NOT_FOR_STAGE, "the law sets the speed of moves")
        if stage in most and not 0.0 < value <= most[stage] * (1.0 + 1e-9):
            raise GcsError(_errors.OUT_OF_RANGE, f"at most {most[stage] * per:g}")
    for axis, value in pairs.items():
        if _stage(axis) in most and value != _velocity(session, axis):
            await session.order(m.SetSpeed(_stage(axis), value), call.entry)
    return None


def _ccl(call: Call) -> Answer:
    if not call.words or call.words[0] not in ("0", "1"):
        raise GcsError(_errors.COUNT if not call.words else _errors.OUT_OF_RANGE)
    if call.words[0] == "1" and call.session.authenticate(" ".join(call.words[1:])):
        raise GcsError(_errors.PASSWORD)
    return None


def _whole(word: str) -> int:
    found = number(word)
    if found != int(found):
        raise GcsError(_errors.NO_NUMBER, word[:40])
    return int(found)


def _rtr(call: Call) -> Answer:
    if len(call.words) != 1:
        raise GcsError(_errors.COUNT)
    rate = _whole(call.words[0])
    if not 1 <= rate <= MOST:
        raise GcsError(_errors.OUT_OF_RANGE)
    call.session.rate = rate
    return None


def _plots(session: Session) -> bins.Plots:
    """What the record tables show: all channels but the law's memory."""
    return bins.plots(session.instrument.settings)._replace(law=())


def _tables(session: Session) -> list[str]:
    """Names of the record tables 1, 2, ... with their units."""
    units = {"motor": "V", "CTRL": "V", "temperature": "degC"}
    unit, shown = session.instrument.place.unit, _plots(session).channels
    return [f"{name} [{units.get(name.split()[-1], unit)}]" for name in shown]


def _rows(session: Session) -> Array:
    """All tables since the last motion began: float64[tables, values]."""
    _, block, _ = session.station.telemetry(session.began)
    return _plots(session).traces(block[:, :: session.rate][:, :MOST])


def _array(session: Session, first: int, count: int, tables: Sequence[int]) -> str:
    """Values `first` (counted from 1) to `first + count - 1` of these tables, with their header."""
    called = _tables(session)
    tables = tables or range(1, len(called) + 1)
    if not all(1 <= table <= len(called) for table in tables):
        raise GcsError(_errors.NO_TABLE)
    values = _rows(session)
    if first < 1 or count < 1 or first + count - 1 > values.shape[1]:
        raise GcsError(_errors.OUT_OF_RANGE, f"{values.shape[1]} values so far")
    shown = values[[table - 1 for table in tables], first - 1 : first - 1 + count]
    head = {
        "VERSION": "1",
        "TYPE": "1",
        "SEPARATOR": "32",
        "DIM": str(len(tables)),
        "SAMPLE_TIME": f"{session.rate * session.instrument.period:.6g}",
        "NDATA": str(count),
    }
    head |= {f"NAME{k}": called[table - 1] for k, table in enumerate(tables)}
    lines = ["# REM macromicro", "#", *(f"# {key} = {text}" for key, text in head.items())]
    lines += ["#", "# END_HEADER"]
    lines += [" ".join(f"{x:.9g}" for x in row) for row in shown.T.tolist()]
    return " \n".join(lines)


def _drr(call: Call) -> Answer:
    if len(call.words) < 2:
        raise GcsError(_errors.COUNT)
    first, count, *shown = map(_whole, call.words)
    return _array(call.session, first, count, shown)


def _drl(call: Call) -> Answer:
    count = _rows(call.session).shape[1]
    shown = call.words or [str(k + 1) for k in range(len(_tables(call.session)))]
    return " \n".join(f"{table}={count}" for table in shown)


def _hdr(call: Call) -> Answer:
    shown = [f"{k}={name}" for k, name in enumerate(_tables(call.session), 1)]
    each = call.session.instrument.period
    last = [f"at most {MOST} values since the last MOV, MVR or FRF, each {each:g} s * RTR"]
    return " \n".join(["#RecordTables", *shown, "#Additional information", *last, "end of help"])


def _moving(call: Call) -> Answer:
    moving = bool(call.session.station.snapshot().motion) or call.session.poll()
    return f"{2 ** len(call.session.axes) - 1 if moving else 0:X}"


def _ready(call: Call) -> Answer:
    return BUSY if call.session.station.snapshot().mode == m.MODES[m.HOMING] else READY


def _idn(call: Call) -> Answer:
    return f"macromicro, {call.session.instrument.settings.facts.model}, 0, {__version__}"


def _hlp(call: Call) -> Answer:
    lines = [f"{name} {command.text}" for name, command in COMMANDS.items()]
    stops = ["STP stop all axes", "HLT [{<AxisID>}] stop axes", "#24 stop all axes"]
    return " \n".join(["The following commands are valid:", *lines, *stops, "end of help"])


_VALUES = "{<AxisID> <value>}"
_ASKED = "[{<AxisID>}]"
# STP, HLT and #24 are no entries: they are done before whatever waits.
COMMANDS: dict[str, Command] = {
    "*IDN?": Command(_idn, "get device identification"),
    "#5": Command(_moving, "get motion status"),
    "#7": Command(_ready, "get controller ready status"),
    "CCL": Command(_ccl, "<level> [<password>] set command level; the password is the token"),
    "CSV?": Command(lambda call: "2.0", "get current syntax version"),
    "DRL?": Command(_drl, "[{<table>}] get number of recorded points"),
    "DRR?": Command(_drr, "<offset> <count> [{<table>}] get recorded data values", blocks=True),
    "ERR?": Command(lambda call: str(call.session.error()), "get error number"),
    "FRF": Command(_frf, f"{_ASKED} reference: home the machine"),
    "FRF?": Command(_flags(_is_referenced), f"{_ASKED} get referencing result"),
    "HDR?": Command(_hdr, "get all data recorder options"),
    "HLP?": Command(_hlp, "get list of available commands"),
    "MOV": Command(_mov, f"{_VALUES} set target position"),
    "MOV?": Command(_places(_target), f"{_ASKED} get target position"),
    "MVR": Command(_mvr, f"{_VALUES} set target relative to the last target"),
    "ONT?": Command(_flags(lambda s, axis: s.on_target()), f"{_ASKED} get on-target state"),
    "POS?": Command(_places(_position), f"{_ASKED} get real position"),
    "RTR": Command(_rtr, "<rate> set record table rate"),
    "RTR?": Command(lambda call: str(call.session.rate), "get record table rate"),
    "SAI?": Command(lambda call: " \n".join(call.session.axes), "[ALL] get axis identifiers"),
    "SVO": Command(_svo, f"{_VALUES} set servo mode: enable or disable the machine"),
    "SVO?": Command(_flags(lambda s, axis: s.servo), f"{_ASKED} get servo mode"),
    "TMN?": Command(_places(_limit("MIN")), f"{_ASKED} get minimum commandable position"),
    "TMX?": Command(_places(_limit("MAX")), f"{_ASKED} get maximum commandable position"),
    "VEL": Command(_vel, f"{_VALUES} set closed-loop velocity"),
    "VEL?": Command(_places(_velocity), f"{_ASKED} get closed-loop velocity"),
    "VER?": Command(_idn, "get versions of firmware and drivers"),
}
