"""The folder of a reproduction: page, claims as JSON and CSV, figures and tables."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from macromicro.drawing.exhibit import Exhibit, Grid
from macromicro.drawing.files import FORMATS, SVG
from macromicro.runs import folder
from macromicro.schema.text import write_text
from macromicro.thesis.page._placing import Anchors
from macromicro.thesis.page.reproduction import About, page
from macromicro.thesis.procedure import Procedure
from macromicro.thesis.reproduce import Result, as_rows

PAGE, JSON, CSV = "reproduction.html", "claims.json", "claims.csv"
FIGURES = "figures"
FILES = (PAGE, JSON, CSV)
_SUFFIXES = ("csv", *FORMATS)
_COLUMNS = (
    *("id", "section", "claim", "printed", "accept", "of", "basis", "rule"),
    *("measured", "unit", "verdict", "reason", "kind"),
)


def write(
    out: Path, results: Sequence[Result], procedures: Sequence[Procedure], about: About
) -> Path:
    """Write everything to `out`, all of it or nothing, and return the page's path.

    Figures and tables of an earlier reproduction are removed.
    """
    with folder.staging(out, remove=_earlier(out)) as place:
        write_text(place / PAGE, page(results, procedures, about))
        write_text(place / JSON, as_json(results))
        write_text(place / CSV, as_csv(results), newline="")
        (place / FIGURES).mkdir()
        names = Anchors()
        for exhibit in (e for result in results for e in result.exhibits):
            name = names.take(exhibit.name)
            for suffix, content in _contents(exhibit).items():
                (place / FIGURES / f"{name}.{suffix}").write_bytes(content)
    return out / PAGE


def as_json(results: Sequence[Result]) -> str:
    """All claims as a JSON list, as in `as_rows`."""
    return json.dumps(as_rows(results), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def as_csv(results: Sequence[Result]) -> str:
    """The same as CSV in full precision; lists are separated by "; ", bands read "0.4 to 0.65"."""
    rows = [[_cell(row[name]) for name in _COLUMNS] for row in as_rows(results)]
    return _csv([_COLUMNS, *rows])


def _cell(value: Any) -> str:
    if isinstance(value, list):
        bands = bool(value) and isinstance(value[0], list)
        return "; ".join(" to ".join(map(_cell, v)) if bands else _cell(v) for v in value)
    if value is None:
        return ""
    return value if isinstance(value, str) else repr(value)


def _csv(rows: Sequence[Sequence[str]]) -> str:
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def _contents(exhibit: Exhibit) -> dict[str, bytes]:
    data = exhibit.data
    if isinstance(data, Grid):
        return {"csv": _csv([data.headings, *data.rows]).encode()}
    return {SVG: data.encode()} if isinstance(data, str) else exhibit.files


def _earlier(out: Path) -> list[str]:
    return [
        f"{FIGURES}/{path.name}"
        for stem in ("figure-*", "table-*", "equation-*")
        for path in sorted((out / FIGURES).glob(stem))
        if path.suffix[1:] in _SUFFIXES
    ]
