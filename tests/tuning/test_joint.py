"""Gains of two axes by search."""

import json
import math

import pytest
from tests.machines.joint.axes import straight

from macromicro import cli
from macromicro.machines import compositions, trial
from macromicro.machines.joint import planning
from macromicro.machines.joint.machine import XY_MACHINE
from macromicro.machines.joint.settings import DEFAULT
from macromicro.schema.par import value_at
from macromicro.tuning import joint, joint_files, stage

GOOD = trial.kind(XY_MACHINE)(0.0, 0.0, 9.0, 4.0, 10.0, 0.01, 5.0, 6.0, 7.0, 0.2, 0.4)


def test_the_cost_by_hand():
    assert DEFAULT.x.guard.effort == 10.0 == DEFAULT.y.guard.effort
    # 2 and 4 % of the limit, in the mean 3 %, at a fifth for each.
    assert joint.cost(XY_MACHINE, GOOD, DEFAULT) == pytest.approx(4.0 * (1.0 + 0.2 * 3.0))
    assert joint.cost(XY_MACHINE, GOOD._replace(fault=3.0), DEFAULT) == stage.FAILED
    assert joint.cost(XY_MACHINE, GOOD._replace(missed=2.0), DEFAULT) == 3.0 * stage.FAILED


def test_matched_axes_have_the_lower_position_gain():
    tree = DEFAULT.with_({"x.controller.position": "30 1/s", "y.controller.position": "40 1/s"})
    found = joint.matched(XY_MACHINE, tree)
    assert found.x.controller.position == 30.0 == found.y.controller.position
    # What follows from the gain, such as the guard's limit of the error, follows.
    assert found == tree.with_("y.controller.position", "30 1/s")
    own = tree.with_("y.law", "tests.control.own_laws:sliding")
    assert joint.matched(XY_MACHINE, own) == own


def test_a_search_never_ends_worse_than_it_began():
    plan = planning.plan(straight((0.05, 0.03), (0.0, 0.05)), DEFAULT)
    aim = stage.named("error")
    heard = []
    found = joint.search(
        XY_MACHINE,
        DEFAULT,
        plan,
        aim,
        stage.Budget(30, 1),
        lambda done, best: heard.append(done),
    )
    names = [v.name for v in found.versions]
    assert names == ["sheets", "each alone", "matched", "pair"]
    costs = [v.cost for v in found.versions]
    assert found.best.cost == min(costs) <= costs[0] and math.isfinite(min(costs))
    assert found.versions[0].settings == DEFAULT
    assert len(found.knobs) == 8 and found.knobs[4] == "y.controller.position"
    for version in found.versions:
        assert version.settings.x.load == DEFAULT.x.load
        assert all(own.together() == [] for own in (version.settings.x, version.settings.y))
    assert found.evaluations <= 30 and heard == sorted(heard)
    rows = {row.name: row for row in joint_files.table(found)}
    for path in found.knobs:
        assert rows[path].values == tuple(value_at(v.settings, path) for v in found.versions)
    assert rows["cost (contour)"].values == tuple(costs)


def test_the_command_writes_settings_that_run(tmp_path, monkeypatch, capsys):
    (tmp_path / "m.toml").write_text('machine = "xy"\n[y.load]\npayload = "0.2 kg"\n')
    words = ["macromicro", "tune", "xy", "--config", str(tmp_path / "m.toml")]
    words += ["--evaluations", "30", "--out", str(tmp_path / "out")]
    monkeypatch.setattr("sys.argv", [*words, "--json"])
    assert cli.main() == 0
    told = json.loads(capsys.readouterr().out)
    assert told == json.loads((tmp_path / "out/tuning.json").read_text())
    assert {p.name for p in (tmp_path / "out").iterdir()} == {
        "tuned.toml",
        "tuning.json",
        "contour.png",
    }
    found, tree = compositions.load(tmp_path / "out/tuned.toml")
    assert tree.y.load.payload == 0.2 and found.name == "xy"
    best = told["versions"].index(told["best"])
    row = next(r for r in told["table"] if r["name"] == "x.controller.position")
    assert tree.x.controller.position == pytest.approx(row["values"][best], rel=1e-5)
    assert told["evaluations"] <= 30
    for more, said in (
        (["--robust"], "--robust"),
        (["--law", "cascade"], "--law"),
        (["--evaluations", "29"], "--evaluations: '29'; accepted: a whole number from 30"),
        (["--evaluations", "0"], "--evaluations: '0'; accepted: a whole number from 30"),
    ):
        monkeypatch.setattr("sys.argv", [*words, "--overwrite", *more])
        assert cli.main() == 2
        assert said in capsys.readouterr().err
    monkeypatch.setattr("sys.argv", [w if w != "xy" else "axis" for w in words])
    assert cli.main() == 2
    assert "xy for this machine" in capsys.readouterr().err
