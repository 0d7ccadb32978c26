"""Telemetry in SCPI: its format, waveforms, recordings and triggered captures."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.columns import Column
from macromicro.errors import MacromicroError
from macromicro.serve.capturing import MOST_SIGNALS, SLOPES, TRIGGERS, Captured
from macromicro.serve.requests import CONTROL
from macromicro.serve.scpi._parameters import Flag, Number, Parameter, Text, Word
from macromicro.serve.scpi._session import Session
from macromicro.serve.scpi.command import Answer, Call, Command, block, flag, number
from macromicro.serve.scpi.errors import ScpiError, quoted
from macromicro.serve.shared import RING_S

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,99}")


def _columns(call: Call) -> list[Column]:
    """The columns that this machine has."""
    telemetry = call.session.instrument.settings.telemetry
    channels = getattr(call.session.station, "channels", ())
    return [telemetry.columns[k] for k in telemetry.kept(channels)]


def _format(call: Call) -> Answer:
    kind, length = call.values
    if kind == "ASC":
        if length not in (None, 0.0):
            raise ScpiError(-224, "ASCii has no length")
        call.session.format = ("ASC", 0)
        return None
    if length not in (None, 32.0, 64.0):
        raise ScpiError(-224, "REAL has a length of 32 or 64")
    call.session.format = ("REAL", int(length or 64))
    return None


def _asked_format(call: Call) -> Answer:
    kind, length = call.session.format
    return f"{kind},{length}"


def _border(call: Call) -> Answer:
    call.session.swapped = call.values[0] == "SWAP"
    return None


def _data(call: Call) -> Answer:
    column, seconds = call.values
    telemetry = call.session.instrument.settings.telemetry
    index = {c.name.lower(): k for k, c in enumerate(telemetry.columns)}
    k = index.get(column.lower(), -1)
    if k < 0:
        raise ScpiError(-224, f"{column[:40]}; accepted: a name that WAVeform:CATalog? lists")
    instrument = call.session.instrument
    rows = instrument.newest(round(seconds / instrument.period))
    return shown(call.session, rows[k] * float(telemetry.scales[k, 0]))


def shown(session: Session, values: Array) -> Answer:
    """Numbers as the format of a client says."""
    kind, length = session.format
    if kind == "ASC":
        return ",".join(number(x) for x in values.tolist()) or '""'
    order = "<" if session.swapped else ">"
    return block(np.asarray(values, dtype=f"{order}f{length // 8}").tobytes())


def _record(call: Call) -> Answer:
    on, name = call.values
    session = call.session
    refusal = session.station.refusal(session.name)
    if refusal is not None:
        raise ScpiError(-203, f"{refusal.reason}; SYSTem:LOCK:REQuest?")
    if not on:
        if name is not None:
            raise ScpiError(-108, "a name is only for ON")
        if not session.station.snapshot().recording.active:
            raise ScpiError(-221, "no recording is under way")
        session.station.end_recording(session.name)
        return None
    name = name or time.strftime("recording-%Y%m%d-%H%M%S")
    if _NAME.fullmatch(name) is None:
        raise ScpiError(-257, "accepted: letters, digits, '.', '_' and '-', no folder")
    path = session.instrument.folder / (name if name.endswith(".h5") else f"{name}.h5")
    try:
        session.station.record(path, client=session.name)
    except MacromicroError as error:
        raise ScpiError(-250, str(error)) from error
    return None


def _recording(call: Call) -> Answer:
    state = call.session.snapshot().recording
    return f"{flag(state.active)},{state.rows},{state.lost},{quoted(state.error)}"


_SOURCES = dict(zip(("NOW", "EDGE", "LEV", "BEG", "END", "FAUL", "LIM"), TRIGGERS, strict=True))
_SLOPES = dict(zip(("POS", "NEG", "EITH"), SLOPES, strict=True))


def _setting(
    header: str, field: str, text: str, parameter: Parameter, answer: str,
    words: dict[str, str] | None = None, formatted: Callable[[Any], str] = number,
) -> Iterator[Command]:  # fmt: skip
    """A setting of the trigger or of the capture, and its query."""
    trigger = header.startswith("TRIGger")

    def put(call: Call) -> Answer:
        value = words[call.values[0]] if words else call.values[0]
        wanted = call.session.wanted
        change: dict[str, Any] = {field: value}
        if trigger:
            change = {"trigger": wanted.trigger._replace(**change)}
        call.session.wanted = wanted._replace(**change)
        return None

    def get(call: Call) -> Answer:
        wanted = call.session.wanted
        value = getattr(wanted.trigger if trigger else wanted, field)
        if words:
            return next(word for word, meant in words.items() if meant == value)
        return formatted(value)

    yield Command(header, put, text, (parameter,))
    yield Command(f"{header}?", get, "The setting.", answer=answer)


def _signals(call: Call) -> Answer:
    names = tuple(name.strip() for name in call.values[0].split(","))
    call.session.wanted = call.session.wanted._replace(signals=names)
    return None


def _start(call: Call) -> Answer:
    session = call.session
    session.station.captures.begin(session.name, session.wanted)
    return None


def _stop(call: Call) -> Answer:
    call.session.station.captures.end(call.session.name)
    return None


def _state(call: Call) -> Answer:
    capture = call.session.station.captures.of(call.session.name)
    return "STOP,0" if capture is None else f"{capture.state[:4].upper()},{capture.number}"


def _captured(call: Call) -> Captured:
    capture = call.session.station.captures.of(call.session.name)
    if capture is None or capture.captured is None:
        raise ScpiError(-221, "nothing is captured yet; CAPTure:STARt, CAPTure:STATe?")
    return capture.captured


def _captured_data(call: Call) -> Answer:
    found, name = _captured(call), call.values[0].lower()
    if name not in found.names:
        raise ScpiError(-224, f"{name[:40]}; accepted: {', '.join(found.names)}")
    return shown(call.session, found.values[found.names.index(name)])


def _at(call: Call) -> Answer:
    return number(_captured(call).time)


def _units(call: Call) -> Answer:
    return ",".join(map(quoted, _captured(call).units))


WAVEFORMS = (
    Command(
        "FORMat[:DATA]",
        _format,
        "How WAVeform:DATA? answers: numbers as text, or a binary block.",
        (Word("type", ("ASCii", "REAL")), Number("length", lo=0, hi=64, whole=True, optional=True)),
    ),
    Command("FORMat[:DATA]?", _asked_format, "The format.", answer="ASC,0 or REAL,32 or REAL,64"),
    Command(
        "FORMat:BORDer",
        _border,
        "Order of a binary number's bytes: most significant first (NORMal) or last.",
        (Word("order", ("NORMal", "SWAPped")),),
    ),
    Command(
        "FORMat:BORDer?",
        lambda call: "SWAP" if call.session.swapped else "NORM",
        "The order.",
        answer="NORM or SWAP",
    ),
    Command(
        "WAVeform:CATalog?",
        lambda call: ",".join(quoted(c.name) for c in _columns(call)),
        "Columns of the telemetry.",
        answer="names",
    ),
    Command(
        "WAVeform:UNITs?",
        lambda call: ",".join(quoted(c.unit) for c in _columns(call)),
        "Units of these columns.",
        answer="units",
    ),
    Command(
        "WAVeform:INTerval?",
        lambda call: number(call.session.instrument.period),
        "Time between two values.",
        answer="s",
    ),
    Command(
        "WAVeform:DATA?",
        _data,
        "The last seconds of one column, the newest value last.",
        (Text("column", 40, bare=True), Number("duration", "s", 0.0, RING_S)),
        answer="numbers, or a block of given length, as FORMat says",
        cost=50,
        blocks=True,
    ),
    Command(
        "RECord[:STATe]",
        _record,
        "Begin a recording of the telemetry into a file of the server's folder (by default "
        "named by date and time), or end it.",
        (Flag("state"), Text("name", optional=True)),
        access=CONTROL,
        blocks=True,
    ),
    Command(
        "RECord[:STATe]?",
        _recording,
        "The recording under way, or the last one.",
        answer='1 while it is written else 0, rows in the file, rows lost, "why it ended early"',
    ),
    Command(
        "RECord:NAME?",
        lambda call: quoted(Path(call.session.snapshot().recording.path).name),
        "File name of the recording.",
        answer='"name", "" before the first',
    ),
)
CAPTURES = (
    Command(
        "CAPTure:SIGNals",
        _signals,
        f"Columns to capture: 1 to {MOST_SIGNALS} names of WAVeform:CATalog?, separated by commas.",
        (Text("names", 400),),
    ),
    Command(
        "CAPTure:SIGNals?",
        lambda call: quoted(",".join(call.session.wanted.signals)),
        "The setting.",
        answer='"names"',
    ),
    *_setting(
        "CAPTure:BEFore", "before", "Time before the trigger.",
        Number("duration", "s", 0.0, 1e3), "s",
    ),
    *_setting(
        "CAPTure:AFTer", "after", "Time after the trigger.",
        Number("duration", "s", 0.0, 1e3), "s",
    ),
    *_setting(
        "CAPTure:REPeat", "repeat", "Whether a capture begins again once it is complete.",
        Flag("state"), "1 or 0", formatted=flag,
    ),
    *_setting(
        "TRIGger:SOURce", "kind",
        "What begins a capture: at once, an edge or a level of a signal, begin or end of a motion, "
        "a fault, or a limit switch or the end of a motion at a limit.",
        Word("source", ("NOW", "EDGE", "LEVel", "BEGin", "END", "FAULt", "LIMit")),
        "NOW, EDGE, LEV, BEG, END, FAUL or LIM", _SOURCES,
    ),
    *_setting(
        "TRIGger:SIGNal", "signal", "Column of an edge or a level.",
        Text("name", 40, bare=True), '"name"', formatted=quoted,
    ),
    *_setting(
        "TRIGger:SLOPe", "slope", "Direction of an edge; a level is at least (POSitive) or at most "
        "(NEGative) the threshold.",
        Word("slope", ("POSitive", "NEGative", "EITHer")), "POS, NEG or EITH", _SLOPES,
    ),
    *_setting(
        "TRIGger:LEVel", "threshold", "Threshold, in the unit of the column.",
        Number("threshold"), "number",
    ),
    Command(
        "CAPTure:STARt", _start, "Wait for the trigger with these settings; the last capture of "
        "this client is dropped.", cost=20,
    ),
    Command("CAPTure:STOP", _stop, "Wait no longer, and drop what was captured."),
    Command(
        "CAPTure:STATe?",
        _state,
        "Whether a capture waits for its trigger, for the rows behind it, or is complete; and how "
        "many were.",
        answer="WAIT, TRIG, COMP or STOP, number",
    ),
    Command(
        "CAPTure:DATA?",
        _captured_data,
        "One column of the newest capture; t is the time from the trigger on, in s.",
        (Text("name", 40, bare=True),),
        answer="numbers, or a block of given length, as FORMat says",
        cost=50,
    ),
    Command("CAPTure:UNITs?", _units, "Units of t and the columns.", answer="units"),
    Command("CAPTure:TIME?", _at, "Time of the trigger by the machine.", answer="s"),
)  # fmt: skip
