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
from macromicro.thesis.page.placing import Anchors
from macromicro.thesis.page.reproduction import About, page
from macromicro.thesis.procedure import Procedure
from macromicro.thesis.reproduce import Result, as_rows

PAGE, JSON, CSV = "reproduction.html", "claims.json", "claims.csv"
FIGURES = "figures"
FILES = (PAGE, JSON, CSV)
_SUFFIXES = ("csv", *FORMATS)
_COLUMNS = ("id", "section", "claim", "printed", "measured", "unit", "verdict", "reason", "kind")


def write(
    out: Path, results: Sequence[Result], procedures: Sequence[Procedure], about: About
) -> Path:
    """Write everything to `out`, all of it or nothing; the page's path.

    Figures and tables of an earlier reproduction are removed. Raises OSError where the disk
    refuses.
    """
    with folder.staged(out, remove=_earlier(out)) as place:
        (place / PAGE).write_text(page(results, procedures, about), encoding="utf-8")
        (place / JSON).write_text(as_json(results), encoding="utf-8")
        (place / CSV).write_text(as_csv(results), encoding="utf-8", newline="")
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
    """The same as CSV, numbers to the last digit; lists are separated by "; "."""
    rows = [[_cell(row[name]) for name in _COLUMNS] for row in as_rows(results)]
    return _csv([_COLUMNS, *rows])


def _cell(value: Any) -> str:
    if isinstance(value, list):
        return "; ".join(_cell(v) for v in value)
    if value is None:
        return ""
    return value if isinstance(value, str) else repr(value)


def _csv(rows: Sequence[Sequence[str]]) -> str:
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def _contents(exhibit: Exhibit) -> dict[str, bytes]:
    """Its files, by suffix."""
    data = exhibit.data
    if isinstance(data, Grid):
        return {"csv": _csv([data.headings, *data.rows]).encode()}
    return {SVG: data.encode()} if isinstance(data, str) else exhibit.files


def _earlier(out: Path) -> list[str]:
    """Figures and tables that lie in `out`, as paths below it."""
    return [
        f"{FIGURES}/{path.name}"
        for stem in ("figure-*", "table-*", "equation-*")
        for path in sorted((out / FIGURES).glob(stem))
        if path.suffix[1:] in _SUFFIXES
    ]
