"""Text with units to plain floats and back: "4 mm" is 0.004 where metres are stored.

SI inside, except encoder counts and deg C. The units are a closed list; Hz is revolutions per
second: "1 Hz" for rad/s is 2 pi.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from decimal import Decimal
from functools import cache, lru_cache

from macromicro.errors import InputError

MAX_TEXT = 100

# name = definition = alias; brackets name a dimension of its own. Standard gravity and
# the SI prefixes are exact, pi has 30 digits.
_DEFINITIONS = """
m = [length]; cm = 1e-2 m; mm = 1e-3 m; um = 1e-6 m; nm = 1e-9 m; inch = 25.4 mm
s = [time]; ms = 1e-3 s; us = 1e-6 s; min = 60 s; h = 3600 s
kg = [mass]; g = 1e-3 kg; mg = 1e-6 kg
A = [current]; mA = 1e-3 A; uA = 1e-6 A
K = [difference]
degC = [temperature]
counts = [encoder] = count
bits = [bit] = bit
rad = [angle]; mrad = 1e-3 rad; urad = 1e-6 rad
deg = 0.0174532925199432957692369076849 rad; mdeg = 1e-3 deg; udeg = 1e-6 deg
arcmin = 2.90888208665721596153948461415e-4 rad; arcsec = 4.84813681109535993589914102357e-6 rad
rev = 360 deg = turn
Hz = rev/s; kHz = 1e3 Hz; rpm = rev/min
N = kg*m/s^2; mN = 1e-3 N; kN = 1e3 N; gf = 9.80665e-3 N; kgf = 9.80665 N
ozf = 0.2780138509537812 N
J = N*m; kJ = 1e3 J; mJ = 1e-3 J
W = J/s; kW = 1e3 W; mW = 1e-3 W
V = W/A; kV = 1e3 V; mV = 1e-3 V; uV = 1e-6 V
ohm = V/A; kohm = 1e3 ohm; mohm = 1e-3 ohm
H = V*s/A; mH = 1e-3 H; uH = 1e-6 H
F = A*s/V; uF = 1e-6 F
Pa = N/m^2; kPa = 1e3 Pa; MPa = 1e6 Pa; GPa = 1e9 Pa
T = V*s/m^2; mT = 1e-3 T
percent = 1e-2; ppm = 1e-6
"""

_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?"
_FACTOR = r"[A-Za-z_]+(?:(?:\*\*|\^)-?[1-9])?"
_TIMES = r"(?: ?[*/] ?| )"
_GROUP = rf"(?:1|{_FACTOR}|\({_FACTOR}(?:{_TIMES}{_FACTOR})*\))"
# Nothing but names, one-digit powers, * and / reaches the parser behind it.
_UNIT = re.compile(rf"{_GROUP}(?:{_TIMES}{_GROUP})*")
_TOKEN = re.compile(r"[A-Za-z_]+(?:(?:\*\*|\^)-?[1-9])?|1| ?[*/] ?|[() ]")
_NUMBER_ALONE = re.compile(r"[0-9.]+(?:e-?[0-9]+)?")
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


def printed(unit: str) -> str:
    """A unit, or a text with one, as tables print it: "V s/m", "s^2".

    Parameters
    ----------
    unit : str
        As settings have it, such as "V*s/m" or "s**2".

    Returns
    -------
    str
        Products by spaces, powers by "^".

    Examples
    --------
    >>> from macromicro.units import printed
    >>> printed("V*s/m")
    'V s/m'
    """
    return unit.replace("**", "^").replace("*", " ")


class _UnknownUnit(ValueError):
    pass


Dimension = tuple[tuple[str, int], ...]
_Size = tuple[Decimal, Counter[str]]


@cache
def _units() -> dict[str, _Size]:
    """Every unit's size in base units and their powers, in decimal arithmetic."""
    found: dict[str, _Size] = {}
    for definition in _DEFINITIONS.replace("\n", ";").split(";"):
        name, *meanings = (part.strip() for part in definition.split("="))
        for meaning in meanings[:1]:
            number, _, unit = meaning.partition(" ")
            if meaning.startswith("["):
                found[name] = Decimal(1), Counter([meaning])
            elif _NUMBER_ALONE.fullmatch(number):
                size, powers = _product(unit or "1", found)
                found[name] = Decimal(number) * size, powers
            else:
                found[name] = _product(meaning, found)
        for alias in meanings[1:]:
            found[alias] = found[name]
    return found


