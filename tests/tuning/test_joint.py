"""Gains of several stages by search."""

import json

import pytest
from tests.machines.joint.axes import straight

from macromicro import cli
from macromicro.machines import compositions, trial
from macromicro.machines.joint import planning
from macromicro.machines.joint.machine import XY_MACHINE
from macromicro.machines.joint.settings import DEFAULT
from macromicro.schema.par import value_at
from macromicro.tuning import words
from macromicro.tuning.joint import Joint
from macromicro.tuning.search import Budget, search
from macromicro.tuning.subject import FAILED

GOOD = trial.kind(XY_MACHINE)(0.0, 0.0, 9.0, 4.0, 10.0, 0.01, 5.0, 6.0, 7.0, 0.2, 0.4)
PLAN = planning.plan(straight((0.05, 0.03), (0.0, 0.05)), DEFAULT)


def test_the_cost_by_hand():
    assert DEFAULT.x.guard.effort == 10.0 == DEFAULT.y.guard.effort
    objective = Joint(XY_MACHINE, DEFAULT, PLAN).objective("error")

    def cost(**changes):
        return objective.cost(GOOD._replace(**changes)._asdict(), GOOD._asdict(), {})

    # 2 and 4 % of the limit, in the mean 3 %, at a fifth for each.
    assert cost() == pytest.approx(4.0 * (1.0 + 0.2 * 3.0))
    assert cost(fault=3.0) == FAILED
    assert cost(missed=2.0) == 3.0 * FAILED


def test_matched_axes_have_the_lower_position_gain():
    subject = Joint(XY_MACHINE, DEFAULT, PLAN)
    tree = DEFAULT.with_({"x.controller.position": "30 1/s", "y.controller.position": "40 1/s"})
    ((name, found),) = subject.further(tree)
    assert name == "matched"
    assert found.x.controller.position == 30.0 == found.y.controller.position
    # What follows from the gain, such as the guard's limit of the error, follows.
    assert found == tree.with_("y.controller.position", "30 1/s")
    assert not subject.further(tree.with_("y.law", "tests.control.own_laws:sliding"))


@pytest.mark.slow
def test_a_search_never_ends_worse_than_it_began():
    heard = []
    subject = Joint(XY_MACHINE, DEFAULT, PLAN)
    found = search(subject, "error", {}, Budget(30, 1), lambda done, best: heard.append(done))
    assert [v.name for v in found.versions] == ["before", "each alone", "matched", "after"]
    costs = [v.cost for v in found.versions]
    assert found.best.cost == min(costs) <= costs[0] < FAILED
    assert found.first.settings == DEFAULT
    assert len(subject.paths) == 8 and subject.paths[4] == "y.controller.position"
    for version in found.versions:
        assert version.settings.x.load == DEFAULT.x.load
        assert all(own.together() == [] for own in (version.settings.x, version.settings.y))
    assert found.evaluations <= 30 and heard == sorted(heard)
    margins = [subject.margins(v.settings) for v in found.versions]
    rows = {(row.group, row.name): row for row in words.rows(found, margins)}
    for path in subject.paths:
        each = tuple(value_at(v.settings, path) for v in found.versions)
        assert rows[words.GAINS, path].values == each
    assert rows[words.COST, "cost"].values == pytest.approx(costs)
    assert (words.MARGINS, "y.phase") in rows


def test_it_is_searched_on_varied_machines_as_well():
    subject = Joint(XY_MACHINE, DEFAULT, PLAN)
    found = search(subject, "error", {}, Budget(30, 1, 2, 2))
    assert {len(v.runs) for v in found.versions} == {2}
    assert found.fresh is not None and found.verdict == found.fresh.costs


def test_the_command_writes_settings_that_run(tmp_path, monkeypatch, capsys):
    (tmp_path / "m.toml").write_text('machine = "xy"\n[y.load]\npayload = "0.2 kg"\n')
    line = ["macromicro", "tune", "xy", "--config", str(tmp_path / "m.toml")]
    line += ["--evaluations", "30", "--out", str(tmp_path / "out")]
    monkeypatch.setattr("sys.argv", [*line, "--json"])
    assert cli.main() == 0
    told = json.loads(capsys.readouterr().out)
    assert told == json.loads((tmp_path / "out/tuning.json").read_text())
    made = {"tuned.toml", "tuning.json", "tuning.html", "response.png", "bode.png"}
    assert {p.name for p in (tmp_path / "out").iterdir()} == made
    found, tree = compositions.load(tmp_path / "out/tuned.toml")
    assert tree.y.load.payload == 0.2 and found.name == "xy"
    best = told["versions"].index(told["best"])
    row = next(r for r in told["table"] if r["name"] == "x.controller.position")
    assert tree.x.controller.position == row["values"][best]
    assert told["evaluations"] <= 30
    for more, said in (
        (["--law", "cascade"], "--law"),
        (["--objective", "beauty"], "--objective"),
        (["--evaluations", "29"], "--evaluations: '29'; accepted: a whole number from 30"),
    ):
        monkeypatch.setattr("sys.argv", [*line, "--overwrite", *more])
        assert cli.main() == 2
        assert said in capsys.readouterr().err
    monkeypatch.setattr("sys.argv", [w if w != "xy" else "axis" for w in line])
    assert cli.main() == 2
    assert "the machine of" in capsys.readouterr().err
