"""Uncertain parameters of a machine, from table.toml; uniform and independent."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from macromicro.errors import InputError, ProblemError
from macromicro.schema.text import printable, read_toml

FACTOR, SHIFT, VALUE = "factor", "shift", "value"


class Uncertain(NamedTuple):
    """An uncertain quantity from `low` to `high`."""

    name: str  # one word, unique in the table
    stage: str  # the stage, or the machine, that it belongs to
    parts: tuple[tuple[str, float], ...]  # dotted paths within the settings, each with its weight
    # an amount multiplies what the settings say at every path, is added to it, times the part's
    # weight, or takes its place
    kind: str
    # low, high: the range, in `unit`
    low: float
    high: float
    unit: str  # of `low` and `high`; "" for a factor
    # meaning, source: for a person
    meaning: str
    source: str


def read(path: Path) -> tuple[Uncertain, ...]:
    file = printable(path, 300)
    rows = read_toml(path, "a table of uncertain quantities (.toml)").get("quantity")
    if not isinstance(rows, list) or not rows:
        raise InputError(f"{file}, quantity", printable(rows), "one table [[quantity]] or more")
    return tuple(_row(told, f"{file}, quantity {n}") for n, told in enumerate(rows, 1))


def _row(told: Any, where: str) -> Uncertain:
    if not isinstance(told, dict):
        raise InputError(where, printable(told), "a table [[quantity]]")

    def text(key: str, default: str | None = None) -> str:
        found = told.get(key, default)
        if not isinstance(found, str):
            raise InputError(f"{where}, {key}", printable(found), "text")
        return found

    def listed(key: str, kind: Any, accepted: str, default: list[Any] | None = None) -> list[Any]:
        found = told.get(key, default)
        good = isinstance(found, list) and all(isinstance(item, kind) for item in found)
        if not good or not found:
            raise InputError(f"{where}, {key}", printable(found), accepted)
        return list(found)

    unknown = [key for key in told if key not in _KEYS]
    if unknown:
        raise ProblemError(
            f"{where}, {unknown[0]}", "unknown key", f"Use one of {', '.join(_KEYS)}."
        )
    paths = listed("paths", str, "a list of paths in the settings")
    weights = listed("weights", int | float, "a number for each path", [1.0] * len(paths))
    span = listed("range", int | float, "the lower and the upper limit, two numbers")
    if len(weights) != len(paths):
        raise InputError(f"{where}, weights", len(weights), f"{len(paths)}, one for each path")
    if len(span) != 2 or not span[0] < span[1]:
        raise InputError(
            f"{where}, range", printable(span), "the lower and the upper limit, rising"
        )
    kind = text("kind")
    if kind not in (FACTOR, SHIFT, VALUE):
        raise InputError(f"{where}, kind", printable(kind), f"{FACTOR}, {SHIFT} or {VALUE}")
    return Uncertain(
        text("name"),
        text("stage", ""),
        tuple(zip(paths, weights, strict=True)),
        kind,
        float(span[0]),
        float(span[1]),
        text("unit", ""),
        text("meaning"),
        text("source", ""),
    )


_KEYS = ("name", "stage", "paths", "weights", "kind", "range", "unit", "meaning", "source")
UNCERTAIN: tuple[Uncertain, ...] = read(Path(__file__).with_name("table.toml"))
# In what a bench may differ from every model: none of it at the settings' defaults.
VARIANTS: tuple[Uncertain, ...] = read(Path(__file__).with_name("variants.toml"))


def of_stage(stage: str) -> tuple[Uncertain, ...]:
    """Rows of the table for a stage."""
    return tuple(each for each in UNCERTAIN if each.stage == stage)
