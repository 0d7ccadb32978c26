"""The range of a varied parameter, as sweep files and tables of uncertainty give it."""

from __future__ import annotations

from typing import Any

from macromicro.errors import InputError, ProblemError
from macromicro.schema.par import Entry, Par
from macromicro.schema.text import printable
from macromicro.units import remedy

# What low and high mean: they take the place of a value, multiply it, or are added to it.
VALUE, FACTOR, SHIFT = "value", "factor", "shift"
KINDS = (VALUE, FACTOR, SHIFT)
_DIFFERENCES = {"degC": "K"}  # units of a shift where they are others


def amount(entry: Entry, kind: str) -> Entry:
    """What `low` and `high` are read as: the parameter, or a factor or a shift of it."""
    if kind == VALUE:
        return entry
    unit = "" if kind == FACTOR else _DIFFERENCES.get(entry.par.unit, entry.par.unit)
    return Entry(entry.path, Par(unit, kind), 1.0)


def read_range(table: dict[str, Any], entry: Entry, where: str) -> tuple[str, float, float]:
    """The keys kind, low and high, in the stored unit; `where` ends before a key's name."""
    kind = table.get("kind", VALUE)
    if kind not in KINDS:
        raise InputError(f"{where}kind", printable(kind), f"one of {', '.join(KINDS)}")
    what, ends = amount(entry, kind), []
    for key in ("low", "high"):
        if key not in table:
            raise ProblemError(f"{where}{key}", "missing", f"Give {remedy(what.par.read_in)}.")
        ends.append(float(what.read(table[key], f"{where}{key}")))
    low, high = ends
    if not low < high:
        above = f"more than low ({what.par.spoken(low)})"
        raise InputError(f"{where}high", printable(table["high"]), above)
    return kind, low, high
