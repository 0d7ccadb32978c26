"""Soft limits, gains and programmes."""

from __future__ import annotations

import tempfile
from pathlib import Path

from macromicro.control.live.messages import Programme, SetGains, Stop
from macromicro.errors import InputError
from macromicro.parameters import Entry, entries
from macromicro.programme import Limits
from macromicro.serve.scpi.answers import number, numbers
from macromicro.serve.scpi.command import CHANGE, CONTROL, Answer, Call, Command, Handler
from macromicro.serve.scpi.errors import ScpiError, quoted
from macromicro.serve.scpi.parameters import NameOrBlock, Number, NumberOrText, Text

# Limits: what they are called here and by the machine, parameter, stored units in one of its.
_KINDS = (
    ("ABSolute", "whole", "m", 1.0, 1e3, "mm"),
    ("MACRo", "macro", "counts", 1.0, 1.0, "counts"),
    ("MICRo", "micro", "m", 1e3, 1.0, "mm"),
)


def _set_limits(kind: str, scale: float) -> Handler:
    def act(call: Call) -> Answer:
        session = call.session
        if session.device.station.snapshot().holder != session.client:
            raise ScpiError(-203, "this client does not hold control; SYSTem:LOCK:REQuest?")
        low, high = (round(x * scale, 9) for x in call.values)
        session.device.set_limits(kind, low, high)
        return None

    return act


def _limits(kind: str, shown: float) -> Handler:
    def act(call: Call) -> Answer:
        limits = call.session.device.limits
        return numbers(
            *(round(getattr(limits, f"{kind}_{end}") * shown, 9) for end in ("low", "high"))
        )

    return act


def _limit_commands() -> tuple[Command, ...]:
    found: list[Command] = []
    for node, kind, unit, scale, shown, words in _KINDS:
        ends = (Number("low", unit), Number("high", unit))
        found.append(
            Command(
                f"LIMit:{node}",
                _set_limits(kind, scale),
                f"Soft limits of the {kind}{' positioner' if kind == 'whole' else '-stage'} for "
                "all SCPI clients, within those of the machine.",
                ends,
                access=CONTROL,
            )
        )
        found.append(
            Command(
                f"LIMit:{node}?",
                _limits(kind, shown),
                "These limits.",
                answer=f"low {words}, high {words}",
            )
        )
    return tuple(found)


def _default_limits(call: Call) -> Answer:
    session = call.session
    if session.device.station.snapshot().holder != session.client:
        raise ScpiError(-203, "this client does not hold control; SYSTem:LOCK:REQuest?")
    session.device.reset_limits()
    return None


def _entry(call: Call) -> Entry:
    path = call.values[0]
    for entry in entries(call.session.device.control()):
        if entry.path == path.lower():
            return entry
    raise ScpiError(-224, f"{path[:60]}; accepted: a name that GAIN:CATalog? lists")


def _gain(call: Call) -> Answer:
    value = _entry(call).value
    return quoted(value) if isinstance(value, str) else number(value, 17)


def _bounds(call: Call) -> Answer:
    par = _entry(call).par
    choices = ", ".join(par.choices)
    low = 0.0 if par.positive and par.lo < 0.0 else par.lo
    return f"{numbers(low, par.hi)},{quoted(par.unit)},{quoted(par.meaning)},{quoted(choices)}"


def _gains(call: Call) -> Answer:
    return ",".join(quoted(e.path) for e in entries(call.session.device.control()))


def _set_gain(call: Call) -> Answer:
    session, entry, value = call.session, _entry(call), call.values[1]
    par = entry.par
    if isinstance(entry.value, str):
        if value not in par.choices:
            raise ScpiError(-224, f"{entry.path}; accepted: {', '.join(par.choices)}")
    elif isinstance(value, str):
        raise ScpiError(-104, f"{entry.path}: a number in {par.unit or 'no unit'}")
    else:
        low = "above 0" if par.positive and par.lo <= 0.0 else f"{par.lo:g}"
        if not par.lo <= value <= par.hi or (par.positive and value <= 0.0):
            raise ScpiError(-222, f"{entry.path}: {value:g}; accepted: {low} to {par.hi:g}")
        if isinstance(entry.value, int):
            if value != int(value):
                raise ScpiError(-222, f"{entry.path}: {value:g}; accepted: a whole number")
            value = int(value)
    session.order(SetGains(((entry.path, value),), session.client))
    return None


