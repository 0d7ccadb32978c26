"""Checks of a design sheet's arguments, and the data of the thesis' sheets."""

from __future__ import annotations

import tomllib
from numbers import Real
from pathlib import Path
from typing import Any

from macromicro.errors import InputError

DATA: dict[str, Any] = tomllib.loads(
    Path(__file__).with_name("sheets.toml").read_text(encoding="utf-8")
)
# Cubes and quotients of numbers within these neither overflow nor vanish.
LEAST, MOST = 1e-15, 1e15


def positive(where: str, value: Any, unit: str = "") -> float:
    """A number from 1e-15 to 1e15; numpy numbers count, booleans do not."""
    known = isinstance(value, Real) and not isinstance(value, bool)
    if not known or not LEAST <= value <= MOST:
        raise InputError(where, value, _accepted_text(unit))
    return float(value)


def sheet(where: str, value: Any, kind: type) -> None:
    """Refuse an argument of another type; a plain tuple is not a `Sensor`."""
    if not isinstance(value, kind):
        fields = ", ".join(getattr(kind, "_fields", ()))
        raise InputError(where, value, f"{kind.__name__}({fields})")


def _accepted_text(unit: str) -> str:
    return f"a number above 0{f' {unit}' if unit else ''} ({LEAST:g} to {MOST:g})"
