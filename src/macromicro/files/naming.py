"""Column names as quantity and unit."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from macromicro.units import convert

IN_NAME, IN_ROW, BESIDE = "in its name", "in the row of units", "beside it in the file"
DATES = "dates or times of day"
# Names of a column of times, best first, as `plain` has them.
TIMES = ("t", "time", "zeit", "timestamp", "datetime", "x_value", "clock", "seconds")
_BRACKETS = re.compile(r"(.+?)(\s*)([\[(])(.*)[\])]")
_SUFFIXES = (re.compile(r"(.+?)_([^_]+_per_[^_]+)"), re.compile(r"(.+)_([^_]+)"))
_ENDINGS = {"C": "degC", "count": "counts", "counts": "counts"}
# Spellings of people and of other programs; "in" is a unit where it stands in brackets or in a row
# of units, for u_in is an input.
_SPELLINGS = {
    "s": "sec, secs, second, seconds", "ms": "msec", "us": "usec", "min": "minutes", "h": "hours",
    "V": "volt, volts", "A": "amp, amps, ampere", "N": "newton, newtons", "W": "watt",
    "m": "meter, meters, metre, metres", "um": "micron, microns, micrometer", "mm": "millimeter",
    "inch": "inches", "deg": "degrees, °, degree", "rad": "radian, radians",
    "rev": "rotation, rotations, rot, turns, revs, revolution, revolutions",
    "degC": "deg c, celsius", "K": "kelvin", "Hz": "hertz", "counts": "count, cts",
}  # fmt: skip
_WORDS = {word: unit for unit, words in _SPELLINGS.items() for word in words.split(", ")}
_BRACKETED = {"in": "inch", "in.": "inch", '"': "inch", "C": "degC", "c": "counts"}
# Torques; as a unit of force a kilogram or an ounce is its weight.
_BRACKETED |= {"Nm": "N*m", "mNm": "mN*m", "kNm": "kN*m", "Ncm": "N*cm"}
_BRACKETED |= dict.fromkeys(("kg*cm", "kgcm", "kg cm", "kg-cm", "kgf cm"), "kgf*cm")
_BRACKETED |= dict.fromkeys(("oz*in", "oz-in", "oz in", "ozin", "ozf*in"), "ozf*inch")
_ONLY_OF_TIMES = ("min", "h")  # x_min is a least position


def split_unit(name: str) -> tuple[str, str]:
    text = name.strip()
    if match := _BRACKETS.fullmatch(text):
        inner = match[4].strip()
        if unit := spell_unit(inner):
            return match[1].strip(), unit
        # der(x) and x[1] are names of a simulator, "x [furlong]" is a unit that nobody knows.
        if match[2] or (match[3] == "[" and not inner.isdigit()):
            return match[1].strip(), inner
    for suffix in _SUFFIXES:
        if match := suffix.fullmatch(text):
            unit = _ENDINGS.get(match[2], match[2].replace("_per_", "/"))
            if unit in _ONLY_OF_TIMES and plain(match[1]) not in TIMES:
                continue
            if is_known_unit(unit):
                return match[1], unit
    return text, ""


def spell_unit(text: str) -> str:
    """A unit in this package's spelling."""
    plain = text.strip()
    if len(plain) > 2 and plain[0] in "[(<" and plain[-1] in "])>":
        plain = plain[1:-1].strip()
    plain = _BRACKETED.get(plain, _WORDS.get(plain.lower(), plain))
    return plain if is_known_unit(plain) else ""


def is_known_unit(unit: str) -> bool:
    if unit in ("", "1", "-"):
        return False
    try:
        convert(1.0, unit, unit)
    except ValueError:
        return False
    return True


def plain(name: str) -> str:
    """A name for comparison; single letters keep their case, since T is not t."""
    return name if len(name) == 1 else name.lower()


def by_name(columns: Iterable[str], names: Sequence[str]) -> str:
    """The column with one of some usual names: as it is, without its unit, or its group."""
    listed = list(columns)[::-1]
    found = {plain(split_unit(last(n))[0]): n for n in listed}
    found |= {plain(split_unit(n)[0]): n for n in listed}
    found |= {plain(n): n for n in listed}
    return next((found[name] for name in names if name in found), "")


def last(name: str) -> str:
    """The name within its group or struct."""
    return name.rpartition(".")[2]


def units_in(names: list[str]) -> tuple[dict[str, str], dict[str, str]]:
    """Units in column names."""
    units = {name: split_unit(last(name))[1] for name in names}
    return units, {name: IN_NAME for name, unit in units.items() if unit}
