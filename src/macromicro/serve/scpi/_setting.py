from __future__ import annotations

from collections.abc import Iterator

from macromicro.control.live.messages import Programme, SetGains, SetLimits
from macromicro.errors import InputError
from macromicro.schema.par import Entry, entries
from macromicro.serve.requests import CONTROL, STOPS, TOKEN
from macromicro.serve.scpi._motion import commands, stop
from macromicro.serve.scpi._parameters import NameOrBlock, Number, NumberOrText, Text, Word
from macromicro.serve.scpi.command import Answer, Call, Command, Handler, command, number, numbers
from macromicro.serve.scpi.errors import ScpiError, quote

_ENDS = ("MINimum", "MAXimum", "DEFault")
# Limits: what they are called here and by the machine, and their unit.
_KINDS = (("ABSolute", "whole", "m"), ("MACRo", "macro", "counts"), ("MICRo", "micro", "m"))


def _set_limits(kind: str) -> Handler:
    async def act(call: Call) -> Answer:
        session = call.session
        own = session.instrument.settings.live.limits
        new = {}
        for end, value in zip(("low", "high"), call.values, strict=True):
            place = {"MIN": "low", "MAX": "high"}.get(value, end)
            machine = getattr(own, f"{kind}_{place}")
            new[f"{kind}_{end}"] = machine if isinstance(value, str) else round(value, 12)
        await session.order(SetLimits(session.snapshot().limits._replace(**new)))
        return None

    return act


def _limits(kind: str, unit: str) -> Handler:
    def act(call: Call) -> Answer:
        limits = call.session.snapshot().limits
        if call.values[0] is not None:
            limits = call.session.instrument.settings.live.limits
        ends = {"MIN": ("low",), "MAX": ("high",)}.get(call.values[0], ("low", "high"))
        shown = {"m": call.session.instrument.place.per}.get(unit, 1.0)
        return numbers(*(round(getattr(limits, f"{kind}_{end}") * shown, 9) for end in ends))

    return act


def _limit_commands() -> Iterator[Command]:
    for node, kind, unit in _KINDS:
        ends = (Number("low", unit, instead=_ENDS), Number("high", unit, instead=_ENDS))
        yield command(f"LIMit:{node}", _set_limits(kind), ends, access=CONTROL)
        which = (Word("which", _ENDS, optional=True),)
        yield command(f"LIMit:{node}?", _limits(kind, unit), which)


async def _default_limits(call: Call) -> Answer:
    await call.session.order(SetLimits(None))
    return None


def _entry(call: Call) -> Entry:
    path = call.values[0]
    for entry in entries(call.session.instrument.control):
        if entry.path == path.lower():
            return entry
    raise ScpiError(-224, f"{path[:60]}; accepted: a name that GAIN:CATalog? lists")


def _gain(call: Call) -> Answer:
    entry = _entry(call)
    value = entry.par.given(entry.value)
    return quote(value) if isinstance(value, str) else number(value, 17)


def _bounds(call: Call) -> Answer:
    par = _entry(call).par
    choices = ", ".join(par.choices)
    low = 0.0 if par.positive and par.lo < 0.0 else par.lo
    ends = numbers(par.given(low), par.given(par.hi))
    return f"{ends},{quote(par.read_in)},{quote(par.meaning)},{quote(choices)}"


def _gains(call: Call) -> Answer:
    return ",".join(quote(e.path) for e in entries(call.session.instrument.control))


async def _set_gain(call: Call) -> Answer:
    session, entry, value = call.session, _entry(call), call.values[1]
    if isinstance(value, str) and not isinstance(entry.value, str):
        raise ScpiError(-104, f"{entry.path}: a number in {entry.par.read_in or 'no unit'}")
    try:
        value = entry.check(entry.par.taken(value), entry.path)
    except InputError as error:
        code = -224 if isinstance(entry.value, str) else -222
        raise ScpiError(code, f"{entry.path}: {error.value}; accepted: {error.accepted}") from None
    await session.order(SetGains(((entry.path, value),)))
    return None


async def _default_gains(call: Call) -> Answer:
    session = call.session
    own = {e.path: e.value for e in entries(session.instrument.settings.controller)}
    now = {e.path: e.value for e in entries(session.instrument.control)}
    changes = tuple((path, value) for path, value in own.items() if now[path] != value)
    if changes:
        await session.order(SetGains(changes))
    return None


def _load(call: Call) -> Answer:
    given, instrument = call.values[0], call.session.instrument
    try:
        if not isinstance(given, str):
            loaded = instrument.programme_of(given, "programme.toml", "programme")
            call.session.programme = (loaded.title, loaded.plan)
            return None
        if given not in instrument.programmes():
            known = ", ".join(instrument.programmes())
            raise ScpiError(-256, f"{given[:60]}; accepted: {known}, or a block of TOML text")
        call.session.programme = (given, instrument.shipped(given).plan)
    except InputError as error:
        raise ScpiError(-285, str(error)) from None
    return None


async def _run(call: Call) -> Answer:
    session = call.session
    if session.programme is None:
        raise ScpiError(-282, "no programme is loaded; PROGram:LOAD")
    name, plan = session.programme
    motion = await session.order(Programme(plan))
    session.running = motion
    session.began(motion, f"programme {name}")
    return None


def _state(call: Call) -> Answer:
    session = call.session
    running = session.running and session.snapshot().motion == session.running
    return "RUN" if running else "STOP"


_PATH = Text("name")
COMMANDS = (
    *_limit_commands(),
    *commands("limits", _default_limits),
    command("GAIN:CATalog?", _gains),
    command("GAIN?", _gain, (_PATH,)),
    command("GAIN:BOUNds?", _bounds, (_PATH,)),
    *commands("gains", _set_gain, (_PATH, NumberOrText("value"))),
    command("GAIN:DEFault", _default_gains, access=CONTROL),
    command(
        "PROGram:CATalog?",
        lambda call: ",".join(quote(name) for name in call.session.instrument.programmes()),
    ),
    command(
        "PROGram:LOAD", _load, (NameOrBlock("programme"),), access=TOKEN, cost=100, blocks=True
    ),
    command(
        "PROGram:NAME?",
        lambda call: quote(call.session.programme[0] if call.session.programme else ""),
    ),
    *commands("programme", _run),
    command("PROGram:STOP", stop, access=STOPS),
    command("PROGram:STATe?", _state),
)
