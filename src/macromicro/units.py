"""Text with units to plain floats and back: "4 mm" is 0.004 where metres are stored.

SI inside; encoder counts and deg C are the two exceptions. The units are a closed list:
what is not in it is refused, so a slip ("3 Hz" for rad/s, "20 degC" for a difference
in K, "5 rad" for counts) can never pass as something else. Hz is revolutions per
second: "1 Hz" for rad/s is 2 pi.
"""

from __future__ import annotations

import json
import math
import re
from decimal import Decimal
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from macromicro.errors import InputError

if TYPE_CHECKING:
    from pint import UnitRegistry

MAX_TEXT = 100

# name = definition = aliases; brackets name a dimension of its own. Standard gravity and
# the SI prefixes are exact, pi has 30 digits.
_DEFINITIONS = """
m = [length]; cm = 1e-2 m; mm = 1e-3 m; um = 1e-6 m; nm = 1e-9 m
s = [time]; ms = 1e-3 s; us = 1e-6 s; min = 60 s; h = 3600 s
kg = [mass]; g = 1e-3 kg; mg = 1e-6 kg
A = [current]; mA = 1e-3 A; uA = 1e-6 A
K = [difference]
degC = [temperature]
counts = [encoder] = _ = count
bits = [bit] = _ = bit
rad = [angle]; deg = 0.0174532925199432957692369076849 rad; rev = 360 deg
Hz = rev/s; kHz = 1e3 Hz; rpm = rev/min
N = kg*m/s**2; mN = 1e-3 N; kN = 1e3 N; gf = 9.80665e-3 N; kgf = 9.80665 N
J = N*m; kJ = 1e3 J; mJ = 1e-3 J
W = J/s; kW = 1e3 W; mW = 1e-3 W
V = W/A; kV = 1e3 V; mV = 1e-3 V; uV = 1e-6 V
ohm = V/A; kohm = 1e3 ohm; mohm = 1e-3 ohm
H = V*s/A; mH = 1e-3 H; uH = 1e-6 H
F = A*s/V; uF = 1e-6 F
Pa = N/m**2; kPa = 1e3 Pa; MPa = 1e6 Pa; GPa = 1e9 Pa
T = V*s/m**2; mT = 1e-3 T
percent = 1e-2; ppm = 1e-6
"""

_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?"
_FACTOR = r"[A-Za-z_]+(?:(?:\*\*|\^)-?[1-9])?"
_TIMES = r"(?: ?[*/] ?| )"
_GROUP = rf"(?:1|{_FACTOR}|\({_FACTOR}(?:{_TIMES}{_FACTOR})*\))"
# Nothing but names, one-digit powers, * and / reaches the parser behind it.
_UNIT = re.compile(rf"{_GROUP}(?:{_TIMES}{_GROUP})*")
_TEXT = re.compile(rf"({_NUMBER})(?: ?([A-Za-z(%°µμΩ].*)| (1 ?/.*))?")
_NONE = ("", "1", "-")  # ways to say that a quantity has no unit
_SPELLINGS = {
    "%": "percent",
    "°C": "degC",
    "µ": "u",  # micro sign
    "μ": "u",  # the Greek letter
    "Ω": "ohm",
    "·": "*",
    "²": "^2",
    "³": "^3",
}


class _UnknownUnit(ValueError):
    """The text is no unit of the closed list."""


@cache
def _registry() -> UnitRegistry[Any]:
    """pint with only our units; decimal arithmetic, so that "3 um" is exactly 3e-6."""
    from pint import UnitRegistry

    registry: UnitRegistry[Any] = UnitRegistry(None, non_int_type=Decimal)
    for definition in _definitions():
        registry.define(definition)
    return registry


@cache
def _definitions() -> tuple[str, ...]:
    return tuple(d.strip() for line in _DEFINITIONS.split("\n") for d in line.split(";") if d)


@cache
def _names() -> tuple[str, ...]:
    """Every unit's name, in the order of the list."""
    return tuple(d.split(" ", 1)[0] for d in _definitions())


Dimension = tuple[tuple[str, float], ...]


@cache
def _shipped() -> dict[str, tuple[Decimal, Dimension]]:
    """What `by_pint` gives for the units of the package's own parameters, kept in a file
    (docs/make_units.py writes it): most runs then need not import pint."""
    text = (Path(__file__).parent / "unit_sizes.json").read_text(encoding="utf-8")
    return {k: (Decimal(size), tuple(dim.items())) for k, (size, dim) in json.loads(text).items()}


