"""Turns a verb's values into an order, by the table of requests."""

from __future__ import annotations

from typing import Any

from macromicro.errors import InputError
from macromicro.place import LENGTH, PLACES, Place
from macromicro.schema.par import finite
from macromicro.serve.requests import KINDS, POINTS, Field
from macromicro.units import quantity, remedy


def place_of(about: dict[str, Any]) -> Place:
    base = about["limits"]["base"]
    return next((place for place in PLACES if place.base == base), LENGTH)


def checked(name: str, values: tuple[Any, ...], place: Place) -> tuple[Any, ...]:
    """The values of a request in base units."""
    return tuple(
        _value(f"{name}, {field.name}", field, value, place)
        for field, value in zip((KINDS | POINTS)[name].fields, values, strict=False)
    )


def _value(where: str, field: Field, value: Any, place: Place) -> Any:
    if field.choices:
        if value not in field.choices:
            raise InputError(where, value, ", ".join(field.choices))
        return value
    if not field.unit:
        return bool(value)
    unit = field.unit if field.unit == "counts" else place.named(field.unit)
    if isinstance(value, str) and unit != "counts":
        read_in = place.unit if field.unit == "m" else ""
        return quantity(value, unit, where, read_in)
    if not finite(value):
        accepted = "a whole number" if unit == "counts" else f"a number in {unit}, {remedy(unit)}"
        raise InputError(where, value, accepted)
    return float(value)


def order(name: str, values: tuple[Any, ...], place: Place) -> dict[str, Any]:
    fields = (KINDS | POINTS)[name].fields if values else ()
    found = {field.key: value for field, value in zip(fields, values, strict=False)}
    return found | ({"unit": place.base} if any(f.unit == "m" for f in fields) else {})
