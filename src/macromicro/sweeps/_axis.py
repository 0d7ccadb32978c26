"""One parameter of a sweep: its levels or its range, in the stored unit."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.sampling import scale
from macromicro.schema.keys import only, unknown, whole
from macromicro.schema.par import Entry
from macromicro.schema.text import printable
from macromicro.uncertainty import ranges

SCALES = ("linear", "log")
MAX_LEVELS = 10_000  # the spec travels with every task
_KEYS = ("value", "values", "kind", "low", "high", "steps", "scale")


class Axis(NamedTuple):
    path: str  # dotted path of the parameter
    unit: str  # that it is stored in
    levels: tuple[float, ...] = ()  # the values that it takes, all of them; empty for a whole range
    low: float = math.nan  # ends of the range, both included
    high: float = math.nan  # NaN where there are levels
    scale: str = "linear"  # the range is even on it; "whole" is even over its whole numbers
    shown: str = ""  # unit that a person reads; "" for the stored one

    def at(self, share: Array) -> Array:
        if self.levels:
            row = (share * len(self.levels)).astype(np.int64)
            return np.asarray(self.levels)[np.minimum(row, len(self.levels) - 1)]
        if self.scale == "whole":
            values = self.low + np.floor(share * (self.high - self.low + 1.0))
        else:
            values = scale(share, self.low, self.high, log=self.scale == "log")
        return np.clip(values, self.low, self.high)


def read_axis(table: object, entry: Entry, where: str, *, grid: bool) -> Axis:
    par = entry.par
    if not entry.number:
        raise InputError(where, printable(entry.value), "a parameter that is one number")
    if not isinstance(table, dict):
        table = {"values" if isinstance(table, list) else "value": table}
    unknown(table, _KEYS, f"{where}.")
    given = [key for key in ("value", "values", "low") if key in table]
    if given != ["low"] and "high" in table:
        given.append("high")
    if len(given) != 1:
        found = f"{' and '.join(given)} are given" if given else "there is no range"
        raise ProblemError(where, found, "Give one of value, values, or low and high.")
    if given == ["value"]:
        only(table, ("value",), where)
        levels: tuple[float, ...] = (float(entry.read(table["value"], f"{where}.value")),)
        return Axis(entry.path, par.unit, levels, shown=par.shown)
    if given == ["values"]:
        only(table, ("values",), where)
        levels = _levels(table["values"], entry, f"{where}.values")
        return Axis(entry.path, par.unit, levels, shown=par.shown)
    return _range(table, entry, where, grid=grid)


def _levels(raw: object, entry: Entry, where: str) -> tuple[float, ...]:
    if not isinstance(raw, list) or not 1 <= len(raw) <= MAX_LEVELS:
        raise InputError(where, printable(raw), f"a list of 1 to {MAX_LEVELS} values")
    return tuple(float(entry.read(x, f"{where}, item {i}")) for i, x in enumerate(raw, 1))


def _ends(table: dict[str, Any], entry: Entry, where: str) -> tuple[float, float]:
    """The range of values; factors and shifts are of the value that the settings have."""
    kind, low, high = ranges.read_range(table, entry, f"{where}.")
    now = entry.value
    if kind == ranges.FACTOR:
        low, high = sorted((low * now, high * now))
        if low == high:
            raise ProblemError(where, "a factor of 0 is 0", "Give low and high as values.")
    elif kind == ranges.SHIFT:
        low, high = low + now, high + now
    for value in (low, high):
        entry.check(value, where)
    return low, high


def _range(table: dict[str, Any], entry: Entry, where: str, *, grid: bool) -> Axis:
    par = entry.par
    low, high = _ends(table, entry, where)
    scale = table.get("scale", "linear")
    if scale not in SCALES:
        raise InputError(f"{where}.scale", printable(scale), " or ".join(map(repr, SCALES)))
    if scale == "log" and low <= 0.0:
        raise InputError(f"{where}.low", printable(table["low"]), "above zero for scale 'log'")
    if not grid:
        only(table, ("low", "high", "kind", "scale"), where)
        if isinstance(entry.value, int):
            if scale == "log":
                accepted = "'linear', as the parameter is a whole number"
                raise InputError(f"{where}.scale", "log", accepted)
            scale = "whole"
        return Axis(entry.path, par.unit, (), low, high, scale, par.shown)
    steps = whole(table.get("steps"), 2, MAX_LEVELS, f"{where}.steps")
    spaced = np.geomspace if scale == "log" else np.linspace
    levels = tuple(spaced(low, high, steps).tolist())
    for level in levels if isinstance(entry.value, int) else ():
        if not level.is_integer():
            accepted = "steps that give whole numbers, or values"
            raise InputError(f"{where}.steps", steps, accepted)
    return Axis(entry.path, par.unit, levels, scale=scale, shown=par.shown)