def _load(call: Call) -> Answer:
    from macromicro import programme
    from macromicro.simulate import plan

    given = call.values[0]
    limits = _programme_limits(call)
    try:
        if isinstance(given, str):
            path = programme.shipped().get(given)
            if path is None:
                known = ", ".join(programme.shipped())
                raise ScpiError(-256, f"{given[:60]}; accepted: {known}, or a block of TOML text")
            loaded = programme.load(path, limits)
        else:
            with tempfile.TemporaryDirectory() as folder:
                file = Path(folder) / "programme.toml"
                file.write_bytes(given)
                try:
                    loaded = programme.load(file, limits)
                except InputError as error:
                    where = error.where.replace(str(file), "programme")
                    raise InputError(where, error.value, error.accepted) from None
    except InputError as error:
        raise ScpiError(-285, str(error)) from None
    name = given if isinstance(given, str) else loaded.title
    call.session.programme = (name, plan(loaded))
    return None


def _programme_limits(call: Call) -> Limits:
    own = call.session.device.limits
    per_metre = 1.0 / call.session.device.settings.live.pitch
    # A programme's micro targets may be 0: there the micro-stage is let go.
    return Limits(own.macro_low, own.macro_high, 0.0, own.micro_high * 1e-3, per_metre)


def _run(call: Call) -> Answer:
    session = call.session
    if session.programme is None:
        raise ScpiError(-282, "no programme is loaded; PROGram:LOAD")
    name, plan = session.programme
    for stage, target in zip(plan.stage.tolist(), plan.target.tolist(), strict=True):
        if stage == 0:
            session.device.check("macro", target)
        elif session.device.narrowed:
            session.device.check("micro", target)
    motion = session.order(Programme(plan, session.client))
    session.running = motion
    session.began(motion, f"programme {name}")
    return None


def _stop(call: Call) -> Answer:
    session = call.session
    if session.running and session.snapshot().motion == session.running:
        session.order(Stop(session.client))
        return None
    raise ScpiError(-221, "no programme of this client is running; STOP stops whatever moves")


def _state(call: Call) -> Answer:
    session = call.session
    running = session.running and session.snapshot().motion == session.running
    return "RUN" if running else "STOP"


_PATH = Text("name")
COMMANDS = (
    *_limit_commands(),
    Command("LIMit:DEFault", _default_limits, "The machine's own limits again.", access=CONTROL),
    Command("GAIN:CATalog?", _gains, "All settings of the controller.", answer="names"),
    Command(
        "GAIN?",
        _gain,
        "A setting of the controller.",
        (_PATH,),
        answer="value in the unit that GAIN:BOUNds? tells",
    ),
    Command(
        "GAIN:BOUNds?",
        _bounds,
        "What it may be set to.",
        (_PATH,),
        answer='lowest, highest, "unit", "meaning", "words that are accepted"',
    ),
    Command(
        "GAIN",
        _set_gain,
        "Set it.",
        (_PATH, NumberOrText("value")),
        access=CONTROL,
    ),
    Command(
        "PROGram:CATalog?",
        lambda call: ",".join(quoted(name) for name in _shipped()),
        "Programmes that come with the package.",
        answer="names",
    ),
    Command(
        "PROGram:LOAD",
        _load,
        "Load a programme into this connection's memory: one of these, or TOML text as in "
        "docs/programmes.md.",
        (NameOrBlock("programme"),),
        access=CHANGE,
        cost=100,
    ),
    Command(
        "PROGram:NAME?",
        lambda call: quoted(call.session.programme[0] if call.session.programme else ""),
        "What is loaded.",
        answer='"name or title", "" for nothing',
    ),
    Command("PROGram:RUN", _run, "Run it.", access=CONTROL),
    Command("PROGram:STOP", _stop, "Stop it as STOP does.", access=CONTROL),
    Command("PROGram:STATe?", _state, "Is it running?", answer="RUN or STOP"),
)


def _shipped() -> list[str]:
    from macromicro import programme

    return list(programme.shipped())
