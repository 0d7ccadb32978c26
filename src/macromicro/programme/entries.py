"""Entries of a programme's tables: targets and times, as texts with units."""

from __future__ import annotations

from typing import Any

from macromicro.errors import InputError, ProblemError
from macromicro.programme.moves import MAX_HOLD, MAX_TITLE, MICRO, TO, Limits, check_target
from macromicro.schema.keys import show_value
from macromicro.schema.text import printable
from macromicro.units import measured, quantity

_TARGETS = "text with a unit such as '1.5 mm', or a list of such texts"


def title(raw: dict[str, Any], file: str) -> str:
    """The title of a programme, or ""."""
    value = raw.get("title", "")
    if not isinstance(value, str) or not value.isprintable() or len(value) > MAX_TITLE:
        accepted = f"one line of text of at most {MAX_TITLE} characters"
        raise InputError(f"{file}, title", printable(value), accepted)
    return value


def tables(raw: dict[str, Any], key: str, file: str, accepted: str) -> list[dict[str, Any]]:
    """The tables of a key, one or more."""
    value = raw.get(key)
    if isinstance(value, list) and value and all(isinstance(each, dict) for each in value):
        return value
    raise InputError(f"{file}, {key}", show_value(value), accepted)


def texts(table: dict[str, Any], key: str, where: str) -> list[str]:
    value = table.get(key, [])
    found = value if isinstance(value, list) else [value]
    if not all(isinstance(each, str) for each in found):
        raise InputError(f"{where}, {key}", printable(value, 40), _TARGETS)
    return found


def text(table: dict[str, Any], key: str, where: str, such: str = "2 s") -> str:
    value = table.get(key)
    if not isinstance(value, str):
        missing = "missing" if value is None else printable(value, 40)
        raise InputError(f"{where}, {key}", missing, f"text with a unit such as '{such}'")
    return value


def hold(written: str, where: str, *, zero: bool = False) -> float:
    value = quantity(written, "s", where)
    if not (0.0 < value <= MAX_HOLD or (zero and value == 0.0)):
        raise InputError(where, written, "0 s to 1 h" if zero else "more than 0 s, at most 1 h")
    return value


def rest(table: dict[str, Any], default: str, where: str) -> float:
    """The hold of a move that may have none, s."""
    return hold(text({"hold": default} | table, "hold", where), f"{where}, hold", zero=True)


def no_target(limits: Limits, where: str) -> InputError:
    """A table that says of no stage where it goes."""
    if limits.alone:
        return InputError(f"{where}, {TO}", "missing", _TARGETS)
    return ProblemError(where, "neither macro nor micro", "Give exactly one of them.")


def target(written: str, stage: int, limits: Limits, where: str) -> float:
    base = limits.place.base
    if stage == MICRO:
        return check_target(quantity(written, base, where), stage, limits, where, written)
    try:
        value, unit = measured(written, (base, "counts"), where)
    except InputError as error:
        why = "; this stage is rotary" if limits.place.turns else ""
        raise InputError(where, error.value, f"{error.accepted}{why}") from None
    counts = value * limits.counts_per_metre if unit == base else value
    return check_target(counts, stage, limits, where, written)
