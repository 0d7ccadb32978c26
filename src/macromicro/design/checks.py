"""Numbers that a design sheet can take."""

from __future__ import annotations

from numbers import Real
from typing import Any

from macromicro.errors import InputError

# Cubes and quotients of numbers within these neither overflow nor vanish.
LEAST, MOST = 1e-15, 1e15


def positive(where: str, value: Any, unit: str = "") -> float:
    """A number above zero, 1e-15 to 1e15. Numbers of numpy count, truth values do not.

    Parameters
    ----------
    where : str
        What it is, for the message.
    value : Any
        Anything.
    unit : str, optional
        Named in the message.

    Returns
    -------
    float
        The same as a plain float.

    Raises
    ------
    InputError
        Anything else.
    """
    known = isinstance(value, Real) and not isinstance(value, bool)
    if not known or not LEAST <= value <= MOST:
        raise InputError(where, value, _accepted(unit))
    return float(value)


def sheet(where: str, value: Any, kind: type) -> None:
    """Refuse what is not of a type; a plain tuple is no `Sensor`.

    Parameters
    ----------
    where : str
        What it is, for the message.
    value : Any
        Anything.
    kind : type
        A ``NamedTuple``, such as `Sensor`.

    Raises
    ------
    InputError
        Another type.
    """
    if not isinstance(value, kind):
        fields = ", ".join(getattr(kind, "_fields", ()))
        raise InputError(where, value, f"{kind.__name__}({fields})")


def _accepted(unit: str) -> str:
    return f"a number above 0{f' {unit}' if unit else ''} ({LEAST:g} to {MOST:g})"