@lru_cache(maxsize=512)
def _size(unit: str) -> tuple[Decimal, Dimension]:
    """A unit's size in base units and its dimension; _UnknownUnit if it has none."""
    return _shipped()[unit] if unit in _shipped() else by_pint(unit)


def by_pint(unit: str) -> tuple[Decimal, Dimension]:
    """The same, worked out by pint."""
    text = unit
    for spelling, name in _SPELLINGS.items():
        text = text.replace(spelling, name)
    if text in _NONE:
        text = "1"
    elif _UNIT.fullmatch(text) is None:
        raise _UnknownUnit(unit)
    known = {*_names(), "count", "bit"}
    if not set(re.findall(r"[A-Za-z_]+", text)) <= known:
        raise _UnknownUnit(unit)
    registry = _registry()
    base = registry.Quantity(Decimal(1), registry.parse_units(text)).to_base_units()
    powers = dict(base.dimensionality)
    dimension = sorted((str(name), float(str(power))) for name, power in powers.items())
    return Decimal(base.magnitude), tuple(dimension)


@cache
def alike(unit: str) -> tuple[str, ...]:
    """The units that a quantity stored in `unit` may be given in, `unit` itself first."""
    dimension = _size(unit)[1]
    same = [name for name in _names() if name != unit and _size(name)[1] == dimension]
    return (unit, *same) if unit not in _NONE else tuple(same)


def remedy(*units: str) -> str:
    """What to write for a quantity that is stored in one of `units`, in words."""
    names = [name for unit in units if unit not in _NONE for name in alike(unit)]
    if not names:
        return "a plain number, such as 0.5"
    listed = f"{', '.join(names[:-1])} or {names[-1]}" if len(names) > 1 else names[0]
    note = " (a temperature difference)" if units == ("K",) else ""
    return f"a finite number and its unit: {listed}{note}"


def measured(text: str, units: tuple[str, ...], where: str) -> tuple[float, str]:
    """The value of `text` and which of `units` it has the dimension of.

    `text` is a decimal number and a unit ("1.5 mm", "8 J/(kg K)", "3e-4 V"), never more
    than 100 characters and never evaluated. Raises `InputError` with `where`.
    """
    short = len(text) <= MAX_TEXT
    match = _TEXT.fullmatch(" ".join(text.split())) if short else None
    if match is not None:
        number, written = Decimal(match[1]), match[2] or match[3] or ""
        for unit in units:
            try:
                size, dimension = _size(written)
            except _UnknownUnit:
                break
            goal, wanted = _size(unit)
            if dimension == wanted:
                value = float(number * size / goal)
                if math.isfinite(value) and (value != 0.0) == (number != 0):
                    return value, unit
                break
    cut = text if short else f"{text[:40]}... ({len(text)} characters)"
    raise InputError(where, cut, remedy(*units))


def quantity(text: str, unit: str, where: str) -> float:
    """The value of `text` in `unit`: "4 mm" is 0.004 for "m".

    A number without a unit is accepted only for the units "", "1" and "-" (none). Raises
    `InputError` with `where` for everything else: no or a wrong unit, NaN, infinity.
    """
    return measured(text, (unit,), where)[0]


def convert(value: float, unit: str, to: str) -> float:
    """`value` given in `unit`, in the unit `to`. Both are the program's own, not a user's."""
    size, dimension = _size(unit)
    goal, wanted = _size(to)
    if dimension != wanted:
        raise ValueError(f"{unit!r} does not convert to {to!r}")
    return float(Decimal(repr(float(value))) * size / goal)


def shown(value: float, unit: str, shown_unit: str = "", digits: int = 17) -> str:
    """`value`, stored in `unit`, as text in `shown_unit` (default: `unit`).

    The fewest digits, at most `digits`, that `quantity` reads back to the same float.
    NaN and infinity are shown as such; `quantity` refuses them.
    """
    other = shown_unit or unit
    tail = "" if other in _NONE else f" {other}"
    value = float(value)
    if not math.isfinite(value):
        return f"{value}{tail}"
    size, dimension = _size(unit)
    goal, wanted = _size(other)
    if dimension != wanted:
        raise ValueError(f"{unit!r} cannot be shown in {other!r}")
    exact = Decimal(value) * size / goal
    text = ""
    for count in range(1, digits + 1):
        text = f"{exact:.{count}g}" if exact else "0"
        if float(Decimal(text) * goal / size) == value:
            break
    return f"{_plain(Decimal(text))}{tail}"


def _plain(number: Decimal) -> str:
    """A decimal without an exponent where that is short: 2800, 0.00012, 1e+9."""
    number = number.normalize()
    if -5 <= number.adjusted() <= 8 or not number:
        return f"{number:f}"
    return f"{number:e}"
