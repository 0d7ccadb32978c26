"""The table of what is not known exactly about a machine, read from table.toml beside this file.

Within its range each quantity is taken as uniformly distributed and independent of the others:
nothing but the range is known of it. `robust` draws all of them; `tune --robust` those of the
stage that it tunes, on the bench or on the model that was identified from it.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any, NamedTuple

FACTOR, SHIFT, VALUE = "factor", "shift", "value"
# What the macro-stage's model (4.2)-(4.5) has of it: gain and pole of (4.2), the dead zone.
GAIN, POLE, WIDTH = "gain", "pole", "width"


class Uncertain(NamedTuple):
    """One quantity that is uncertain, from `low` to `high`.

    Attributes
    ----------
    name : str
        One word, unique in the table.
    stage : {"macro", "micro", "axis", "piezo", "wire"}
        The stage, or the machine, that it belongs to.
    parts : tuple of (str, float)
        Dotted paths within the settings, each with its weight.
    kind : {"factor", "shift", "value"}
        An amount multiplies what the settings say at every path, is added to it, times the
        part's weight, or takes its place.
    low, high : float
        The range, in `unit`.
    unit : str
        Of `low` and `high`; "" for a factor.
    meaning, source : str
        For a person.
    model : tuple of (str, float)
        What of the macro-stage's model goes with it: `GAIN`, `POLE` or `WIDTH`, each
        multiplied by the amount to the power that is given. Empty for what the model has not.
    """

    name: str
    stage: str
    parts: tuple[tuple[str, float], ...]
    kind: str
    low: float
    high: float
    unit: str
    meaning: str
    source: str
    model: tuple[tuple[str, float], ...] = ()


def _row(told: dict[str, Any]) -> Uncertain:
    """A row, of its table in the file."""
    paths, (low, high) = told["paths"], told["range"]
    return Uncertain(
        told["name"],
        told["stage"],
        tuple(zip(paths, told.get("weights", [1.0] * len(paths)), strict=True)),
        told["kind"],
        low,
        high,
        told.get("unit", ""),
        told["meaning"],
        told["source"],
        tuple(told.get("model", {}).items()),
    )


def _read(name: str) -> tuple[Uncertain, ...]:
    """The rows of a file beside this one."""
    text = Path(__file__).with_name(name).read_text(encoding="utf-8")
    return tuple(map(_row, tomllib.loads(text)["quantity"]))


UNCERTAIN: tuple[Uncertain, ...] = _read("table.toml")
# Of machines of one stage, by name.
AXIS: tuple[Uncertain, ...] = _read("axis.toml")
PIEZO: tuple[Uncertain, ...] = _read("piezo.toml")
WIRE: tuple[Uncertain, ...] = _read("wire.toml")


def of_stage(stage: str) -> tuple[Uncertain, ...]:
    """Give the rows of the table that belong to a stage.

    Parameters
    ----------
    stage : {"macro", "micro"}
        Which one.

    Returns
    -------
    tuple of Uncertain
        In the table's order.
    """
    return tuple(each for each in UNCERTAIN if each.stage == stage)
