from __future__ import annotations

import re
import time
from pathlib import Path

import numpy as np

from macromicro.arrays import Array
from macromicro.columns import Column
from macromicro.errors import MacromicroError
from macromicro.serve.requests import CONTROL
from macromicro.serve.scpi._answers import block, flag, number
from macromicro.serve.scpi._parameters import Flag, Number, Text, Word
from macromicro.serve.scpi._session import Session
from macromicro.serve.scpi.command import Answer, Call, Command
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


COMMANDS = (
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
