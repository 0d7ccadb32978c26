"""Turns a verb's values into an order, by the table of requests."""

from __future__ import annotations

from typing import Any

from macromicro.errors import InputError
from macromicro.place import LENGTH, PLACES, Place
from macromicro.schema.par import finite
from macromicro.serve.requests import Field, RequestType
from macromicro.units import quantity, remedy


def place_of(about: dict[str, Any]) -> Place:
    """What a machine's places are counted in; m as long as nothing is known of it."""
    base = about["limits"]["base"] if about else ""
    return next((place for place in PLACES if place.base == base), LENGTH)


def axes_of(about: dict[str, Any]) -> tuple[str, ...]:
    return tuple(axis["name"] for axis in about["axes"])


def check(kind: RequestType, values: tuple[Any, ...], place: Place) -> tuple[Any, ...]:
    """The values of a request in base units; None of a coordinate that is left out."""
    if kind.is_point:
        values = _point(kind, *values)
    return tuple(
        None if value is None else _value(f"{kind.name}, {field.name}", field, value, place)
        for field, value in zip(kind.fields, values, strict=False)
    )


def _point(kind: RequestType, *values: Any) -> tuple[Any, ...]:
    """Coordinates in their order, of which the last value names further ones."""
    *given, named = values
    names = [field.name for field in kind.fields]
    found = dict(zip(names, given, strict=False))
    twice = [name for name in named if name in found or name not in names]
    if twice or len(given) > len(names) or not (named or len(given) == len(names)):
        value = twice[0] if twice else f"{len(given)} coordinates"
        raise InputError(kind.name, value, f"{', '.join(names)}, each once")
    return tuple((found | named).get(name) for name in names)


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


def order(kind: RequestType, values: tuple[Any, ...], place: Place) -> dict[str, Any]:
    fields = kind.fields if values else ()
    each = zip(fields, values, strict=False)
    found = {field.key: value for field, value in each if value is not None}
    return found | ({"unit": place.base} if any(f.unit == "m" for f in fields) else {})
