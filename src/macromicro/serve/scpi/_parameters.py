"""Parameters with unit, bounds and choices."""

from __future__ import annotations

import math
from decimal import Decimal
from typing import Any, NamedTuple

from macromicro.serve.scpi._data import BLOCK, NUMBER, STRING, WORD, Element, excerpt
from macromicro.serve.scpi.errors import ScpiError
from macromicro.units import size

_ANGLES = ("DEG", "MDEG", "UDEG", "RAD", "MRAD", "URAD", "ARCMIN", "ARCSEC", "TURN", "REV")
# Suffixes of SCPI know no case (7.4.3 of IEEE 488.2), so M is always metre and MM millimetre.
UNITS: dict[str, dict[str, Decimal]] = {
    "m": {s: Decimal(x) for s, x in (("MM", "1e-3"), ("UM", "1e-6"), ("CM", "1e-2"), ("M", "1"))},
    "m/s": {s: Decimal(x) for s, x in (("MM/S", "1e-3"), ("UM/S", "1e-6"), ("M/S", "1"))},
    "rad": {s: Decimal(repr(size(s.lower()))) for s in _ANGLES},
    "rad/s": {
        "DEG/S": Decimal(repr(size("deg"))),
        "RAD/S": Decimal(1),
        "RPM": Decimal(repr(size("rpm"))),
    },
    "s": {s: Decimal(x) for s, x in (("S", "1"), ("MS", "1e-3"))},
    "counts": {"COUNTS": Decimal(1), "COUNT": Decimal(1)},
    "": {},
}
# 0.1 could be meant in mm: a place or a speed must say what it is.
NEEDED = ("m", "m/s", "rad", "rad/s")


class Number(NamedTuple):
    """A finite number in `unit` from `lo` to `hi`, or one of the words `instead`."""

    name: str
    unit: str = ""
    lo: float = -math.inf
    hi: float = math.inf
    whole: bool = False
    rounds: bool = False
    instead: tuple[str, ...] = ()
    optional: bool = False

    def read(self, element: Element) -> float | str:
        """The value, or a word's short form; raises ScpiError -104, -131, -138, -222."""
        if element.kind == WORD and self.instead:
            return Word(self.name, self.instead).read(element)
        if element.kind != NUMBER:
            raise ScpiError(-104, f"{self.name}: {excerpt(element.text)}; accepted: {self.words()}")
        known = UNITS[self.unit]
        if element.suffix and not known:
            raise ScpiError(-138, f"{self.name}: {element.suffix}; accepted: {self.words()}")
        number = Decimal(element.text)
        needed = self.unit in NEEDED and number != 0  # nothing is as much in any unit
        if element.suffix not in known and (element.suffix or needed):
            found = element.suffix or "no unit"
            raise ScpiError(-131, f"{self.name}: {found}; accepted: {', '.join(known)}")
        value = float(number * known.get(element.suffix, Decimal(1)))
        fine = math.isfinite(value) and (value != 0.0) == (number != 0)
        if fine and self.rounds:  # IEEE 488.2, 10.10
            value = float(math.floor(value + 0.5))
        if not (fine and self.lo <= value <= self.hi):
            raise ScpiError(-222, f"{self.name}: {excerpt(element.text)}; accepted: {self.words()}")
        if self.whole and value != math.floor(value):
            raise ScpiError(-222, f"{self.name}: {excerpt(element.text)}; accepted: {self.words()}")
        return value

    def words(self) -> str:
        kind = "a whole number" if self.whole else "a number"
        if self.rounds:
            kind = "a number, rounded to a whole one,"
        bounds = ""
        if self.hi < math.inf:
            bounds = f" from {self.lo:g} to {self.hi:g}" + (f" {self.unit}" if self.unit else "")
        elif self.lo > -math.inf:
            bounds = f" of at least {self.lo:g}"
        units = ", ".join(UNITS[self.unit])
        must = "" if self.unit in NEEDED else " or none"
        instead = f"; or {', '.join(self.instead)}" if self.instead else ""
        return f"{kind}{bounds}" + (f", unit {units}{must}" if units else "") + instead


