"""Commands of triggered captures."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from macromicro.serve.capturing import MOST_SIGNALS, SLOPES, TRIGGERS, Captured
from macromicro.serve.scpi._answers import flag, number
from macromicro.serve.scpi._parameters import Flag, Number, Parameter, Text, Word
from macromicro.serve.scpi._waveform import shown
from macromicro.serve.scpi.command import Answer, Call, Command
from macromicro.serve.scpi.errors import ScpiError, quoted

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


def _data(call: Call) -> Answer:
    found, name = _captured(call), call.values[0].lower()
    if name not in found.names:
        raise ScpiError(-224, f"{name[:40]}; accepted: {', '.join(found.names)}")
    return shown(call.session, found.values[found.names.index(name)])


def _at(call: Call) -> Answer:
    return number(_captured(call).time)


def _units(call: Call) -> Answer:
    return ",".join(map(quoted, _captured(call).units))


COMMANDS = (
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
        _data,
        "One column of the newest capture; t is the time from the trigger on, in s.",
        (Text("name", 40, bare=True),),
        answer="numbers, or a block of given length, as FORMat says",
        cost=50,
    ),
    Command("CAPTure:UNITs?", _units, "Units of t and the columns.", answer="units"),
    Command("CAPTure:TIME?", _at, "Time of the trigger by the machine.", answer="s"),
)  # fmt: skip
