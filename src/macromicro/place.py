"""Units of a stage's positions: lengths, or angles of a rotary stage (rad for m, N*m for N)."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Annotated, Any, NamedTuple, TypeVar, get_type_hints

from macromicro.schema.par import Par
from macromicro.units import remedy, shown, size

Set = TypeVar("Set")

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


def _rename(unit: str, marks: str = "/*() ") -> str:
    """A unit of a slide, factor by factor, as that of a stage that turns."""
    if not marks:
        return _TURNED.get(unit, unit)
    return marks[0].join(_rename(part, marks[1:]) for part in unit.split(marks[0]))


class Place(NamedTuple):
    """Names and scales of a stage's position quantities."""

    base: str  # unit that kernels, laws and settings count in
    unit: str  # unit that people read: of positions in recordings, reports and on the page
    # fine, finest: A thousandth and a millionth of it: of errors
    fine: str
    finest: str
    per: float  # units in one base unit
    turns: bool = False  # whether it turns, rather than slides

    def named(self, unit: str) -> str:
        """The unit of a linear stage, as of this one."""
        return _rename(unit) if self.turns else unit

    def column(self, quantity: Any) -> Any:
        """The `Quantity` of a linear stage, as of this one."""
        unit = self.named(quantity.unit)
        if unit == quantity.unit:
            return quantity
        scale = quantity.scale * size(quantity.unit) / size(unit)
        return quantity._replace(unit=unit, scale=scale)

    def told(self, value: float, unit: str = "m", digits: int = 6) -> str:
        """A value with its unit."""
        base = self.named(unit)
        if unit == "m":
            return shown(value, base, self.unit, digits)
        return shown(value, base, base.replace("rad", "deg"), digits)

    @property
    def smallest(self) -> float:
        """Tolerance in base units below which errors are shown in `finest`."""
        return 1.0 / self.fines

    @property
    def fines(self) -> float:
        """Error units in one base unit."""
        return 1e3 * self.per

    @property
    def accepted(self) -> str:
        """Accepted spellings of a position, for messages."""
        return remedy(self.unit)


LENGTH = Place("m", "mm", "um", "nm", 1e3)
ANGLE = Place("rad", "deg", "mdeg", "udeg", 1.0 / size("deg"), True)
PLACES = (LENGTH, ANGLE)


def as_rotary(made: type[Set]) -> type[Set]:
    """Decorator of a parameter set's subclass for a rotary stage."""
    notes: dict[str, Any] = {}
    for name, hint in get_type_hints(made, include_extras=True).items():
        for note in getattr(hint, "__metadata__", ()):
            if isinstance(note, Par) and ANGLE.named(note.unit) != note.unit:
                par = replace(note, unit=ANGLE.named(note.unit), shown=_read_in(note))
                notes[name] = Annotated[hint.__origin__, par]
    made.__annotations__ = notes
    return made


def plain(values: Any) -> Any:
    """The numbers of a set of `turned`, or of any other, in the class of the linear stage.

    Both kinds of stage then share their machine code; and numba, which takes tuples of different
    classes with the same fields for one type until it has looked twice, looks once.
    """
    base: Any = type(values).__base__
    return base._make(values) if issubclass(base, tuple) and base is not tuple else values


def _read_in(note: Par) -> str:
    """Display unit of such a parameter."""
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
    kind: Any = type(settings.travel)
    return _of(kind)
