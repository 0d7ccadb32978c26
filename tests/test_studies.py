"""Studies from Python give what the commands write, for every kind of machine."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

import macromicro
from macromicro import cli
from macromicro.errors import InputError
from macromicro.schema.config import difference
from macromicro.settings import Settings
from tests import two_stages

PRINTER = Path(__file__).parents[1] / "examples/machines/printer.toml"


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    two_stages.write(tmp_path)
    return tmp_path


def command(monkeypatch: pytest.MonkeyPatch, *words: object) -> None:
    monkeypatch.setattr(sys, "argv", ["macromicro", *map(str, words)])
    assert cli.main() == 0


def test_gains_of_an_axis_are_those_of_the_command(
    lab: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[int] = []
    found = macromicro.tune(
        PRINTER, evaluations=20, seed=3, progress=lambda done, best: told.append(done)
    )
    assert not list(lab.glob("results/*"))
    options = ("--config", PRINTER, "--evaluations", 20, "--seed", 3, "--out", "tuned")
    command(monkeypatch, "tune", "axis", *options)
    written = macromicro.load_settings("tuned/tuned.toml")
    assert written == found.settings
    assert found.better and found.settings != macromicro.load_settings(PRINTER)
    assert found.after["rms_error"] < found.before["rms_error"]
    assert told[-1] == found.evaluations <= 20


@pytest.mark.slow
def test_gains_of_several_stages_are_searched_on_their_sheets(
    lab: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    start = macromicro.load_settings("machine.toml")
    found = macromicro.tune("machine.toml", evaluations=30, settings=start)
    options = ("--config", "machine.toml", "--evaluations", 30, "--out", "tuned")
    command(monkeypatch, "tune", "x_z", *options)
    assert macromicro.load_settings("tuned/tuned.toml") == found.settings
    assert set(found.before) == set(found.after) >= {"settling", "peak_error_x", "peak_error_z"}
    changed = difference(found.settings, start)
    assert {path.split(".")[1] for path in changed} <= {"controller", "guard"}
    assert found.costs[1] <= found.costs[0]
    assert "x.phase" in found.margins()[0]


def test_gains_of_the_two_stage_machine_name_their_stage() -> None:
    with pytest.raises(InputError, match="Give macro or micro"):
        macromicro.tune()
    found = macromicro.tune(stage="macro", evaluations=10, seed=1)
    assert found.settings.bench == Settings().bench
    assert found.before["settling_time"] > 0.0


def test_what_does_not_go_together_is_refused() -> None:
    with pytest.raises(InputError, match="Leave the stage out"):
        macromicro.tune(PRINTER, "micro")
    own = macromicro.load_settings(PRINTER)
    with pytest.raises(InputError, match="a law of their own"):
        macromicro.robust(PRINTER, law="cascade", settings=own)
    with pytest.raises(InputError, match="workers"):
        macromicro.robust(PRINTER, workers=0)


@pytest.mark.slow
def test_machines_that_differ_are_those_of_the_command(
    lab: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    found = macromicro.robust("machine.toml", "moves.toml", samples=12, seed=2, workers=1)
    options = ("--programme", "moves.toml", "--samples", 12, "--seed", 2, "--json")
    command(monkeypatch, "robust", "--config", "machine.toml", *options)
    told = json.loads(capsys.readouterr().out)
    assert told["overall"]["passed"] == found.arrived.passed
    assert [p["name"] for p in told["parameters"]] == list(found.parameters)
    for name, values in found.figures.items():
        assert values.shape == (12,)
        if name != "fault_code":
            assert told["metrics"][name]["nominal"] == found.nominal[name]
            assert told["metrics"][name]["unit"] == found.units[name]
    assert np.max(found.figures["settling"]) == told["metrics"]["settling"]["most"]


def test_machines_that_differ_from_the_two_stage_one(lab: Path) -> None:
    counts: list[int] = []
    found = macromicro.robust(
        programme="staircase", samples=10, workers=1, progress=lambda n: bool(counts.append(n))
    )
    assert len(found.figures["macro_settling"]) == len(found.parameters["coulomb"]) == 10
    assert found.units["vibration"] == "um"
    assert found.arrived.total == 10
    assert counts == sorted(counts) and counts[-1] > 10


@pytest.mark.slow
def test_a_sweep_of_any_machine_is_a_table(lab: Path) -> None:
    table = macromicro.sweep("sweep.toml", "out", workers=1)
    assert table.column("x.friction.coulomb").to_pylist() == [2.0, 3.0]
    assert table.column("missed").to_pylist() == [0.0, 0.0]
    assert table.schema.field("settling").metadata[b"unit"] == b"s"
    with pytest.raises(InputError, match="out"):
        macromicro.sweep("sweep.toml", "out", workers=1)
    again = macromicro.sweep("sweep.toml", "out", workers=1, overwrite=True)
    assert again.equals(table)


def test_a_sweep_that_is_stopped_can_be_resumed(lab: Path) -> None:
    with pytest.raises(InterruptedError, match="of 2 variants are finished"):
        macromicro.sweep("sweep.toml", "out", workers=1, progress=lambda done: True)
    table = macromicro.sweep("sweep.toml", "out", workers=1, resume=True)
    assert table.num_rows == 2
