"""Machines that differ from their sheets, under the law of the nominal one."""

import json

import numpy as np
import pytest
from tests.robustness.drawing import drawn

from macromicro import cli
from macromicro.errors import InputError
from macromicro.machines import compositions, machine, planning
from macromicro.machines.runs import StageSetup
from macromicro.robustness import _findings, requirements, study
from macromicro.robustness import subject as subjects
from macromicro.robustness.study import Request
from macromicro.schema.par import entries
from macromicro.uncertainty import stages
from macromicro.uncertainty.table import read_table

AXIS = machine.MACHINES[0]
ROWS = read_table(AXIS.spread, AXIS.settings)
PLAN = planning.plan(planning.usual(AXIS.settings), AXIS.settings)
SETUP = StageSetup(AXIS, AXIS.settings, PLAN)


def test_every_row_names_parameters_of_the_axis():
    paths = {e.path for e in entries(AXIS.settings)}
    assert all(path in paths for row in ROWS for path, _ in row.parts)
    assert all(row.low < 1.0 < row.high and row.stage == "axis" for row in ROWS)


@pytest.mark.parametrize("other", machine.MACHINES, ids=lambda m: m.name)
def test_every_machine_has_a_table_that_its_law_does_not_know(other):
    rows = stages.uncertain(other, other.settings)
    paths = {e.path for e in entries(other.settings)}
    assert rows and all(row.stage == other.name for row in rows)
    assert all(path in paths for row in rows for path, _ in row.parts)
    for tree in drawn(other, other.settings, rows, 10, 3)[1]:
        other.kind.prepare(tree)
        for name in stages.KEPT:
            assert getattr(tree, name) == getattr(other.settings, name)


def test_what_the_machine_has_not_is_not_varied():
    names = [r.name for r in stages.uncertain(AXIS, AXIS.settings)]
    assert "mode" not in names and "mass" in names
    soft = AXIS.settings.with_("drive.frequency", "50 Hz")
    assert "mode" in [r.name for r in stages.uncertain(AXIS, soft)]


def test_the_plant_changes_and_the_law_does_not():
    rows = stages.uncertain(AXIS, AXIS.settings)
    amounts, trees = drawn(AXIS, AXIS.settings, rows, 12, 1)
    assert amounts.shape == (12, len(rows))
    mass = [row.name for row in rows].index("mass")
    for each, tree in zip(amounts, trees, strict=True):
        assert tree.load.mass == pytest.approx(0.5 * each[mass])
        for name in stages.KEPT:
            assert getattr(tree, name) == getattr(AXIS.settings, name)


@pytest.fixture(scope="module")
def found():
    subject = subjects.of(SETUP, 2)
    return study.run(Request(AXIS.settings, subject.required, 12, 2), subject)


def test_a_study_has_a_row_for_each_machine_and_each_end(found):
    assert found.arrived().total == 12 and found.arrived().passed >= 11
    rms = found.column("rms_error")
    subject = subjects.of(SETUP, 1)
    again = study.run(found.request._replace(single=False), subject)
    assert np.array_equal(again.rows, found.rows) and np.isnan(again.single).all()
    nominal = StageSetup(AXIS, AXIS.settings, PLAN).trial(2)
    assert found.nominal[found.at("rms_error")] == nominal.rms_error
    third = StageSetup(AXIS, found.settings(3), PLAN).trial(2 + 3)
    assert rms[3] == third.rms_error
    heavier = found.single[[u.name for u in found.subject.uncertain].index("mass"), 1]
    assert heavier[found.at("rms_error")] != nominal.rms_error


def test_a_fault_is_told_apart_from_its_code(found):
    subject = found.subject
    tree = AXIS.settings.with_("guard.speed", "0.011 m/s")
    row = subject.run(tree, 0)
    assert row[0] == 1.0 and row[-1] > 1.0
    assert subject.metrics[0].name == "fault" and subject.metrics[-1].name == "fault_code"


def test_what_is_drawn_are_errors_and_settling(found):
    assert set(found.subject.main) == {
        "settling", "peak_error", "rms_error", "overshoot", "rest_error", "true_error",
    }  # fmt: skip


def test_a_worst_case_is_a_file_that_runs_the_same(found, tmp_path):
    worst = next(w for w in _findings.worst(found) if w.requirement.metric.name == "missed")
    text = found.subject.as_toml(found.settings(worst.sample))
    (tmp_path / "worst.toml").write_text(text)
    again = compositions.load(tmp_path / "worst.toml")[1]
    assert again == found.settings(worst.sample)
    assert again.controller == AXIS.settings.controller


def test_a_user_s_requirements_are_of_its_figures(tmp_path, found):
    middle = float(np.median(found.column("rms_error")))
    path = tmp_path / "limits.toml"
    path.write_text(f'rms_error = "{middle} um"\nmissed = false\nsettling = "0.1 ms"\n')
    required = requirements.load(path, found.quantities, found.request.requirements)
    assert [r.metric.name for r in required] == ["fault", "settling", "rms_error"]
    assert found.met(required[2]).sum() == 6
    assert found.met(*required).sum() <= 6
    path.write_text('macro_settling = "1 s"\n')
    with pytest.raises(InputError, match="unknown metric"):
        requirements.load(path, found.quantities, ())


@pytest.mark.parametrize("samples", [9, 100_001])
def test_too_few_or_too_many_are_refused(samples, found):
    with pytest.raises(InputError, match="--samples"):
        study.run(Request(AXIS.settings, (), samples, 0), found.subject)


def test_the_command_writes_its_folder(tmp_path, monkeypatch, capsys):
    (tmp_path / "m.toml").write_text('machine = "axis"\n')
    words = ["macromicro", "robust", "--config", str(tmp_path / "m.toml"), "--samples", "10"]
    words += ["--out", str(tmp_path / "out")]
    monkeypatch.setattr("sys.argv", words)
    assert cli.main() == 0
    out = capsys.readouterr().out
    assert "all together" in out and "largest influences" in out
    made = {p.name for p in (tmp_path / "out").iterdir()}
    assert {"robust.html", "robust.json", "samples.csv", "tornado.png"} <= made
    told = json.loads((tmp_path / "out/robust.json").read_text())
    assert (told["machine"], told["samples_done"]) == ("axis", 10)
    worst = next(w for w in told["worst"] if w["metric"] == "missed")
    line = f"macromicro run --config {tmp_path}/out/{worst['file']} --seed {worst['seed']}"
    assert line in out
    assert compositions.load(tmp_path / "out" / worst["file"])[0].name == "axis"
    for more, said in (
        (["--fan"], "--fan"),
        (["--workers", "-2"], "--workers: '-2'; accepted: a whole number from 1"),
        (["--samples", "-2"], "--samples: '-2'; accepted: a whole number from 10"),
    ):
        monkeypatch.setattr("sys.argv", [*words, "--overwrite", *more])
        assert cli.main() == 2
        assert said in capsys.readouterr().err
