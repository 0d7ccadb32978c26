"""Commands for one stage on a machine of two: on each, one after the other."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from macromicro.cli import app
from macromicro.errors import InputError
from macromicro.export import catalogue
from macromicro.machines import compositions, sheets
from macromicro.machines import machine as machines
from macromicro.machines.joint.settings import DEFAULT
from macromicro.recording import Recording

XY = 'machine = "xy"\n[y.load]\nmass = "0.4 kg"\n'


@pytest.fixture
def file(tmp_path: Path) -> Path:
    (tmp_path / "xy.toml").write_text(XY)
    return tmp_path / "xy.toml"


def test_each_is_a_machine_of_one_stage_with_what_it_carries(file: Path, tmp_path: Path) -> None:
    (x, first, tree), (y, second, upper) = compositions.each(file)
    assert (x, y) == ("x", "y") and first.name == second.name == "axis"
    assert upper.load.mass == 0.4
    assert tree.load.payload == pytest.approx(DEFAULT.stack.body + 0.4)
    (tmp_path / "one.toml").write_text('machine = "wire"\n')
    ((name, machine, alone),) = compositions.each(tmp_path / "one.toml")
    assert (name, machine.name) == ("", "wire")
    assert alone == machines.load(tmp_path / "one.toml")[1]
    (tmp_path / "turns.toml").write_text('machine = "two_stage"\n')
    with pytest.raises(InputError, match="two_stage"):
        compositions.each(tmp_path / "turns.toml")


@pytest.mark.slow
def test_response_and_collect_make_a_folder_of_each(file: Path, tmp_path: Path) -> None:
    place = tmp_path / "b"
    words = ["response", "--config", str(file), "--count", "2", "--low", "20", "--high", "80"]
    done = CliRunner().invoke(app, [*words, "--out", str(place), "--json"])
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)
    for name in "xy":
        assert told[name] == json.loads((place / name / "response.json").read_text())
        assert (place / name / "bode.png").is_file()
    assert told["x"]["margins"] != told["y"]["margins"]
    words = ["collect", "drive", "--config", str(file), "--out", str(tmp_path / "c")]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    for name in "xy":
        found = Recording.load(tmp_path / "c" / name / "drive.h5")
        assert len(found) > 1000
        assert f"identify drive {tmp_path / 'c' / name / 'drive.h5'}" in done.output
    listed = CliRunner().invoke(app, ["collect", "--list", "--config", str(file)])
    assert "of each axis: x, y" in listed.output
    refused = CliRunner().invoke(app, [*words, "--rig", "mylab:bench", "--overwrite"])
    assert isinstance(refused.exception, InputError) and "twin" in str(refused.exception)


def test_each_axis_is_exported_with_its_own_gains(file: Path) -> None:
    units = catalogue.every(file)
    assert {"xy.x.law", "xy.y.law", "xy.x.guard", "xy.y.plant"} <= set(units)
    trees = {name: own for name, _, own in compositions.each(file)}
    for name, own in trees.items():
        unit = catalogue.unit(f"xy.{name}.law", file)
        assert unit.name == f"xy.{name}.law"
        assert unit.given["gains"] == own.controller
    assert sheets.mass(trees["x"]) > 2.0 * sheets.mass(trees["y"])
