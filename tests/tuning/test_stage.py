"""Gains of a machine of one stage by search."""

import json
import math

import pytest

from macromicro import cli
from macromicro.errors import InputError
from macromicro.machines import machine, planning
from macromicro.machines.trial import Trial
from macromicro.schema.par import value_at
from macromicro.tuning import search, stage, words
from macromicro.tuning.evolution import minimise
from macromicro.tuning.search import Budget
from macromicro.tuning.stage import Stage
from macromicro.tuning.subject import FAILED

AXIS = machine.MACHINES[0]
PLAN = planning.plan(planning.usual(AXIS.settings), AXIS.settings)
GOOD = Trial(0.0, 0.0, 0.02, 0.01, 30.0, 10.0, 0.0, 5.0, 6.0, 3.0, 0.0)


def searched(settings, name, budget, weights=()):
    return search.search(Stage(AXIS, settings, PLAN), name, dict(weights), budget)


def test_objectives_and_penalties_by_hand():
    settings = AXIS.settings.with_("arrival.tolerance", "50 um")
    subject = Stage(AXIS, settings, PLAN)

    def cost(name, weights=(), **changes):
        found = GOOD._replace(**changes)._asdict()
        return subject.objective(name).cost(found, GOOD._asdict(), dict(weights))

    assert cost("settling") == pytest.approx(0.01 + 1e-3 * 10.0 / 50.0)
    assert cost("error") == 10.0 and cost("rest") == 6.0
    assert cost("error", overshoot=25.0) == pytest.approx(10.0 * 1.25)
    assert cost("error", {"overshoot": 2.0}, overshoot=25.0) == pytest.approx(10.0 * 2.0)
    assert cost("error", rough=0.2) == pytest.approx(10.0 * (1.0 + 0.2 * 2.0))
    assert cost("error", fault=3.0) == FAILED
    assert cost("error", missed=2.0) == 3.0 * FAILED
    assert cost("error", rms_error=math.nan) == FAILED
    with pytest.raises(InputError, match="settling"):
        subject.objective("setling")


def test_a_search_never_ends_worse_than_it_began():
    found = searched(AXIS.settings, "error", Budget(30, 1, 2, 3))
    first, best = found.first, found.best
    assert best.cost <= first.cost and found.evaluations <= 30
    assert len(first.runs) == 2 and len(found.fresh.runs[0]) == 3
    own = {path.partition(".")[2] for path in stage.KNOBS["cascade"]}
    for name in AXIS.settings.controller._fields:
        same = getattr(best.settings.controller, name) == getattr(AXIS.settings.controller, name)
        assert same or name in own
    assert best.settings.load == AXIS.settings.load and best.settings.together() == []
    # What is written is what was judged.
    assert found.subject.run(best.settings, 1) == best.runs[0]
    for path in stage.KNOBS["cascade"]:
        ratio = value_at(best.settings, path) / value_at(first.settings, path)
        assert 1.0 / 4.01 <= ratio <= 4.01


def test_drawn_machines_have_the_law_and_limits_of_the_gains_that_are_judged():
    subject = Stage(AXIS, AXIS.settings, PLAN)
    _, (other,) = search.draw(subject, 1, 4)
    knobs = subject.knobs(AXIS.settings)
    gains = subject.applied(AXIS.settings, [1.5 * knob.present for knob in knobs])
    made = subject.under(gains, other)
    assert made.controller == gains.controller and made.guard == gains.guard
    assert made.friction == other.friction != AXIS.settings.friction


@pytest.mark.parametrize("other", machine.MACHINES[1:], ids=lambda m: m.name)
def test_the_gains_of_every_law_are_searched(other):
    settings = other.settings
    usual = planning.usual(settings)
    first = {name: getattr(usual, name)[:1] for name in ("start", "stage", "target", "hold")}
    plan = planning.plan(usual._replace(**first), settings)
    subject = Stage(other, settings, plan)
    assert subject.paths == stage.KNOBS[other.law.name]
    found = search.search(subject, "error", {}, Budget(6))
    assert found.evaluations >= 5 and found.best.cost <= found.first.cost < FAILED
    names = [row.name for row in words.rows(found, [(), ()])][: len(subject.paths)]
    assert names == list(subject.paths)
    assert subject.as_toml(found.best.settings) and found.best.settings.together() == []


def test_gains_that_cannot_work_cost_more_than_any_run():
    # A start at the edge of what the delays allow: the search goes back into what they do.
    edge = AXIS.settings.with_("controller.velocity", "54 V*s/m")
    found = searched(edge, "error", Budget(10))
    assert found.best.settings.together() == [] and found.best.cost < FAILED


def test_gains_that_are_not_allowed_are_not_tried():
    subject = Stage(AXIS, AXIS.settings, PLAN, lambda settings: settings == AXIS.settings)
    found = search.search(subject, "error", {}, Budget(20))
    assert found.best is found.first and not found.better


def test_a_small_modulus_margin_is_told():
    wild = AXIS.settings.with_("controller.integral", "500 1/s")
    subject = Stage(AXIS, wild, PLAN)
    margins = {margin.name: margin.value for margin in subject.margins(wild)}
    assert margins["modulus"] < 0.5
    (text,) = subject.doubts(wild, {})
    assert f"modulus margin {margins['modulus']:.2g} is below 0.5" in text
    assert not Stage(AXIS, AXIS.settings, PLAN).doubts(AXIS.settings, {})


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
    assert "modulus margin" in (tmp_path / "out/tuning.html").read_text()
    found, settings = machine.load(tmp_path / "out/tuned.toml")
    assert found.name == "axis" and settings.load.payload == 0.2
    best = told["versions"].index(told["best"])
    assert settings.controller.position == told["table"][0]["values"][best]
    for more, said in (
        (["--law", "pid"], "--law"),
        (["--benches", "3"], "--benches"),
        (["--robust", "--benches", "-3"], "--benches: '-3'; accepted: a whole number from 2"),
        (["--robust", "--held-out", "0"], "--held-out: '0'; accepted: a whole number from 2"),
        (["--evaluations", "0"], "--evaluations: '0'; accepted: a whole number from 1"),
        (["--penalty", "saturated=1"], "--penalty saturated: unknown penalty"),
    ):
        monkeypatch.setattr("sys.argv", [*words, "--overwrite", *more])
        assert cli.main() == 2
        assert said in capsys.readouterr().err
    monkeypatch.setattr("sys.argv", [w if w != "axis" else "wire" for w in words])
    assert cli.main() == 2
    assert "Leave the stage out" in capsys.readouterr().err


@pytest.mark.slow
def test_a_result_that_is_not_better_is_not_suggested(tmp_path, monkeypatch, capsys):
    """A hundred designs hold a better one than the sheets' gains; the start alone does not."""
    (tmp_path / "m.toml").write_text('machine = "axis"\n')
    told = {}
    for count in ("100", "10"):
        words = ["tune", "--config", str(tmp_path / "m.toml"), "--evaluations", count]
        monkeypatch.setattr("sys.argv", ["macromicro", *words, "--out", str(tmp_path / count)])
        assert cli.main() == 0
        told[count] = capsys.readouterr().out
        monkeypatch.setattr(
            search, "minimise", lambda costs, start, *rest, **more: minimise(costs, start, 1, 0)
        )
    assert "No design was better than the start" in told["10"] and "try: " not in told["10"]
    assert "No design" not in told["100"] and "try: macromicro run" in told["100"]
