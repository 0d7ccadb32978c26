"""One parameter of a sweep: the levels or the range that it takes, in the unit it is stored in."""

from __future__ import annotations

import difflib
import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.errors import InputError
from macromicro.parameters import Entry, Par
from macromicro.textfile import printable
from macromicro.units import quantity, remedy, shown

Array = npt.NDArray[np.float64]

SCALES = ("linear", "log")
MAX_LEVELS = 10_000  # the spec travels with every task
_KEYS = ("value", "values", "low", "high", "steps", "scale")


class Axis(NamedTuple):
    """The parameter at the dotted `path`, stored in `unit`.

    `levels`: the values that it takes, all of them; empty for the whole range from `low` to
    `high`, both included, even on the `scale`; "whole" is even over its whole numbers.
    """

    path: str
    unit: str
    levels: tuple[float, ...] = ()
    low: float = math.nan
    high: float = math.nan
    scale: str = "linear"

    def at(self, share: Array) -> Array:
        """The values at these shares, 0 to below 1, of the range, or of the levels' list."""
        if self.levels:
            row = (share * len(self.levels)).astype(np.int64)
            return np.asarray(self.levels)[np.minimum(row, len(self.levels) - 1)]
        if self.scale == "whole":
            values = self.low + np.floor(share * (self.high - self.low + 1.0))
        elif self.scale == "log":
            low, high = math.log(self.low), math.log(self.high)
            values = np.exp(low + share * (high - low))
        else:
            values = self.low + share * (self.high - self.low)
        return np.clip(values, self.low, self.high)


def read(table: object, entry: Entry, where: str, *, grid: bool) -> Axis:
    """The axis that a spec's table says for the parameter `entry`.

    `grid`: a range needs `steps`, else it must have none. Raises `InputError` with `where`
    and the key: what is unknown, missing, without its unit or out of the parameter's bounds.
    """
    par = entry.par
    if isinstance(entry.value, bool | str | tuple):
        raise InputError(where, printable(entry.value), "a parameter that is one number")
    if not isinstance(table, dict):
        table = {"values" if isinstance(table, list) else "value": table}
    unknown_key(table, _KEYS, f"{where}.")
    given = [key for key in ("value", "values", "low") if key in table]
    if given != ["low"] and "high" in table:
        given.append("high")
    if len(given) != 1:
        accepted = "one of value, values, or low and high"
        raise InputError(where, " and ".join(given) or "nothing", accepted)
    if given == ["value"]:
        only(table, ("value",), where)
        return Axis(entry.path, par.unit, (_number(table["value"], entry, f"{where}.value"),))
    if given == ["values"]:
        only(table, ("values",), where)
        return Axis(entry.path, par.unit, _levels(table["values"], entry, f"{where}.values"))
    return _range(table, entry, where, grid=grid)


def _levels(raw: object, entry: Entry, where: str) -> tuple[float, ...]:
    if not isinstance(raw, list) or not 1 <= len(raw) <= MAX_LEVELS:
        raise InputError(where, printable(raw), f"a list of 1 to {MAX_LEVELS} values")
    return tuple(_number(x, entry, f"{where}, item {i}") for i, x in enumerate(raw, 1))


def _range(table: dict[str, Any], entry: Entry, where: str, *, grid: bool) -> Axis:
    ends = {}
    for key in ("low", "high"):
        if key not in table:
            raise InputError(f"{where}.{key}", "nothing", remedy(entry.par.unit))
        ends[key] = _number(table[key], entry, f"{where}.{key}")
    low, high = ends["low"], ends["high"]
    if not low < high:
        above = f"more than low ({shown(low, entry.par.unit, entry.par.shown, 6)})"
        raise InputError(f"{where}.high", printable(table["high"]), above)
    scale = table.get("scale", "linear")
    if scale not in SCALES:
        raise InputError(f"{where}.scale", printable(scale), " or ".join(map(repr, SCALES)))
    if scale == "log" and low <= 0.0:
        raise InputError(f"{where}.low", printable(table["low"]), "above zero for scale 'log'")
    if not grid:
        only(table, ("low", "high", "scale"), where)
        if isinstance(entry.value, int):
            if scale == "log":
                accepted = "'linear': this parameter takes whole numbers"
                raise InputError(f"{where}.scale", "log", accepted)
            scale = "whole"
        return Axis(entry.path, entry.par.unit, (), low, high, scale)
    steps = whole(table.get("steps"), 2, MAX_LEVELS, f"{where}.steps")
    spaced = np.geomspace if scale == "log" else np.linspace
    levels = tuple(spaced(low, high, steps).tolist())
    for level in levels if isinstance(entry.value, int) else ():
        if not level.is_integer():
            accepted = "steps that give whole numbers, or values"
            raise InputError(f"{where}.steps", steps, accepted)
    return Axis(entry.path, entry.par.unit, levels)


def _number(raw: object, entry: Entry, where: str) -> float:
    par = entry.par
    if isinstance(raw, bool) or not isinstance(raw, int | float | str):
        raise InputError(where, printable(raw), remedy(par.unit))
    value = quantity(raw if isinstance(raw, str) else printable(raw), par.unit, where)
    if isinstance(entry.value, int) and not value.is_integer():
        raise InputError(where, printable(raw), "a whole number")
    if not par.lo <= value <= par.hi or (par.positive and value <= 0.0):
        raise InputError(where, printable(raw), _bounds(par))
    return value


def _bounds(par: Par) -> str:
    low, high = (shown(x, par.unit, par.shown, 10) for x in (par.lo, par.hi))
    words = ["above zero"] if par.positive and par.lo <= 0.0 else []
    if not words and par.lo > -math.inf:
        words.append(f"at least {low}")
    if par.hi < math.inf:
        words.append(f"at most {high}")
    return " and ".join(words)


def whole(raw: object, low: int, high: int, where: str) -> int:
    """The whole number `raw`; `InputError` for anything else and beyond `low` to `high`."""
    if isinstance(raw, bool) or not isinstance(raw, int) or not low <= raw <= high:
        found = "nothing" if raw is None else printable(raw)
        raise InputError(where, found, f"a whole number from {low} to {high}")
    return raw


def only(table: dict[str, Any], keys: tuple[str, ...], where: str) -> None:
    """InputError for the first key of `table` that is none of `keys`, which are known ones."""
    for key, value in table.items():
        if key not in keys:
            accepted = f"nothing beside {', '.join(keys)} here"
            raise InputError(f"{where}.{printable(key)}", printable(value), accepted)


def unknown_key(table: dict[str, Any], keys: tuple[str, ...], prefix: str) -> None:
    """InputError for the first key of `table` that is none of `keys`, with the nearest."""
    for key in table:
        if key not in keys:
            raise InputError(f"{prefix}{printable(key)}", "unknown key", nearest(key, keys))


def nearest(name: str, known: tuple[str, ...], hint: str = "") -> str:
    """What is accepted instead of `name`: the most alike of `known`, or all if they are few."""
    near = difflib.get_close_matches(name, known, 3, 0.6)
    if not near:  # the right name in a wrong table, or in none
        last = name.rpartition(".")[2]
        near = [k for k in known if last and k.rpartition(".")[2] == last][:3]
    if near:
        return f"a known one, such as {' or '.join(near)}{hint}"
    return f"one of {', '.join(known)}" if len(known) <= 12 else f"a known one{hint}"
