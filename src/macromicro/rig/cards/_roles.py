"""Channels and outputs that can be wired to a card, for each kind of rig."""

from __future__ import annotations

from typing import Any, NamedTuple

from macromicro.rig.fixtures import CycleOutputs, CycleSample, KilnOutputs, KilnSample
from macromicro.rig.session import BENCH, CYCLE, KILN
from macromicro.types import ENABLE, Enable, Lines, Outputs, Sample

ANALOG, DIGITAL, COUNTER = "analog", "digital", "counter"


class Role(NamedTuple):
    signal: str  # ANALOG, DIGITAL or COUNTER
    unit: str = "1"  # of the quantity
    per_volt: str = ""  # unit of `scale`; "" where the quantity is the voltage itself, or none


class Roles(NamedTuple):
    # inputs, outputs: by channel
    inputs: dict[str, Role]
    outputs: dict[str, Role]
    # sample, written: what is shown, and what is written
    sample: Any
    written: Any


_SWITCH, _COUNT, _VOLT = Role(DIGITAL), Role(COUNTER, "counts"), Role(ANALOG, "V")
_WARM = Role(ANALOG, "degC", "K/V")
_SWITCHES = tuple(name for name in Lines._fields if name not in ("index_count", "temperature"))

ROLES = {
    BENCH: Roles(
        {
            "encoder": _COUNT,
            "hall": _VOLT,
            "laser": Role(ANALOG, "m", "m/V"),
            "extend": _SWITCH,
            "contract": _SWITCH,
            **dict.fromkeys(_SWITCHES, _SWITCH),
        },
        {"motor": _VOLT, "ctrl": _VOLT, "fan": _SWITCH, "laser_reset": _SWITCH, ENABLE: _SWITCH},
        Sample,
        Outputs,
    ),
    KILN: Roles(
        {"thermocouple": _WARM, "encoder": _COUNT}, {"heater": _SWITCH}, KilnSample, KilnOutputs
    ),
    CYCLE: Roles(
        {"encoder": _COUNT, "extend": _SWITCH, "contract": _SWITCH, "room": _WARM},
        {"ctrl": _VOLT, "fan": _SWITCH},
        CycleSample,
        CycleOutputs,
    ),
}


def shape(kind: str, channels: tuple[str, ...]) -> tuple[str, ...]:
    """Fields of a sample with these channels."""
    own = ROLES[kind].sample._fields
    return (*own, *(name for name in channels if name not in own))


def fields(kind: str, outputs: tuple[str, ...]) -> tuple[str, ...]:
    """Fields of the outputs."""
    own: tuple[str, ...] = ROLES[kind].written._fields
    return own + (Enable._fields if ENABLE in outputs else ())
