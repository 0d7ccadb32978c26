"""Numbers that a design sheet can take."""

from __future__ import annotations

from numbers import Integral, Real
from typing import Any

from macromicro.errors import InputError

# Cubes and quotients of numbers within these neither overflow nor vanish.
LEAST, MOST = 1e-15, 1e15


def positive(where: str, value: Any, unit: str = "") -> float:
    """`value`, if it is a number above zero, 1e-15 to 1e15; otherwise raises `InputError`.

    Numbers of numpy count as numbers, truth values do not.
    """
    known = isinstance(value, Real) and not isinstance(value, bool)
    if not known or not LEAST <= value <= MOST:
        raise InputError(where, value, _accepted(unit))
    return float(value)


def whole(where: str, value: Any, least: int, most: int) -> int:
    """`value`, if it is a whole number from `least` to `most`; otherwise raises `InputError`."""
    known = isinstance(value, Integral) and not isinstance(value, bool)
    if not known or not least <= value <= most:
        raise InputError(where, value, f"a whole number from {least} to {most}")
    return int(value)


def sheet(where: str, value: Any, kind: type) -> None:
    """InputError unless `value` is a `kind`, such as a `Sensor`; a plain tuple is none."""
    if not isinstance(value, kind):
        fields = ", ".join(getattr(kind, "_fields", ()))
        raise InputError(where, value, f"{kind.__name__}({fields})")


def _accepted(unit: str) -> str:
    return f"a number above 0{f' {unit}' if unit else ''} ({LEAST:g} to {MOST:g})"
