from __future__ import annotations

import math
from collections.abc import Iterator

from macromicro.control.live.messages import AXES
from macromicro.serve import telling
from macromicro.serve.scpi.command import (
    Answer,
    Call,
    Command,
    Handler,
    command,
    flag,
    mnemonic,
    number,
    numbers,
)
from macromicro.serve.scpi.errors import quote
from macromicro.serve.telling import calibrations

_STAGE = "STAGe<n=1..2>"


def _position(call: Call) -> Answer:
    now = call.session.snapshot()
    per = call.session.instrument.place.per
    return f"{numbers(now.position_m * per, now.uncertainty_m * per)},{flag(now.trusted)}"


def _axis(name: str) -> Handler:
    """Position of one of several stages, or NaN."""

    def act(call: Call) -> Answer:
        axes, per = call.session.snapshot().axes, call.session.instrument.place.per
        own = next((each for each in axes if each.name == name), None)
        if own is None:
            return numbers(math.nan, math.nan, math.nan, math.nan)
        shown = (own.position_m, own.uncertainty_m, own.reference_m)
        return numbers(*(each * per for each in shown), own.motor_v)

    return act


def _point(call: Call) -> Answer:
    now, per = call.session.snapshot(), call.session.instrument.place.per
    places = [each.position_m * per for each in now.axes] or [math.nan] * len(AXES)
    return f"{numbers(*places)},{flag(now.trusted)}"


def _trust(call: Call) -> Answer:
    now = call.session.snapshot()
    return f"{flag(now.trusted)},{quote(now.trust)}"


def _of_stage(macro: str, micro: str) -> Handler:
    """Query one stage by these fields of the snapshot; lengths are in mm."""

    def act(call: Call) -> Answer:
        field = macro if call.suffixes[0] == 1 else micro
        value = getattr(call.session.snapshot(), field)
        return number(telling.millimetres(value) if field.endswith("_m") else value)

    return act


def _fault(call: Call) -> Answer:
    fault = call.session.snapshot().fault
    if fault is None:
        return '0,"none","","",""'
    words = (fault.name, fault.message, fault.evidence, fault.remedy)
    return f"{fault.code}," + ",".join(map(quote, words))


def _lines(call: Call) -> Answer:
    lines = call.session.snapshot().lines
    return ",".join(f"{quote(name)},{flag(on)}" for name, on in lines) or '"",0'


def _calibrations(call: Call) -> Answer:
    found = calibrations(call.session.instrument.settings)
    each = (
        f"{quote(c['stage'])},{quote(c['made'])}," + numbers(c["temperature"], c["cold"], c["hot"])
        for c in found
    )
    return ",".join(each) or '"","",9.91E37,9.91E37,9.91E37'


def _pace(call: Call) -> Answer:
    pace = call.session.snapshot().pace
    shares = numbers(pace.share, pace.latest_s * 1e6, pace.longest_s * 1e6)
    return f"{pace.periods},{pace.missed},{shares}"


def of_stages(axes: tuple[str, ...]) -> Iterator[Command]:
    """The queries of a machine of several stages that name its stages."""
    for axis in axes:
        yield Command(
            f"POSition:{mnemonic(axis)}?",
            _axis(axis),
            f"The axis {axis} of a machine of several stages.",
            answer="position mm, uncertainty mm (half width), set point mm, effort V at the D/A",
        )


COMMANDS = (
    command("MODE?", lambda call: quote(call.session.snapshot().mode)),
    command("POSition[:ABSolute]?", _position),
    command("POSition:POINt?", _point),
    *of_stages(AXES),
    command("POSition:TRUSt?", _trust),
    command(f"{_STAGE}:POSition?", _of_stage("macro_count", "micro_m")),
    command(f"{_STAGE}:TARGet?", _of_stage("macro_reference", "micro_reference_m")),
    command(f"{_STAGE}:OUTPut?", _of_stage("motor_v", "ctrl_v")),
    command("TEMPerature?", lambda call: number(call.session.snapshot().temperature_c)),
    command("FAN?", lambda call: flag(call.session.snapshot().fan)),
    command("ENABle?", lambda call: flag(call.session.snapshot().enabled)),
    command("FAULt?", _fault),
    command("LINes?", _lines),
    command("CALibration?", _calibrations),
    command("DIAGnostic:PACE?", _pace),
    command("DIAGnostic:ABORt?", lambda call: number(call.session.snapshot().emergency_s * 1e3)),
)
