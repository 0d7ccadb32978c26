"""What may be wired to a card: channels and outputs of each kind of rig, and what each is."""

from __future__ import annotations

from typing import Any, NamedTuple

from macromicro.plant.cycle import CycleSample
from macromicro.plant.kiln import KilnSample
from macromicro.rig.fixtures import CycleOutputs, KilnOutputs
from macromicro.rig.session import BENCH, CYCLE, KILN
from macromicro.types import ENABLE, Enable, Lines, Outputs, Sample

ANALOG, DIGITAL, COUNTER = "analog", "digital", "counter"


class Role(NamedTuple):
    """What stands behind a terminal.

    Attributes
    ----------
    signal : str
        ANALOG, DIGITAL or COUNTER.
    unit : str
        Of the quantity.
    per_volt : str
        Unit of `scale`; "" where the quantity is the voltage itself, or none.
    """

    signal: str
    unit: str = "1"
    per_volt: str = ""


class Roles(NamedTuple):
    """What a kind of rig may have.

    Attributes
    ----------
    inputs, outputs : dict[str, Role]
        By channel.
    sample, written : type
        What is shown, and what is written.
    """

    inputs: dict[str, Role]
    outputs: dict[str, Role]
    sample: Any
    written: Any


_SWITCH, _COUNT, _VOLT = Role(DIGITAL), Role(COUNTER, "counts"), Role(ANALOG, "V")
_WARM = Role(ANALOG, "degC", "K/V")
_SWITCHES = tuple(name for name in Lines._fields if name != "index_count")  # it must be captured

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
    """Fields of what a rig with these channels shows.

    Parameters
    ----------
    kind : str
        Of the rig.
    channels : tuple[str, ...]
        Those that are wired.

    Returns
    -------
    tuple[str, ...]
        Those of the kind's sample, and behind them what the rig has more.
    """
    own = ROLES[kind].sample._fields
    return (*own, *(name for name in channels if name not in own))


def fields(kind: str, outputs: tuple[str, ...]) -> tuple[str, ...]:
    """Fields of what is written to a rig with these outputs.

    Parameters
    ----------
    kind : str
        Of the rig.
    outputs : tuple[str, ...]
        Those that are wired.

    Returns
    -------
    tuple[str, ...]
        Those of the kind, and the enable line where it is wired.
    """
    own: tuple[str, ...] = ROLES[kind].written._fields
    return own + (Enable._fields if ENABLE in outputs else ())
