"""The folder of a reproduction: all of it or nothing."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import pytest

from macromicro.thesis.claims import REPRODUCED, state
from macromicro.thesis.page import files
from macromicro.thesis.page.reproduction import About
from macromicro.thesis.reproduce import Result, as_rows

ABOUT = About("2026-01-02 03:04:05+00:00", 1.0)


@pytest.fixture(scope="module")
def written(reproduced: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out: Path = tmp_path_factory.mktemp("reproduction") / "deep" / "out"
    place = files.write(out, reproduced.results, reproduced.procedures, ABOUT)
    assert place == out / "reproduction.html"
    return out


def test_every_exhibit_is_a_file(reproduced: Any, written: Path) -> None:
    assert sorted(p.name for p in written.iterdir()) == sorted([*files.FILES, "figures"])
    names = sorted(p.name for p in (written / "figures").iterdir())
    exhibits = [e for r in reproduced.results for e in r.exhibits]
    assert len(names) == len(exhibits)
    assert {"figure-3-6.png", "table-3-1.csv", "figure-4-3.svg", "figure-4-3-2.svg"} <= set(names)
    assert (written / "figures" / "figure-3-6.png").read_bytes().startswith(b"\x89PNG")
    assert (written / "figures" / "figure-4-3.svg").read_text().startswith("<svg")


def test_a_table_reads_back(reproduced: Any, written: Path) -> None:
    table = next(e for r in reproduced.results for e in r.exhibits if e.number == "Table 3.1")
    with (written / "figures" / "table-3-1.csv").open(newline="") as file:
        assert [tuple(row) for row in csv.reader(file)] == [table.data.headings, *table.data.rows]


def test_json_and_csv_agree_with_the_claims(reproduced: Any, written: Path) -> None:
    rows = as_rows(reproduced.results)
    loaded = json.loads((written / "claims.json").read_text(encoding="utf-8"))
    assert loaded == rows
    with (written / "claims.csv").open(encoding="utf-8", newline="") as file:
        cells = list(csv.DictReader(file))
    assert len(cells) == len(rows) > 10
    for cell, row in zip(cells, rows, strict=True):
        assert set(cell) == set(row)
        for name in ("id", "section", "claim", "unit", "verdict", "reason", "kind"):
            assert cell[name] == row[name]
        for name in ("printed", "measured"):
            assert agrees(cell[name], row[name]), (row["id"], name)


def agrees(text: str, value: Any) -> bool:
    if isinstance(value, list):
        return all(agrees(t, v) for t, v in zip(text.split("; "), value, strict=True))
    if value is None:
        return text == ""
    return text == value if isinstance(value, str) else float(text) == value


def test_what_is_not_finite_is_empty(written: Path) -> None:
    rows = {r["id"]: r for r in json.loads((written / "claims.json").read_text(encoding="utf-8"))}
    assert rows["X1"]["measured"] == [1.5, None]
    open_above = state("M10", [3.0, 4.0], REPRODUCED, over=0.0, backs=0)
    result = Result("m", [open_above], [], 0.0)
    assert as_rows([result])[0]["accept"] == [[1.0, None], [2.0, None]]
    assert "1.0 to ; 2.0 to " in files.as_csv([result])
    assert files.as_json([]) == "[]\n"


def test_figures_of_an_earlier_reproduction_do_not_stay(reproduced: Any, tmp_path: Path) -> None:
    figures = tmp_path / "figures"
    figures.mkdir()
    for name in ("figure-9-9.png", "table-9-1.csv", "equation-9-1.svg", "mine.png", "figure-1.txt"):
        (figures / name).write_text("old")
    files.write(tmp_path, reproduced.results[:1], reproduced.procedures, ABOUT)
    left = {p.name for p in figures.iterdir() if p.read_bytes() == b"old"}
    assert left == {"mine.png", "figure-1.txt"}


def test_a_disk_that_refuses_leaves_the_earlier_result(reproduced: Any, tmp_path: Path) -> None:
    (tmp_path / "claims.json").write_text("old")
    (tmp_path / "figures").write_text("a file where a folder must be")
    with pytest.raises(OSError):
        files.write(tmp_path, reproduced.results, reproduced.procedures, ABOUT)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["claims.json", "figures"]
    assert (tmp_path / "claims.json").read_text() == "old"
