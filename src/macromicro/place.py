"""What the places of a stage are counted in: lengths, or angles of a stage that turns.

A stage that turns obeys the equations of one that slides, with rad for m, N*m for N and kg*m^2 for
kg. So every kernel, rule and law is written once, in the units of a slide; a `Place` says how a
machine's quantities are called and scaled for people.
"""

from __future__ import annotations

import re
from dataclasses import replace
from functools import lru_cache
from typing import Annotated, Any, NamedTuple, TypeVar, get_type_hints

from macromicro.schema.par import Par
from macromicro.units import remedy, shown, size

Set = TypeVar("Set")

_NAME = re.compile(r"[A-Za-z]+")
# What stands for a unit of a slide where a stage turns.
_TURNED = {
    "m": "rad",
    "mm": "deg",
    "um": "mdeg",
    "nm": "udeg",
    "N": "N*m",
    "mN": "mN*m",
    "kg": "kg*m^2",
}


class Place(NamedTuple):
    """How the places of a stage, and what follows from them, are called and shown.

    Attributes
    ----------
    base : str
        Unit that kernels, laws and settings count in.
    unit : str
        Unit that people read: of positions in recordings, reports and on the page.
    fine, finest : str
        A thousandth and a millionth of it: of errors.
    per : float
        Units in one base unit.
    turns : bool
        Whether it turns, rather than slides.
    """

    base: str
    unit: str
    fine: str
    finest: str
    per: float
    turns: bool = False

    def named(self, unit: str) -> str:
        """A unit of a slide, as this stage has it.

        Parameters
        ----------
        unit : str
            Such as "N*s/m".

        Returns
        -------
        str
            Such as "N*m*s/rad".
        """
        if not self.turns:
            return unit
        return _NAME.sub(lambda found: _TURNED.get(found[0], found[0]), unit)

    def column(self, quantity: Any) -> Any:
        """What is recorded of a quantity of a slide, as this stage has it.

        Parameters
        ----------
        quantity : Any
            A `columns.Quantity`.

        Returns
        -------
        Any
            With its unit and scale.
        """
        unit = self.named(quantity.unit)
        if unit == quantity.unit:
            return quantity
        scale = quantity.scale * size(quantity.unit) / size(unit)
        return quantity._replace(unit=unit, scale=scale)

    def told(self, value: float, unit: str = "m", digits: int = 6) -> str:
        """A value as a person reads it.

        Parameters
        ----------
        value : float
            In base units.
        unit : str, optional
            Base unit of the quantity on a slide: "m", "m/s", "m/s^2", "N", "kg".
        digits : int, optional
            Largest number of significant digits.

        Returns
        -------
        str
            A place of a slide in mm, of a stage that turns all angles in degrees; else in base
            units.
        """
        base = self.named(unit)
        if unit == "m":
            return shown(value, base, self.unit, digits)
        return shown(value, base, base.replace("rad", "deg"), digits)

    @property
    def smallest(self) -> float:
        """Below a tolerance of this, in base units, errors are told in `finest`."""
        return 1.0 / self.fines

    @property
    def fines(self) -> float:
        """Units of an error in one base unit."""
        return 1e3 * self.per

    @property
    def accepted(self) -> str:
        """What a place may be written in, for messages."""
        return remedy(self.unit)


LENGTH = Place("m", "mm", "um", "nm", 1e3)
ANGLE = Place("rad", "deg", "mdeg", "udeg", 1.0 / size("deg"), True)
PLACES = (LENGTH, ANGLE)


def turned(made: type[Set]) -> type[Set]:
    """Decorator of a subclass of a parameter set, for a stage that turns: the same in angles.

    Parameters
    ----------
    made : type[Set]
        A subclass, without fields of its own, of a set that is annotated in units of a slide.

    Returns
    -------
    type[Set]
        The subclass, its annotations in units of a stage that turns.
    """
    notes: dict[str, Any] = {}
    for name, hint in get_type_hints(made, include_extras=True).items():
        for note in getattr(hint, "__metadata__", ()):
            if isinstance(note, Par) and ANGLE.named(note.unit) != note.unit:
                par = replace(note, unit=ANGLE.named(note.unit), shown=_read_in(note))
                notes[name] = Annotated[hint.__origin__, par]
    made.__annotations__ = notes
    return made


def _read_in(note: Par) -> str:
    """Unit that people read such a parameter in: degrees where it is an angle or a speed."""
    base = ANGLE.named(note.unit)
    first = base.partition("/")[0]
    return ANGLE.named(note.shown) if note.shown else base.replace("rad", "deg") * (first == "rad")


@lru_cache(maxsize=256)
def _of(kind: Any) -> Place:
    hints = get_type_hints(kind, include_extras=True)
    for note in getattr(hints["high"], "__metadata__", ()):
        for place in PLACES:
            if isinstance(note, Par) and note.unit == place.base:
                return place
    return LENGTH


def of(settings: Any) -> Place:
    """What the places of a machine of one stage are counted in.

    Parameters
    ----------
    settings : Any
        Of the machine: the unit of `travel.high` says it.

    Returns
    -------
    Place
        `LENGTH` or `ANGLE`.
    """
    kind: Any = type(settings.travel)
    return _of(kind)
