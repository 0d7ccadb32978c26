"""Report of the commissioning of both stages: a page, and the same as JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import macromicro
from macromicro.commission.report import JSON, PAGE, TEMPLATE
from macromicro.drawing.page import Picture, fill
from macromicro.identify.clusters import within
from macromicro.identify.result import rounded
from macromicro.report import write as run_report
from macromicro.runs import folder
from macromicro.schema.text import plain, write_text
from macromicro.thesis.commissioning import DIRECTIONS, MACHINE, STEPS, VERIFICATION, Commissioned

FILES = (PAGE, JSON)
HEADINGS = (
    *("move", "stage", "to", "unit", "settled after [s]", "overshoot", "error at rest"),
    "true error",
)
_NOTE = f"Each part's own table, figures and records are in {STEPS}/. The verification's page is "


def write(found: Commissioned, name: str, started: str) -> None:
    run_report.write(found.ended, run_report.run_report(found.ended, started))
    text = fill(
        TEMPLATE,
        name=name,
        started=started,
        met=found.met,
        why=found.why,
        found=rows(found),
        note=f"{_NOTE}{VERIFICATION}/{folder.PAGE}.",
        sign=1.0,  # another one ends the commissioning
        doubts=found.doubts,
        headings=HEADINGS,
        moves=moves(found),
        pictures=_pictures(found.out),
        file=MACHINE,
        toml=found.toml,
    )
    what = {
        "of": name,
        "version": macromicro.__version__,
        "directions": json.loads((found.out / DIRECTIONS).read_text(encoding="utf-8")),
        "parts": found.found,
        "doubts": found.doubts,
        "verification": {
            "met": found.met,
            "why": found.why,
            "moves": [m._asdict() for m in found.ended.moves],
        },
    }
    with folder.staging(found.out) as stage:
        write_text(stage / PAGE, text)
        content = json.dumps(plain(what), indent=2, allow_nan=False)
        write_text(stage / JSON, content + "\n")


def rows(found: Commissioned) -> list[tuple[str, ...]]:
    """The results: quantity, value, half of its 95 % interval, unit."""
    lines: list[tuple[str, ...]] = []
    for name, one in found.found.items():
        for line in one["values"]:
            value = math.nan if line["value"] is None else line["value"]
            shown, half = rounded(value, half_width(line))
            what = f"{name}, {line['name']}" + (line["note"] and f": {line['note']}")
            lines.append((what, shown, half and f"+- {half}", line["unit"]))
    return lines


def half_width(line: Mapping[str, Any]) -> float:
    if line["error"] is None or line["value"] is None:
        return math.nan
    degrees = line.get("freedom") or math.inf  # null in JSON
    return float(within(degrees) * line["error"])


def moves(found: Commissioned) -> list[tuple[str, ...]]:
    """The moves of the verification, under `HEADINGS`."""
    lines = []
    for m in found.ended.moves:
        late = "not" if m.settling_s is None else f"{m.settling_s:.3f}"
        errors = (m.overshoot, m.final_error, m.true_error)
        shown = ("-" if e is None else f"{e:.3g}" for e in errors)
        lines.append((f"{m.move + 1}", m.stage, f"{m.target:g}", m.unit, late, *shown))
    return lines


def _pictures(out: Path) -> list[Picture]:
    return [
        Picture(
            f"{path.parts[-3]}-{path.stem}", f"{path.parts[-3]}, {path.stem}", "", path.read_bytes()
        )
        for path in sorted((out / STEPS).glob("*/model/*.png"))
    ]