class Flag(NamedTuple):
    """ON, OFF or a number, ON unless it rounds to 0 (SCPI-99, volume 1, 7.3)."""

    name: str
    optional: bool = False

    def read(self, element: Element) -> bool:
        """The value; raises ScpiError -104, -138, -224."""
        if element.kind == WORD and element.text.upper() in ("ON", "OFF"):
            return element.text.upper() == "ON"
        if element.kind == NUMBER and element.suffix:
            raise ScpiError(-138, f"{self.name}: {element.suffix}")
        if element.kind in (STRING, BLOCK):
            raise ScpiError(-104, f"{self.name}; accepted: {self.words()}")
        if element.kind == NUMBER:
            return abs(Decimal(element.text)) >= Decimal("0.5")
        raise ScpiError(-224, f"{self.name}: {excerpt(element.text)}; accepted: {self.words()}")

    def words(self) -> str:
        return "ON, OFF, 1 or 0"


class Word(NamedTuple):
    """One of `choices` in SCPI notation ("SWAPped": SWAP or SWAPPED)."""

    name: str
    choices: tuple[str, ...]
    optional: bool = False

    def read(self, element: Element) -> str:
        """The short form of the chosen word; raises ScpiError -104, -224."""
        if element.kind != WORD:
            raise ScpiError(-104, f"{self.name}; accepted: {self.words()}")
        for choice in self.choices:
            if element.text.upper() in spellings(choice):
                return spellings(choice)[0]
        raise ScpiError(-224, f"{self.name}: {excerpt(element.text)}; accepted: {self.words()}")

    def words(self) -> str:
        return " or ".join(self.choices)


class Text(NamedTuple):
    """A quoted string of at most `most` characters; with `bare` also a word."""

    name: str
    most: int = 100
    bare: bool = False
    optional: bool = False

    def read(self, element: Element) -> str:
        """The text; raises ScpiError -104, -223."""
        if element.kind != STRING and not (self.bare and element.kind == WORD):
            raise ScpiError(-104, f"{self.name}; accepted: {self.words()}")
        if len(element.text) > self.most:
            raise ScpiError(-223, f"{self.name}; accepted: {self.words()}")
        return element.text

    def words(self) -> str:
        return f'a string "..." of at most {self.most} characters' + (
            " or a bare word" if self.bare else ""
        )


class NameOrBlock(NamedTuple):
    """A quoted name, or a block of given length."""

    name: str
    optional: bool = False

    def read(self, element: Element) -> str | bytes:
        """The name, or the block's bytes; raises ScpiError -104, -223."""
        if element.kind == BLOCK:
            return element.data
        return Text(self.name).read(element)

    def words(self) -> str:
        return 'a name "...", or a block #<digits><length><bytes>'


class NumberOrText(NamedTuple):
    """A number without a unit, or a quoted string."""

    name: str
    optional: bool = False

    def read(self, element: Element) -> float | str:
        """The value; raises ScpiError -104, -138, -222, -223."""
        if element.kind == STRING:
            return Text(self.name).read(element)
        return float(Number(self.name).read(element))

    def words(self) -> str:
        return 'a number, or a string "..."'


Parameter = Number | Flag | Word | Text | NameOrBlock | NumberOrText


def read_values(parameters: tuple[Parameter, ...], given: list[Element]) -> tuple[Any, ...]:
    """The values of all parameters, None for an omitted optional one."""
    if len(given) > len(parameters):
        most = f"at most {len(parameters)}" if parameters else "none"
        raise ScpiError(-108, f"{len(given)} parameters; accepted: {most}")
    values: list[Any] = []
    for k, parameter in enumerate(parameters):
        if k < len(given):
            values.append(parameter.read(given[k]))
        elif parameter.optional:
            values.append(None)
        else:
            raise ScpiError(-109, f"{parameter.name}: {parameter.words()}")
    return tuple(values)


def spellings(node: str) -> tuple[str, str]:
    """Short and long form, in capitals, of a node such as "ABSolute"."""
    return "".join(c for c in node if not c.islower()), node.upper()