def _product(text: str, known: dict[str, _Size]) -> _Size:
    """Size and powers of a product of `known` units: "J/(kg K)", "m*s^2", "1/s"."""
    size, powers = Decimal(1), Counter[str]()
    group, sign = 1, 1  # of the open bracket, and of the factor that comes next
    for token in _TOKEN.findall(text):
        if token.strip() in ("*", "", "/"):
            sign = -group if "/" in token else group
        elif token in "()":
            group = sign if token == "(" else 1
        else:
            name, _, power = token.replace("**", "^").partition("^")
            if name not in known and name != "1":
                raise _UnknownUnit(name)
            exponent = sign * int(power or 1)
            one, its = known.get(name, (Decimal(1), Counter[str]()))
            size *= one**exponent
            for dimension, n in its.items():
                powers[dimension] += n * exponent
    return size, powers


@lru_cache(maxsize=512)
def _size(unit: str) -> tuple[Decimal, Dimension]:
    """A unit's size in base units and its dimension."""
    text = unit
    for spelling, name in _SPELLINGS.items():
        text = text.replace(spelling, name)
    if text in _NONE:
        text = "1"
    elif _UNIT.fullmatch(text) is None:
        raise _UnknownUnit(unit)
    size, powers = _product(text, _units())
    return size, tuple(sorted((name, power) for name, power in powers.items() if power))


@cache
def _names() -> tuple[str, ...]:
    """Every offered unit in the order of the list."""
    return tuple(name for name in _units() if name not in ("count", "bit", "inch", "ozf"))


@cache
def alike(unit: str) -> tuple[str, ...]:
    """The units that a quantity may be given in.

    Parameters
    ----------
    unit : str
        Unit in which it is stored.

    Returns
    -------
    tuple[str, ...]
        `unit` itself first, then all others of its dimension.

    Examples
    --------
    >>> from macromicro.units import alike
    >>> alike("m")
    ('m', 'cm', 'mm', 'um', 'nm')
    """
    dimension = _size(unit)[1]
    same = [name for name in _names() if name != unit and _size(name)[1] == dimension]
    return (unit, *same) if unit not in _NONE else tuple(same)


def remedy(*units: str) -> str:
    """Accepted spellings of a quantity, for messages.

    Parameters
    ----------
    *units : str
        Units in which it may be stored.

    Returns
    -------
    str
        The end of an error message: what is accepted.

    Examples
    --------
    >>> from macromicro.units import remedy
    >>> remedy("m")
    'a finite number and its unit: m, cm, mm, um or nm'
    """
    names = [name for unit in units if unit not in _NONE for name in alike(unit)]
    if not names:
        return "a plain number, such as 0.5"
    listed = f"{', '.join(names[:-1])} or {names[-1]}" if len(names) > 1 else names[0]
    note = " (a temperature difference)" if units == ("K",) else ""
    return f"a finite number and its unit: {listed}{note}"


