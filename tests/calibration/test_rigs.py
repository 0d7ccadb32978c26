"""A calibration on a user's rig that has a reference beside its encoder."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from tests.command import command

SCREW = Path(__file__).parents[2] / "examples" / "machines" / "screw.toml"

MACHINE = """machine = "axis"
[drive]
kind = "screw"
error = "20 um"
error_period = "5 mm"
[friction]
coulomb = "5 N"
[encoder]
at = "motor"
lines = 1000
[load]
stop_high = "45 mm"
[climate]
start = "23 degC"
sensor = 1
"""
RIG = """
from pathlib import Path

from macromicro.machines import machine, rig

FILE = Path({file!r})


class Bench(rig.Twin):
    def read(self):
        return super().read()._replace(laser=self.true_position())


def bench(seed):
    own, tree = machine.load(FILE)
    made = Bench(own.kind, tree, seed)
    made.channels = (*made.channels, "laser")
    return made


def bare(seed):
    own, tree = machine.load(FILE)
    return rig.Twin(own.kind, tree, seed)
"""


@pytest.mark.slow
def test_it_measures_against_the_rigs_own_reference(tmp_path: Path) -> None:
    file = tmp_path / "axis.toml"
    file.write_text(MACHINE, encoding="utf-8")
    (tmp_path / "lab.py").write_text(RIG.format(file=str(file)), encoding="utf-8")
    words = ("calibrate", "--config", file, "--positions", "9", "--runs", "2")
    done = command(*words, "--rig", "lab:bench", cwd=tmp_path)
    assert done.returncode == 2 and "--yes" in done.stderr
    assert "between -4 mm and 44 mm" in done.stderr
    done = command(*words, "--rig", "lab:bare", "--yes", cwd=tmp_path)
    assert done.returncode == 2 and "laser" in done.stderr
    done = command(*words, "--rig", "lab:bench", "--yes", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    (made,) = tmp_path.glob("results/calibrate/calibration.toml")
    assert 'temperature = "23 degC"' in made.read_text("utf-8")
    rows = {row["symbol"]: row for row in json.loads(done.stdout)["table"]}
    assert rows["A"]["before"] > 20.0 and rows["A"]["after"] < 0.4 * rows["A"]["before"]


@pytest.mark.slow
def test_reversals_without_a_reference_are_those_of_the_rig(tmp_path: Path) -> None:
    lying = SCREW.read_text(encoding="utf-8").replace('incline = "90 deg"', 'incline = "0 deg"')
    file, worn = tmp_path / "screw.toml", tmp_path / "worn.toml"
    file.write_text(lying, encoding="utf-8")
    worn.write_text(lying.replace('backlash = "4 um"', 'backlash = "50 um"'), encoding="utf-8")
    (tmp_path / "lab.py").write_text(RIG.format(file=str(worn)), encoding="utf-8")
    words = ("calibrate", "--config", file, "--reference", "none", "--rig", "lab:bench", "--yes")
    done = command(*words, "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["backlash"] == pytest.approx(54.0, abs=4.0)
