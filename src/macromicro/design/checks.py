"""Numbers that a design sheet can take."""

from __future__ import annotations

from macromicro.errors import InputError

# Cubes and quotients of numbers within these neither overflow nor vanish.
LEAST, MOST = 1e-15, 1e15


def positive(where: str, value: float, unit: str = "") -> float:
    """`value`, if it is a number above zero, 1e-15 to 1e15; otherwise raises `InputError`."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(where, value, _accepted(unit))
    if not LEAST <= value <= MOST:
        raise InputError(where, value, _accepted(unit))
    return float(value)


def _accepted(unit: str) -> str:
    return f"a number above 0{f' {unit}' if unit else ''} ({LEAST:g} to {MOST:g})"
