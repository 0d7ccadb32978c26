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
    flag,
    mnemonic,
    number,
    numbers,
)
from macromicro.serve.scpi.errors import quoted
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
    return f"{flag(now.trusted)},{quoted(now.trust)}"


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
    return f"{fault.code}," + ",".join(map(quoted, words))


def _lines(call: Call) -> Answer:
    lines = call.session.snapshot().lines
    return ",".join(f"{quoted(name)},{flag(on)}" for name, on in lines) or '"",0'


def _calibrations(call: Call) -> Answer:
    found = calibrations(call.session.instrument.settings)
    each = (
        f"{quoted(c['stage'])},{quoted(c['made'])},"
        + numbers(c["temperature"], c["cold"], c["hot"])
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
    Command(
        "MODE?",
        lambda call: quoted(call.session.snapshot().mode),
        "Mode of the machine.",
        answer='"disabled", "homing", "ready", "moving-macro", "settling", "moving-micro", '
        '"holding", "fault", "stopped"; "off" without a loop process',
    ),
    Command(
        "POSition[:ABSolute]?",
        _position,
        "Position of the whole positioner, and its uncertainty.",
        answer="position mm, uncertainty mm (half width), 1 if it is trusted else 0",
    ),
    Command(
        "POSition:POINt?",
        _point,
        "Positions of all stages of a machine of several, in their order.",
        answer="x mm, y mm, ..., 1 if all are trusted else 0; 9.91E37 without such stages",
    ),
    *of_stages(AXES),
    Command(
        "POSition:TRUSt?",
        _trust,
        "Whether the position is trusted, and why.",
        answer='1 or 0, "why"',
    ),
    Command(
        f"{_STAGE}:POSition?",
        _of_stage("macro_count", "micro_m"),
        "Reading of one stage: 1 macro, 2 micro.",
        answer="counts, or mm of contraction",
    ),
    Command(
        f"{_STAGE}:TARGet?",
        _of_stage("macro_reference", "micro_reference_m"),
        "Set point of one stage.",
        answer="counts, or mm of contraction",
    ),
    Command(
        f"{_STAGE}:OUTPut?",
        _of_stage("motor_v", "ctrl_v"),
        "Output to one stage.",
        answer="V at the D/A",
    ),
    Command(
        "TEMPerature?",
        lambda call: number(call.session.snapshot().temperature_c),
        "Temperature of the wires, estimated from their control voltage.",
        answer="deg C",
    ),
    Command(
        "FAN?", lambda call: flag(call.session.snapshot().fan), "Is the fan on?", answer="1 or 0"
    ),
    Command(
        "ENABle?",
        lambda call: flag(call.session.snapshot().enabled),
        "Is the positioner enabled?",
        answer="1 or 0",
    ),
    Command(
        "FAULt?",
        _fault,
        "The latched fault in words.",
        answer='code, "name", "message", "evidence", "remedy"; code 0 for none',
    ),
    Command(
        "LINes?",
        _lines,
        "Existing limit and home switches and drive lines.",
        answer='"limit_low", "limit_high", "home", "drive_fault", "enabled" or "enable" and 1 if '
        'it is on or tripped else 0, for each; "",0 for none',
    ),
    Command(
        "CALibration?",
        _calibrations,
        "The calibration of each calibrated stage: when it was measured, and its temperatures.",
        answer='"stage", "date", mean, lowest and highest deg C, for each; "","",9.91E37,9.91E37,'
        "9.91E37 for none",
    ),
    Command(
        "DIAGnostic:PACE?",
        _pace,
        "How well the loop keeps its period.",
        answer="periods, missed, share missed of late, greatest lateness us, longest work us",
    ),
    Command(
        "DIAGnostic:ABORt?",
        lambda call: number(call.session.snapshot().emergency_s * 1e3),
        "Time from the last emergency stop until the outputs were safe.",
        answer="ms",
    ),
)