def measured(text: str, units: tuple[str, ...], where: str) -> tuple[float, str]:
    """The value of a text, and which of several units it has the dimension of.

    Parameters
    ----------
    text : str
        A decimal number and a unit ("1.5 mm", "8 J/(kg K)", "3e-4 V"), at most 100 characters;
        never evaluated.
    units : tuple[str, ...]
        Those it may be stored in.
    where : str
        File and key, for the message.

    Returns
    -------
    value : float
        In the unit found.
    unit : str
        The first of `units` of the same dimension.

    Raises
    ------
    InputError
        No number, no or a wrong unit, NaN, infinity, or an overflow.

    Examples
    --------
    >>> from macromicro.units import measured
    >>> measured("1.5 mm", ("rad", "m"), "machine.toml, travel")
    (0.0015, 'm')
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
            goal, needed = _size(unit)
            if dimension == needed:
                value = float(number * size / goal)
                if math.isfinite(value) and (value != 0.0) == (number != 0):
                    return value, unit
                break
    cut = text if short else f"{text[:40]}... ({len(text)} characters)"
    raise InputError(where, cut, remedy(*units))


def quantity(text: str, unit: str, where: str, offered: str = "") -> float:
    """The value of a text in a unit: "4 mm" is 0.004 for "m".

    Parameters
    ----------
    text : str
        A decimal number and a unit. Without a unit it is accepted only for the units "", "1" and
        "-" (none).
    unit : str
        Unit in which the value is stored.
    where : str
        File and key, for the message.
    offered : str, optional
        Unit that the message names first; "" for `unit`.

    Returns
    -------
    float
        In `unit`.

    Raises
    ------
    InputError
        No number, no or a wrong unit, NaN, infinity.

    Examples
    --------
    >>> from macromicro.units import quantity
    >>> quantity("4 mm", "m", "machine.toml, travel")
    0.004
    """
    try:
        return measured(text, (unit,), where)[0]
    except InputError as error:
        raise InputError(where, error.value, remedy(offered or unit)) from None


def size(unit: str) -> float:
    """How many base units a unit is.

    Parameters
    ----------
    unit : str
        The program's own, not a user's.

    Returns
    -------
    float
        1e-3 for "mm/s".

    Examples
    --------
    >>> from macromicro.units import size
    >>> size("mm/s")
    0.001
    """
    return float(_size(unit)[0])


def quotient(above: str, below: str) -> str:
    """The unit of a quantity per another.

    Parameters
    ----------
    above, below : str
        Units, or what is no unit where none is known.

    Returns
    -------
    str
        As `convert` reads it, "mm/(m/s)"; "" where one of them is no unit, or both are the same.

    Examples
    --------
    >>> from macromicro.units import quotient
    >>> quotient("mm", "m/s"), quotient("V", "V")
    ('mm/(m/s)', '')
    """
    for unit in (above, below):
        try:
            if not _size(unit)[1] and unit in _NONE:
                return ""
        except _UnknownUnit:
            return ""
    if above == below:
        return ""
    if below.startswith("1/"):
        return f"{above}*{below[2:]}"
    return f"{above}/({below})" if any(mark in below for mark in "*/ ") else f"{above}/{below}"


def convert(value: float, unit: str, to: str) -> float:
    """A value in another unit. Both units are the program's own, not a user's.

    Parameters
    ----------
    value : float
        In `unit`.
    unit : str
        Unit of `value`.
    to : str
        Requested unit.

    Returns
    -------
    float
        In `to`.

    Raises
    ------
    ValueError
        The units have different dimensions.

    Examples
    --------
    >>> from macromicro.units import convert
    >>> convert(0.25, "m/s", "mm/s")
    250.0
    """
    size, dimension = _size(unit)
    goal, needed = _size(to)
    if dimension != needed:
        raise ValueError(f"{unit!r} does not convert to {to!r}")
    return float(Decimal(repr(float(value))) * size / goal)


_READABLE = {"m": ("m", "mm", "um", "nm"), "s": ("s", "ms", "us"), "V": ("V", "mV", "uV")}


def readable(value: float, unit: str) -> tuple[float, str]:
    """The unit in which a value has digits before its point, as um for 0.0001 m, and its factor.

    Parameters
    ----------
    value : float
        In `unit`.
    unit : str
        Unit of `value`.

    Returns
    -------
    tuple[float, str]
        What to multiply by, and a metre, second or volt or a part of it; any other unit stays.

    Examples
    --------
    >>> from macromicro.units import readable
    >>> readable(0.000125, "m"), readable(9e-05, "s"), readable(0.1, "N")
    ((1000000.0, 'um'), (1000000.0, 'us'), (1.0, 'N'))
    """
    if value == 0.0 or not math.isfinite(value):
        return 1.0, unit
    scales = [(1000.0**k, part) for k, part in enumerate(_READABLE.get(unit, (unit,)))]
    return next((each for each in scales if abs(value) * each[0] >= 1.0), scales[-1])


def shown(value: float, unit: str, shown_unit: str = "", digits: int = 17) -> str:
    """A stored value as text with its unit.

    The fewest digits, at most `digits`, that `quantity` reads back to the same float. NaN and
    infinity are shown as such; `quantity` refuses them.

    Parameters
    ----------
    value : float
        In `unit`.
    unit : str
        Unit in which it is stored.
    shown_unit : str, optional
        Unit in which it is shown; "" for `unit`.
    digits : int, optional
        Largest number of significant digits.

    Returns
    -------
    str
        Number and unit, without one if the quantity has none.

    Raises
    ------
    ValueError
        The units have different dimensions.

    Examples
    --------
    >>> from macromicro.units import shown
    >>> shown(0.004, "m", "mm")
    '4 mm'
    >>> shown(1.0 / 3.0, "m", "mm", digits=4)
    '333.3 mm'
    """
    other = shown_unit or unit
    tail = "" if other in _NONE else f" {other}"
    value = float(value)
    if not math.isfinite(value):
        return f"{value}{tail}"
    size, dimension = _size(unit)
    goal, needed = _size(other)
    if dimension != needed:
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
