"""Two axes that differ from their sheets, under the laws of the nominal ones."""

import json

import pytest
from tests.machines.joint.axes import straight
from tests.robustness.drawing import drawn

from macromicro import cli
from macromicro.machines.joint import planning
from macromicro.machines.joint.machine import XY_MACHINE
from macromicro.machines.joint.settings import DEFAULT
from macromicro.machines.runs import StageSetup
from macromicro.robustness import study
from macromicro.robustness import subject as subjects
from macromicro.schema.par import entries
from macromicro.uncertainty import stages

PLAN = planning.plan(straight((0.05, 0.03), (0.0, 0.05)), DEFAULT)
ROWS = stages.uncertain(XY_MACHINE, DEFAULT)


def test_every_row_names_parameters_of_the_machine():
    paths = {e.path for e in entries(DEFAULT)}
    assert all(path in paths for row in ROWS for path, _ in row.parts)
    names = [row.name for row in ROWS]
    assert len(names) == len(set(names)) and {"x_mass", "y_mass", "squareness"} <= set(names)
    assert "x_mode" not in names and "body" in names
    soft = DEFAULT.with_({"x.drive.frequency": "50 Hz", "stack.carries": "nothing"})
    names = [row.name for row in stages.uncertain(XY_MACHINE, soft)]
    assert "x_mode" in names and "y_mode" not in names and "body" not in names


def test_the_plants_change_and_the_laws_do_not():
    amounts, trees = drawn(XY_MACHINE, DEFAULT, ROWS, 12, 1)
    at = {row.name: k for k, row in enumerate(ROWS)}
    for each, tree in zip(amounts, trees, strict=True):
        upper = 0.5 * each[at["y_mass"]]
        assert tree.y.load.mass == pytest.approx(upper)
        # What x carries goes with it.
        assert tree.x.load.payload == pytest.approx(upper + each[at["body"]])
        assert tree.hidden.squareness == pytest.approx(each[at["squareness"]])
        for own, nominal in ((tree.x, DEFAULT.x), (tree.y, DEFAULT.y)):
            assert all(getattr(own, k) == getattr(nominal, k) for k in stages.KEPT)
    assert len({tree.hidden.squareness for tree in trees}) == 12
    a, b = at["x_coulomb"], at["y_coulomb"]
    assert not (amounts[:, a] == amounts[:, b]).any()  # each is drawn by itself


def test_a_study_requires_the_tolerance_of_the_path():
    subject = subjects.of(StageSetup(XY_MACHINE, DEFAULT, PLAN), 2)
    required = subject.required
    assert [r.metric.name for r in required] == ["fault", "missed", "contour"]
    assert required[2].limit == pytest.approx(1e6 * DEFAULT.path.tolerance)
    found = study.run(study.Request(DEFAULT, required, 12, 2, single=False), subject)
    contour = found.column("contour")
    assert found.met(required[2]).sum() == (contour <= required[2].limit).sum()
    # A narrower limit is kept by fewer.
    tight = required[2]._replace(limit=sorted(contour)[5])
    assert found.met(tight).sum() == 6
    assert {"contour", "rms_contour", "true_contour", "settling"} <= set(subject.main)


@pytest.mark.slow
def test_the_command_writes_its_folder(tmp_path, monkeypatch, capsys):
    (tmp_path / "m.toml").write_text('machine = "xy"\n')
    (tmp_path / "limits.toml").write_text('true_contour = "1 um"\n')
    words = ["macromicro", "robust", "--config", str(tmp_path / "m.toml"), "--samples", "10"]
    words += ["--out", str(tmp_path / "out"), "--requirements", str(tmp_path / "limits.toml")]
    monkeypatch.setattr("sys.argv", words)
    assert cli.main() == 0
    said = capsys.readouterr().out
    assert "at most 1 um" in said
    told = json.loads((tmp_path / "out/robust.json").read_text())
    assert (told["machine"], told["samples_done"]) == ("xy", 10)
    assert "contour" in [r["metric"] for r in told["requirements"]]
    assert (tmp_path / "out/robust.html").is_file()
    monkeypatch.setattr("sys.argv", [*words, "--overwrite", "--law", "cascade"])
    assert cli.main() == 2
    assert "--law" in capsys.readouterr().err
