"""The wiring file of a card."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from macromicro.control import calibration
from macromicro.control.calibration import Calibration
from macromicro.errors import InputError, ProblemError
from macromicro.rig.fixtures import CycleOutputs, CycleSample, KilnOutputs, KilnSample
from macromicro.rig.session import BENCH, CYCLE, KILN, KINDS
from macromicro.schema import keys
from macromicro.schema.text import plain, printable, read_text, read_toml
from macromicro.types import ENABLE, Enable, Lines, Outputs, Sample
from macromicro.units import quantity

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


SUFFIX = ".toml"
_TABLES = ("inputs", "outputs")
_HEAD = ("card", "device", "kind", "dt", "rest", "pitch", "calibration", "keeps_count", *_TABLES)
_OWN = {ANALOG: ("scale", "offset"), DIGITAL: ("invert",), COUNTER: ("reverse", "zero")}


class Terminal(NamedTuple):
    name: str  # channel or output of the rig
    signal: str  # `roles.ANALOG`, `roles.DIGITAL` or `roles.COUNTER`
    at: Mapping[str, Any]  # the card's own keys, as they were written: the card checks them
    where: str  # file and table, for messages
    # quantity for each volt; -1 for a counter that counts down; -1 for an inverted line
    scale: float = 1.0
    offset: float = 0.0  # quantity at 0 V; reading of a counter that is 0 counts


class Wiring(NamedTuple):
    """A card's terminals and properties of the machine."""

    name: str  # of the file, for messages
    # card, device: which library, and the device's name in it
    card: str
    device: str
    kind: str
    # inputs, outputs: in the file's order
    inputs: tuple[Terminal, ...]
    outputs: tuple[Terminal, ...]
    dt: float  # control period, s
    rest: float = 0.0  # how long it is left switched off before a run that must begin cold, s
    # travel per count of a kiln's encoder, m; NaN where the file gives none
    pitch: float = math.nan
    calibration: Calibration | None = None
    keeps_count: bool = False  # whether the counter counts on while nothing runs


def read_wiring(path: Path, own: Mapping[str, Mapping[str, tuple[str, ...]]]) -> Wiring:
    table = read_toml(path, "wiring of a card")
    keys.unknown(table, _HEAD, f"{path}: ")
    card = _one_of(table.get("card"), tuple(own), f"{path}: card")
    kind = _one_of(table.get("kind", BENCH), tuple(KINDS), f"{path}: kind")
    device = table.get("device")
    if not isinstance(device, str) or not device:
        raise InputError(f"{path}: device", keys.show_value(device), "the device's name, in quotes")
    inputs, outputs = (
        _terminals(table, which, getattr(ROLES[kind], which), own[card], path) for which in _TABLES
    )
    found = Wiring(
        str(path),
        card,
        device,
        kind,
        inputs,
        outputs,
        _seconds(table, "dt", path) or KINDS[kind].dt,
        _seconds(table, "rest", path),
        _number(table, "pitch", "m", f"{path}: pitch", math.nan),
        _calibration(table, path),
        _truth(table, "keeps_count", f"{path}: keeps_count"),
    )
    if not inputs:
        remedy = f"Add a table such as [inputs.{next(iter(ROLES[kind].inputs))}]."
        raise ProblemError(f"{path}: inputs", "there are none", remedy)
    return found


def _terminals(
    table: dict[str, Any],
    which: str,
    roles: Mapping[str, Role],
    own: Mapping[str, tuple[str, ...]],
    path: Path,
) -> tuple[Terminal, ...]:
    found = _table(table.get(which, {}), f"{path}: {which}")
    keys.unknown(found, roles, f"{path}: {which}.")
    made = []
    for name, raw in found.items():
        role, where = roles[name], f"{path}: {which}.{name}"
        given = _table(raw, where)
        keys.unknown(given, (*own[role.signal], *_OWN[role.signal]), f"{where}.")
        at = {key: plain(value) for key, value in given.items() if key in own[role.signal]}
        made.append(Terminal(name, role.signal, at, where, *_scale(given, role, where)))
    return tuple(made)


def _scale(given: dict[str, Any], role: Role, where: str) -> tuple[float, float]:
    if role.signal == DIGITAL:
        return (-1.0 if _truth(given, "invert", f"{where}.invert") else 1.0), 0.0
    if role.signal == COUNTER:
        zero = keys.whole(given.get("zero", 0), 0, 2**32 - 1, f"{where}.zero")
        return (-1.0 if _truth(given, "reverse", f"{where}.reverse") else 1.0), float(zero)
    if role.per_volt and "scale" not in given:
        remedy = f"Give text with a unit, such as '1 {role.per_volt}'."
        raise ProblemError(f"{where}.scale", "it is missing", remedy)
    scale = _number(given, "scale", role.per_volt or "1", f"{where}.scale", 1.0)
    if scale == 0.0:
        raise InputError(f"{where}.scale", printable(given["scale"]), "a number other than 0")
    return scale, _number(given, "offset", role.unit, f"{where}.offset", 0.0)


def _number(table: dict[str, Any], key: str, unit: str, where: str, default: float) -> float:
    raw = table.get(key)
    if raw is None:
        return default
    number = isinstance(raw, int | float) and not isinstance(raw, bool)
    text = f"{raw}" if number and unit == "1" else raw
    if not isinstance(text, str):
        raise InputError(where, printable(raw), f"text with a unit, such as '1 {unit}'")
    return quantity(text, unit, where)


def _seconds(table: dict[str, Any], key: str, path: Path) -> float:
    value = _number(table, key, "s", f"{path}: {key}", 0.0)
    if value < 0.0:
        raise InputError(f"{path}: {key}", printable(table[key]), "a time, 0 s or more")
    return value


def _calibration(table: dict[str, Any], path: Path) -> Calibration | None:
    raw = table.get("calibration")
    if raw is None:
        return None
    if not isinstance(raw, str):
        raise InputError(f"{path}: calibration", printable(raw), "name of a file, in quotes")
    file = path.parent / raw
    return calibration.parse(read_text(file, "Hall calibration"))


def _truth(table: dict[str, Any], key: str, where: str) -> bool:
    raw = table.get(key, False)
    if not isinstance(raw, bool):
        raise InputError(where, printable(raw), "true or false")
    return raw


def _table(raw: object, where: str) -> dict[str, Any]:
    if not isinstance(raw, dict):
        raise InputError(where, printable(raw), "a table")
    return raw


def _one_of(raw: object, known: tuple[str, ...], where: str) -> str:
    if not isinstance(raw, str) or raw not in known:
        raise InputError(where, keys.show_value(raw), f"one of {', '.join(known)}")
    return raw
