"""Two axes that differ from their sheets, under the laws of the nominal ones."""

import json

import pytest
from tests.machines.joint.axes import straight

from macromicro import cli
from macromicro.errors import InputError
from macromicro.machines.joint import planning
from macromicro.machines.joint.machine import XY_MACHINE
from macromicro.machines.joint.settings import DEFAULT
from macromicro.robustness import stage, stage_files
from macromicro.schema.par import entries

PLAN = planning.plan(straight((0.05, 0.03), (0.0, 0.05)), DEFAULT)
ROWS = stage.uncertain(XY_MACHINE, DEFAULT)


def test_every_row_names_parameters_of_the_machine():
    paths = {e.path for e in entries(DEFAULT)}
    assert all(path in paths for row in ROWS for path, _ in row.parts)
    names = [row.name for row in ROWS]
    assert len(names) == len(set(names)) and {"x_mass", "y_mass", "squareness"} <= set(names)
    assert "x_mode" not in names and "body" in names
    soft = DEFAULT.with_({"x.drive.frequency": "50 Hz", "stack.carries": "nothing"})
    names = [row.name for row in stage.uncertain(XY_MACHINE, soft)]
    assert "x_mode" in names and "y_mode" not in names and "body" not in names


def test_the_plants_change_and_the_laws_do_not():
    amounts, trees = stage.machines(XY_MACHINE, DEFAULT, ROWS, 12, 1)
    at = {row.name: k for k, row in enumerate(ROWS)}
    for each, tree in zip(amounts, trees, strict=True):
        upper = 0.5 * each[at["y_mass"]]
        assert tree.y.load.mass == pytest.approx(upper)
        # What x carries goes with it.
        assert tree.x.load.payload == pytest.approx(upper + each[at["body"]])
        assert tree.hidden.squareness == pytest.approx(each[at["squareness"]])
        for own, nominal in ((tree.x, DEFAULT.x), (tree.y, DEFAULT.y)):
            assert all(getattr(own, k) == getattr(nominal, k) for k in stage.KEPT)
    assert len({tree.hidden.squareness for tree in trees}) == 12
    a, b = at["x_coulomb"], at["y_coulomb"]
    assert not (amounts[:, a] == amounts[:, b]).any()  # each is drawn by itself


def test_a_study_tells_how_many_keep_the_contour():
    found = stage.study(XY_MACHINE, DEFAULT, PLAN, 12, 2, 2)
    found = found._replace(required=stage.required(XY_MACHINE, DEFAULT))
    told = stage_files.content(found)
    assert told["done"] == 12 and len(told["machines"]) == 12 and told["machine"] == "xy"
    (required,) = told["requirements"]
    assert required["metric"] == "contour"
    assert required["limit"] == pytest.approx(1e6 * DEFAULT.path.tolerance)
    kept = sum(t.contour <= required["limit"] for t in found.found)
    assert required["passed"] == kept
    said = stage_files.lines(found)
    assert said[1].startswith("required: contour at most") and f"met on {kept} of 12" in said[1]
    assert told["metrics"]["contour"]["nominal"] == found.nominal.contour
    # A narrower limit is kept by fewer.
    middle = sorted(t.contour for t in found.found)[5]
    tight = stage.required(XY_MACHINE, DEFAULT)[0]._replace(limit=middle)
    assert found.met(tight).passed == 6
    assert stage.study(XY_MACHINE, DEFAULT, PLAN, 12, 2, 1).found == found.found
    with pytest.raises(InputError, match="--samples"):
        stage.study(XY_MACHINE, DEFAULT, PLAN, 9, 0, 1)


def test_the_command_writes_its_folder(tmp_path, monkeypatch, capsys):
    (tmp_path / "m.toml").write_text('machine = "xy"\n')
    (tmp_path / "limits.toml").write_text('true_contour = "1 um"\n')
    words = ["macromicro", "robust", "--config", str(tmp_path / "m.toml"), "--samples", "10"]
    words += ["--out", str(tmp_path / "out"), "--requirements", str(tmp_path / "limits.toml")]
    monkeypatch.setattr("sys.argv", words)
    assert cli.main() == 0
    said = capsys.readouterr().out
    assert "required: contour at most" in said and "required: true_contour at most 1 um" in said
    assert {p.name for p in (tmp_path / "out").iterdir()} == {"robust.json", "robust.png"}
    assert json.loads((tmp_path / "out/robust.json").read_text())["asked"] == 10
    monkeypatch.setattr("sys.argv", [*words, "--overwrite", "--law", "cascade"])
    assert cli.main() == 2
    assert "--law" in capsys.readouterr().err
