"""What a tuning leaves behind."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

import macromicro
from macromicro.settings import Settings
from macromicro.tuning import files
from macromicro.tuning.files import Report
from macromicro.tuning.request import Request, ready
from macromicro.tuning.search import Tuning

PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture(scope="module")
def found() -> Tuning:
    asked = Request(stage="macro", evaluations=64, robust=True, machines=3, fresh=12)
    return ready(asked).search()


@pytest.fixture(scope="module")
def report(found: Tuning) -> Report:
    return files.summarise(found)


@pytest.fixture(scope="module")
def place(report: Report, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("tune") / "out"
    files.write(out, report)
    return out


def test_all_files(place: Path) -> None:
    made = {p.name for p in place.iterdir()}
    pictures = {"response.png", "bode.png"}
    assert made == {files.PAGE, files.SETTINGS, files.NUMBERS, *pictures} < set(files.FILES)
    for name in pictures:
        assert (place / name).read_bytes().startswith(PNG)


@pytest.mark.slow
def test_figures_in_other_formats_replace_the_earlier_ones(report: Report, tmp_path: Path) -> None:
    for kinds in (("png", "svg"), ("pdf",)):
        files.write(tmp_path, report, kinds)
    assert {p.name for p in tmp_path.iterdir() if p.suffix in (".png", ".svg", ".pdf")} == {
        "response.pdf",
        "bode.pdf",
    }


def test_the_settings_read_back(place: Path, found: Tuning) -> None:
    """Bit for bit."""
    assert macromicro.load_settings(place / "tuned.toml") == found.best.settings


def test_other_settings_of_the_start_are_kept(tmp_path: Path) -> None:
    """A bench that was set otherwise is what the tuned law was made for."""
    heavy = Settings().with_("bench.carriage.mass", "0.6 kg")
    found = ready(Request(stage="macro", law="pid", evaluations=5, settings=heavy)).search()
    (tmp_path / "tuned.toml").write_text(files.as_toml(files.summarise(found)))
    again = macromicro.load_settings(tmp_path / "tuned.toml")
    assert again == found.best.settings
    assert again.bench.carriage.mass == 0.6
    assert again.controller.macro_law == "pid"


def test_the_numbers(place: Path, found: Tuning) -> None:
    record = json.loads((place / "tuning.json").read_text())
    assert record["seed"] == 0
    assert record["evaluations"] == found.evaluations <= 64
    assert record["objective"]["meaning"] == found.objective.meaning
    assert record["objective"]["penalties"] == {"overshoot": 1.0, "saturated": 0.0}
    rows = {(row["group"], row["name"]): row["values"] for row in record["table"]}
    assert rows["figures of the run", "iae"] == pytest.approx(
        [version.runs[0]["iae"] for version in found.versions]
    )
    margins = [found.subject.margins(version.settings) for version in found.versions]
    disk = [m.value for each in margins for m in each if m.name == "disk"]
    assert rows["margins", "disk"] == pytest.approx(disk)
    assert rows["objective", "searched"] == pytest.approx([v.cost for v in found.versions])
    assert record["better"] is found.better
    assert record["machines"]["count"] == 3 and len(record["machines"]["draws"]) == 2
    assert record["machines"]["ranges"][0]["name"] == "coulomb"
    assert found.fresh is not None and record["fresh"]["count"] == 12
    assert list(record["fresh"]["cost"].values()) == pytest.approx(found.verdict)
    assert record["overrides"].keys() >= {"controller.pd_tuned.now"}
    assert len(record["history"]) >= 1


def test_the_page_and_the_terminal_tell_the_same(place: Path, report: Report) -> None:
    page = (place / "tuning.html").read_text()
    for word in ("disk margin", "objective, worst of 3 searched", "fresh machines", "V/count"):
        assert word in report.text and word in page
    assert page.count("data:image/png;base64,") == 2


def test_an_unstable_loop_is_written_too(report: Report) -> None:
    """JSON knows no NaN."""
    rows = [row._replace(values=(math.nan, math.inf)) for row in report.rows]
    record = json.loads(files.as_json(report._replace(rows=rows)))
    assert record["table"][0]["values"] == [None, "inf"]
