"""What an identification gives a person: lines with uncertainties, pictures, a model file."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

import macromicro

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RESULT, MODEL = "result.json", "model.toml"


class Line(NamedTuple):
    """One quantity: `error` is its standard error, NaN where there is none."""

    name: str
    value: float
    error: float = math.nan
    unit: str = ""
    note: str = ""


@dataclass(frozen=True)
class Result:
    """What one identification found.

    `remarks`: fit and whatever else fits no line, as (name, text); `data`: more for
    result.json; `model`: the text of model.toml; `draw` gives the figures by file name
    without suffix; `files`: further files, by name what writes them.
    """

    kind: str
    title: str
    lines: list[Line]
    remarks: list[tuple[str, str]]
    model: str
    draw: Callable[[], dict[str, Figure]]
    data: dict[str, Any] = field(default_factory=dict)
    files: dict[str, Callable[[Path], None]] = field(default_factory=dict)


def as_json(result: Result, files: list[str], warnings: list[str]) -> str:
    """Everything but the pictures; NaN and infinity as null."""
    content = {
        "kind": result.kind,
        "title": result.title,
        "files": files,
        "values": [line._asdict() for line in result.lines],
        "remarks": dict(result.remarks),
        "data": result.data,
        "warnings": warnings,
        "version": macromicro.__version__,
    }
    return json.dumps(_plain(content), indent=2, allow_nan=False) + "\n"


def _plain(value: Any) -> Any:
    """`value` with arrays as lists and numbers as JSON has them."""
    if isinstance(value, dict):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [_plain(v) for v in value]
    if isinstance(value, bool | np.bool_):
        return bool(value)
    if isinstance(value, int | np.integer):
        return int(value)
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    return value


def rounded(value: float, error: float = math.nan) -> tuple[str, str]:
    """Value and error as text: the error to two digits, the value to the same place."""
    if not math.isfinite(value):
        return ("-" if math.isnan(value) else str(value)), ""
    if not math.isfinite(error):
        return f"{value:.5g}", ""
    if error <= 0.0:
        return f"{value:.6g}", "0"
    # An error far above its value must not cost the value all its digits.
    digits = 2 if value == 0.0 else math.floor(math.log10(abs(value) / error)) + 2
    return f"{value:#.{min(max(digits, 2), 9)}g}".rstrip("."), f"{error:.2g}"


def show(result: Result) -> None:
    """The table and the remarks, on stdout."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    console = Console(highlight=False)
    if not console.is_terminal:
        console = Console(highlight=False, width=120)
    console.print(Text(result.title), soft_wrap=True)
    table = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False)
    for heading, side in (("", "left"), ("value", "right"), ("+-", "right"), ("unit", "left")):
        table.add_column(heading, justify="right" if side == "right" else "left")
    noted = any(line.note for line in result.lines)
    if noted:
        table.add_column("")
    for line in result.lines:
        cells = [line.name, *rounded(line.value, line.error), line.unit]
        table.add_row(*(Text(c) for c in [*cells, line.note][: 5 if noted else 4]))
    console.print(table)
    for name, text in result.remarks:
        console.print(Text(f"{name}: {text}"), soft_wrap=True)
