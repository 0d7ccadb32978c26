"""What a tuning leaves behind."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import macromicro
from macromicro import tuning
from macromicro.errors import InputError
from macromicro.settings import Settings
from macromicro.tuning import _objectives, files, tables

PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture(scope="module")
def found() -> tuning.Tuning:
    return tuning.macro(evaluations=64, robust=True, benches=3, held_out=12)


@pytest.fixture(scope="module")
def place(found: tuning.Tuning, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("tune") / "out"
    files.write(out, found)
    return out


def test_all_files(place: Path) -> None:
    made = {p.name for p in place.iterdir()}
    assert made == {files.SETTINGS, files.NUMBERS, "response.png", "bode.png"} < set(files.FILES)
    for name in ("response.png", "bode.png"):
        assert (place / name).read_bytes().startswith(PNG)


@pytest.mark.slow
def test_figures_in_other_formats_replace_the_earlier_ones(
    found: tuning.Tuning, tmp_path: Path
) -> None:
    for kinds in (("png", "svg"), ("pdf",)):
        files.write(tmp_path, found, kinds)
    assert {p.name for p in tmp_path.iterdir() if p.suffix in (".png", ".svg", ".pdf")} == {
        "response.pdf",
        "bode.pdf",
    }


def test_the_settings_read_back(place: Path, found: tuning.Tuning) -> None:
    """Bit for bit."""
    assert macromicro.load_settings(place / "tuned.toml") == found.tuned


def test_other_settings_of_the_start_are_kept(tmp_path: Path) -> None:
    """A bench that was set otherwise is what the tuned law was made for."""
    bench = Settings().bench
    heavy = bench._replace(carriage=bench.carriage._replace(mass=0.6))
    found = tuning.macro(evaluations=5, law="pid", settings=Settings(bench=heavy))
    (tmp_path / "tuned.toml").write_text(files.as_toml(found))
    again = macromicro.load_settings(tmp_path / "tuned.toml")
    assert again == found.tuned
    assert again.bench.carriage.mass == 0.6
    assert again.controller.macro_law == "pid"


def test_the_numbers(place: Path, found: tuning.Tuning) -> None:
    record = json.loads((place / "tuning.json").read_text())
    assert record["seed"] == 0
    assert record["evaluations"] == found.evaluations <= 64
    assert record["objective"]["formula"] == _objectives.find("macro", "settling").formula
    assert record["margins"]["after"]["disk"] == found.margins[1].disk  # type: ignore[index]
    assert record["bench_metrics"]["before"] == pytest.approx(found.bench[0].metrics)
    assert record["better_on_the_bench"] is found.better
    ensemble = record["ensemble"]
    assert ensemble["aggregate"] == "worst"
    assert len(ensemble["draws"]) == 3
    assert ensemble["ranges"][0]["name"] == "coulomb"
    assert len(ensemble["held_out"]["draws"]) == 12
    assert list(ensemble["held_out"]["bench_cost"].values()) == pytest.approx(found.verdict)
    assert record["judged_on"] == "held-out benches"
    assert len(record["history"]) >= 1


def test_the_table_has_before_and_after(found: tuning.Tuning) -> None:
    text = "\n".join(tables.text(found))
    for word in (
        "settling into 2 %",
        "overshoot",
        "reversals",
        "disk margin",
        "objective, worst of 3 searched",
        "objective, worst of 12 fresh",
    ):
        assert word in text
    rows = {line.name: line for line in tables.measured(found)}
    assert rows["samples saturated"].before == found.bench[0].metrics["saturated"]


def test_a_taken_folder_is_refused(place: Path) -> None:
    with pytest.raises(InputError, match="already exists"):
        files.check(place, overwrite=False)
    files.check(place, overwrite=True)


def test_an_unstable_loop_is_written_too(tmp_path: Path, found: tuning.Tuning) -> None:
    """JSON knows no NaN."""
    unstable = found.margins[0]._replace(stable=False, gain=float("nan"), disk=float("inf"))  # type: ignore[index]
    record = json.loads(files.as_json(found._replace(margins=(unstable, unstable))))
    assert record["margins"]["before"]["gain"] is None
    assert record["margins"]["before"]["disk"] == "inf"
