"""The common commands of IEEE 488.2 (chapter 10), and the status registers of SCPI."""

from __future__ import annotations

from collections.abc import Iterator

import macromicro
from macromicro.control.live.messages import Disable, Fan, SetLimits
from macromicro.serve.requests import CONTROL
from macromicro.serve.scpi._parameters import Number
from macromicro.serve.scpi._session import Session
from macromicro.serve.scpi.command import Answer, Call, Command, Handler, command
from macromicro.serve.scpi.status import Register

_BYTE = Number("mask", lo=0, hi=255, rounds=True)
_BITS = Number("mask", lo=0, hi=65535, rounds=True)


def _idn(call: Call) -> Answer:
    return f"macromicro,{call.session.instrument.settings.facts.model},0,{macromicro.__version__}"


async def _rst(call: Call) -> Answer:
    session = call.session
    await session.order(Disable())
    session.completing = False
    session.programme, session.format, session.swapped = None, ("ASC", 0), False
    await session.order(SetLimits(None))
    if session.snapshot().fault is None:
        await session.order(Fan(False))
    return None


def _cls(call: Call) -> Answer:
    session = call.session
    session.snapshot()
    session.errors.clear()
    session.events = session.operation.event = session.questionable.event = 0
    session.completing = False
    return None


def _ese(call: Call) -> Answer:
    call.session.event_enable = int(call.values[0])
    return None


def _esr(call: Call) -> Answer:
    events, call.session.events = call.session.events, 0
    return str(events)


def _opc(call: Call) -> Answer:
    call.session.completing = True
    call.session.poll()
    return None


def _sre(call: Call) -> Answer:
    call.session.service_enable = int(call.values[0]) & ~64
    return None


def _stb(call: Call) -> Answer:
    call.session.snapshot()
    return str(call.session.status_byte())


def _tst(call: Call) -> Answer:
    now = call.session.snapshot()
    failed = (
        not now.running,
        not now.age_s <= 1.0,
        now.fault is not None,
        bool(now.recording.error),
    )
    return str(sum(1 << k for k, wrong in enumerate(failed) if wrong))


COMMON = (
    command("*IDN?", _idn),
    command("*RST", _rst, access=CONTROL),
    command("*CLS", _cls),
    command("*ESE", _ese, (_BYTE,)),
    command("*ESE?", lambda call: str(call.session.event_enable)),
    command("*ESR?", _esr),
    command("*OPC", _opc),
    command("*OPC?", lambda call: "1", waits=True),
    command("*SRE", _sre, (_BYTE,)),
    command("*SRE?", lambda call: str(call.session.service_enable)),
    command("*STB?", _stb),
    command("*TST?", _tst),
    command("*WAI", lambda call: None, waits=True),
)


def _register(name: str, which: str, words: str) -> Iterator[Command]:
    """The commands of one status register, an attribute of `Session`."""

    def of(session: Session) -> Register:
        session.snapshot()
        register: Register = getattr(session, which)
        return register

    def setting(field: str) -> Handler:
        def act(call: Call) -> Answer:
            setattr(of(call.session), field, int(call.values[0]) & 0x7FFF)
            return None

        return act

    def asking(field: str) -> Handler:
        return lambda call: str(getattr(of(call.session), field))

    root = f"STATus:{name}"
    yield Command(
        f"{root}[:EVENt]?",
        lambda call: str(of(call.session).read()),
        f"Events of the {words}, which reading clears.",
        answer="mask",
    )
    yield Command(f"{root}:CONDition?", asking("condition"), f"The {words} now.", answer="mask")
    for node, field, text in (
        ("ENABle", "enable", "bits that count in the status byte"),
        ("PTRansition", "positive", "bits whose rise is an event"),
        ("NTRansition", "negative", "bits whose fall is an event"),
    ):
        yield Command(f"{root}:{node}", setting(field), f"Set the {text}.", (_BITS,))
        yield Command(f"{root}:{node}?", asking(field), f"The {text}.", answer="mask")


def _preset(call: Call) -> Answer:
    call.session.operation.preset()
    call.session.questionable.preset()
    return None


STATUS = (
    *_register("OPERation", "operation", "operation register"),
    *_register("QUEStionable", "questionable", "questionable register"),
    command("STATus:PRESet", _preset),
)
