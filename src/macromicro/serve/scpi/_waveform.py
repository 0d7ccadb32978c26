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
from macromicro.serve.scpi.command import Answer, Call, Command, block, command, flag, number
from macromicro.serve.scpi.errors import ScpiError, quote
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
    return format_values(call.session, rows[k] * float(telemetry.scales[k, 0]))


def format_values(session: Session, values: Array) -> Answer:
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
    return f"{flag(state.active)},{state.rows},{state.lost},{quote(state.error)}"


_SOURCES = dict(zip(("NOW", "EDGE", "LEV", "BEG", "END", "FAUL", "LIM"), TRIGGERS, strict=True))
_SLOPES = dict(zip(("POS", "NEG", "EITH"), SLOPES, strict=True))


def _setting(
    header: str,
    field: str,
    parameter: Parameter,
    words: dict[str, str] | None = None,
    formatted: Callable[[Any], str] = number,
) -> Iterator[Command]:
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

    yield command(header, put, (parameter,))
    yield command(f"{header}?", get)


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


def _latest_capture(call: Call) -> Captured:
    capture = call.session.station.captures.of(call.session.name)
    if capture is None or capture.captured is None:
        raise ScpiError(-221, "nothing is captured yet; CAPTure:STARt, CAPTure:STATe?")
    return capture.captured


def _captured_data(call: Call) -> Answer:
    found, name = _latest_capture(call), call.values[0].lower()
    if name not in found.names:
        raise ScpiError(-224, f"{name[:40]}; accepted: {', '.join(found.names)}")
    return format_values(call.session, found.values[found.names.index(name)])


def _at(call: Call) -> Answer:
    return number(_latest_capture(call).time)


def _units(call: Call) -> Answer:
    return ",".join(map(quote, _latest_capture(call).units))


WAVEFORMS = (
    command(
        "FORMat[:DATA]",
        _format,
        (Word("type", ("ASCii", "REAL")), Number("length", lo=0, hi=64, whole=True, optional=True)),
    ),
    command("FORMat[:DATA]?", _asked_format),
    command("FORMat:BORDer", _border, (Word("order", ("NORMal", "SWAPped")),)),
    command("FORMat:BORDer?", lambda call: "SWAP" if call.session.swapped else "NORM"),
    command("WAVeform:CATalog?", lambda call: ",".join(quote(c.name) for c in _columns(call))),
    command("WAVeform:UNITs?", lambda call: ",".join(quote(c.unit) for c in _columns(call))),
    command("WAVeform:INTerval?", lambda call: number(call.session.instrument.period)),
    command(
        "WAVeform:DATA?",
        _data,
        (Text("column", 40, bare=True), Number("duration", "s", 0.0, RING_S)),
        cost=50,
        blocks=True,
    ),
    command(
        "RECord[:STATe]",
        _record,
        (Flag("state"), Text("name", optional=True)),
        access=CONTROL,
        blocks=True,
    ),
    command("RECord[:STATe]?", _recording),
    command("RECord:NAME?", lambda call: quote(Path(call.session.snapshot().recording.path).name)),
)
CAPTURES = (
    Command(
        "CAPTure:SIGNals",
        _signals,
        f"Columns to capture: 1 to {MOST_SIGNALS} names of WAVeform:CATalog?, separated by commas.",
        (Text("names", 400),),
    ),
    command("CAPTure:SIGNals?", lambda call: quote(",".join(call.session.wanted.signals))),
    *_setting("CAPTure:BEFore", "before", Number("duration", "s", 0.0, 1e3)),
    *_setting("CAPTure:AFTer", "after", Number("duration", "s", 0.0, 1e3)),
    *_setting("CAPTure:REPeat", "repeat", Flag("state"), formatted=flag),
    *_setting(
        "TRIGger:SOURce",
        "kind",
        Word("source", ("NOW", "EDGE", "LEVel", "BEGin", "END", "FAULt", "LIMit")),
        words=_SOURCES,
    ),
    *_setting("TRIGger:SIGNal", "signal", Text("name", 40, bare=True), formatted=quote),
    *_setting(
        "TRIGger:SLOPe", "slope", Word("slope", ("POSitive", "NEGative", "EITHer")), words=_SLOPES
    ),
    *_setting("TRIGger:LEVel", "threshold", Number("threshold")),
    command("CAPTure:STARt", _start, cost=20),
    command("CAPTure:STOP", _stop),
    command("CAPTure:STATe?", _state),
    command("CAPTure:DATA?", _captured_data, (Text("name", 40, bare=True),), cost=50),
    command("CAPTure:UNITs?", _units),
    command("CAPTure:TIME?", _at),
)
