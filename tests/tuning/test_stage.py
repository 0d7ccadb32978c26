"""Gains of a machine of one stage by search."""

import json
import math

import pytest

from macromicro import cli
from macromicro.errors import InputError
from macromicro.machines import machine, planning
from macromicro.machines.trial import Trial
from macromicro.tuning import stage, stage_files
from macromicro.tuning.evolution import minimise

AXIS = machine.MACHINES[0]
PLAN = planning.plan(planning.usual(AXIS.settings), AXIS.settings)
GOOD = Trial(0.0, 0.0, 0.02, 0.01, 30.0, 10.0, 0.0, 5.0, 6.0, 3.0, 0.0)


def test_objectives_and_penalties_by_hand():
    settings = AXIS.settings.with_("arrival.tolerance", "50 um")

    def cost(name, **changes):
        return stage.cost(stage.named(name), GOOD._replace(**changes), settings)

    assert cost("settling") == pytest.approx(0.01 + 1e-3 * 10.0 / 50.0)
    assert cost("error") == 10.0 and cost("rest") == 6.0
    assert cost("error", overshoot=25.0) == pytest.approx(10.0 * 1.25)
    assert cost("error", rough=0.2) == pytest.approx(10.0 * (1.0 + 0.2 * 2.0))
    assert cost("error", fault=3.0) == stage.FAILED
    assert cost("error", missed=2.0) == 3.0 * stage.FAILED
    with pytest.raises(InputError, match="settling"):
        stage.named("setling")


def test_a_search_never_ends_worse_than_it_began():
    aim = stage.named("error")
    found = stage.search(AXIS, AXIS.settings, PLAN, aim, stage.Budget(30, 1, 1, 3))
    assert found.costs[1] <= found.costs[0] and found.evaluations <= 30
    assert len(found.before) == 2 and len(found.fresh[0]) == 3
    assert found.costs[0] == max(stage.cost(aim, t, AXIS.settings) for t in found.before)
    own = {path.partition(".")[2] for path in stage.KNOBS["cascade"]}
    for name in AXIS.settings.controller._fields:
        same = getattr(found.tuned.controller, name) == getattr(found.start.controller, name)
        assert same or name in own
    assert found.tuned.load == found.start.load and found.tuned.together() == []
    # What is written is what was judged.
    again = stage.trials(AXIS, [found.tuned], PLAN, [1], 1)[0]
    assert again == found.after[0]
    for path in stage.KNOBS["cascade"]:
        before, after = found.start, found.tuned
        for part in path.split("."):
            before, after = getattr(before, part), getattr(after, part)
        assert 1.0 / 4.01 <= after / before <= 4.01


@pytest.mark.parametrize("other", machine.MACHINES[1:], ids=lambda m: m.name)
def test_the_gains_of_every_law_are_searched(other):
    settings = other.settings
    usual = planning.usual(settings)
    first = {name: getattr(usual, name)[:1] for name in ("start", "stage", "target", "hold")}
    plan = planning.plan(usual._replace(**first), settings)
    found = stage.search(other, settings, plan, stage.named("error"), stage.Budget(6))
    assert found.evaluations >= 5 and found.costs[1] <= found.costs[0] < stage.FAILED
    names = [line[0] for line in stage_files.table(found)][: len(stage.KNOBS[other.law.name])]
    assert names == list(stage.KNOBS[other.law.name])
    assert machine.as_toml(found.machine, found.tuned) and found.tuned.together() == []


def test_gains_that_cannot_work_cost_more_than_any_run():
    # A start at the edge of what the delays allow: the search goes back into what they do.
    edge = AXIS.settings.with_("controller.velocity", "54 V*s/m")
    aim = stage.named("error")
    found = stage.search(AXIS, edge, PLAN, aim, stage.Budget(10))
    assert found.tuned.together() == [] and math.isfinite(found.costs[1])


def test_the_command_writes_settings_that_run(tmp_path, monkeypatch, capsys):
    (tmp_path / "m.toml").write_text('machine = "axis"\n[load]\npayload = "0.2 kg"\n')
    words = ["macromicro", "tune", "axis", "--config", str(tmp_path / "m.toml")]
    words += ["--evaluations", "10", "--objective", "error", "--out", str(tmp_path / "out")]
    monkeypatch.setattr("sys.argv", [*words, "--json"])
    assert cli.main() == 0
    told = json.loads(capsys.readouterr().out)
    assert told == json.loads((tmp_path / "out/tuning.json").read_text())
    assert told["machine"] == "axis" and told["objective"]["name"] == "error"
    assert (tmp_path / "out/response.png").stat().st_size > 10_000
    found, settings = machine.load(tmp_path / "out/tuned.toml")
    assert found.name == "axis" and settings.load.payload == 0.2
    assert settings.controller.position == told["table"][0]["after"]
    for more, said in (
        (["--law", "pid"], "--law"),
        (["--benches", "3"], "--benches"),
        (["--benches", "0"], "--benches"),
        (["--robust", "--benches", "-3"], "--benches: '-3'; accepted: a whole number from 1"),
        (["--robust", "--benches", "0"], "--benches: '0'; accepted: a whole number from 1"),
        (["--robust", "--held-out", "-1"], "--held-out: '-1'; accepted: a whole number from 1"),
        (["--evaluations", "0"], "--evaluations: '0'; accepted: a whole number from 10"),
        (["--evaluations", "9"], "--evaluations: '9'; accepted: a whole number from 10"),
    ):
        monkeypatch.setattr("sys.argv", [*words, "--overwrite", *more])
        assert cli.main() == 2
        assert said in capsys.readouterr().err


def test_a_result_that_is_not_better_is_not_suggested(tmp_path, monkeypatch, capsys):
    """A hundred designs hold a better one than the sheets' gains; the start alone does not."""
    (tmp_path / "m.toml").write_text('machine = "axis"\n')
    told = {}
    for count in ("100", "10"):
        words = ["tune", "axis", "--config", str(tmp_path / "m.toml"), "--evaluations", count]
        monkeypatch.setattr("sys.argv", ["macromicro", *words, "--out", str(tmp_path / count)])
        assert cli.main() == 0
        told[count] = capsys.readouterr().out
        monkeypatch.setattr(
            stage,
            "minimise",
            lambda costs, start, *rest, **more: minimise(costs, start, 1, 0),
        )
    assert "none was better than the start" in told["10"] and "try: " not in told["10"]
    assert "none was better" not in told["100"] and "try: macromicro run" in told["100"]
    objective = [line for line in told["100"].splitlines() if line.startswith("objective")]
    assert len(objective) == 1 and "  penalty for overshoot" in told["100"]
