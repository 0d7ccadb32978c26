"""Uncertain parameters of a machine, from table.toml; uniform and independent."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from macromicro.errors import InputError
from macromicro.schema.keys import nearest, unknown
from macromicro.schema.par import NO_UNIT, Entry, entries
from macromicro.schema.text import printable, read_toml
from macromicro.settings import Settings
from macromicro.uncertainty import ranges


class Uncertain(NamedTuple):
    """An uncertain quantity from `low` to `high`."""

    name: str  # one word, unique in the table
    stage: str  # the stage, or the machine, that it belongs to
    parts: tuple[tuple[str, float], ...]  # dotted paths within the settings, each with its weight
    kind: str  # of `ranges.KINDS`; a shift is multiplied by the part's weight
    # low, high: the range, in `unit`
    low: float
    high: float
    unit: str  # of `low` and `high`; "" for a factor
    # meaning, source: for a person
    meaning: str
    source: str


def read_table(path: Path, settings: Any) -> tuple[Uncertain, ...]:
    """The rows of a table for the parameters of these settings."""
    file, known = printable(path, 300), {e.path: e for e in entries(settings)}
    rows = read_toml(path, "a table of uncertain quantities (.toml)").get("quantity")
    if not isinstance(rows, list) or not rows:
        raise InputError(f"{file}, quantity", printable(rows), "one table [[quantity]] or more")
    return tuple(_row(given, known, f"{file}, quantity {n}") for n, given in enumerate(rows, 1))


def _row(given: Any, known: dict[str, Entry], row: str) -> Uncertain:
    if not isinstance(given, dict):
        raise InputError(row, printable(given), "a table [[quantity]]")
    where = f"{row}, "

    def text(key: str, default: str | None = None) -> str:
        found = given.get(key, default)
        if not isinstance(found, str):
            raise InputError(f"{where}{key}", printable(found), "text")
        return found

    def listed(key: str, kind: Any, accepted: str, default: list[Any] | None = None) -> list[Any]:
        found = given.get(key, default)
        good = isinstance(found, list) and all(isinstance(item, kind) for item in found)
        if not good or not found:
            raise InputError(f"{where}{key}", printable(found), accepted)
        return list(found)

    unknown(given, _KEYS, where)
    paths = listed("paths", str, "a list of paths in the settings")
    weights = listed("weights", int | float, "a number for each path", [1.0] * len(paths))
    if len(weights) != len(paths):
        raise InputError(f"{where}weights", len(weights), f"{len(paths)}, one for each path")
    for path in paths:
        if path not in known or not known[path].number:
            numbers = [name for name, entry in known.items() if entry.number]
            raise InputError(f"{where}paths", printable(path), nearest(path, numbers))
    first = known[paths[0]]
    kind, low, high = ranges.read_range(given, first, where)
    unit = ranges.amount(first, kind).par.unit
    return Uncertain(
        text("name"),
        text("stage", ""),
        tuple(zip(paths, weights, strict=True)),
        kind,
        low,
        high,
        "" if unit in NO_UNIT else unit,
        text("meaning"),
        text("source", ""),
    )


_KEYS = ("name", "stage", "paths", "weights", "kind", "low", "high", "meaning", "source")
UNCERTAIN: tuple[Uncertain, ...] = read_table(Path(__file__).with_name("table.toml"), Settings())
# In what a bench may differ from every model: none of it at the settings' defaults.
VARIANTS: tuple[Uncertain, ...] = read_table(Path(__file__).with_name("variants.toml"), Settings())


def of_stage(stage: str) -> tuple[Uncertain, ...]:
    """Rows of the table for a stage."""
    return tuple(each for each in UNCERTAIN if each.stage == stage)
