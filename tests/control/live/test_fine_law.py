"""A law of the micro-stage with a model of its own, in the live machine: it runs on, always."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from macromicro.control import micro
from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted
from macromicro.control.stage_law import Sample, Target
from macromicro.control.supervisor import Plan
from macromicro.programme import moves

from .follower import DT, QUICK_CONTROL, Follower, ready

CONTROL = QUICK_CONTROL.joined("inverse", "test")


def model(f: Follower):
    return f.s.drive.fine[0].memory.model


def test_it_drives_and_is_told_what_it_remembers() -> None:
    f = ready(control=CONTROL)
    f.ask(m.MoveMicro(1e-3))
    sent = [f.tick().ctrl for _ in range(30)]
    assert max(sent) > 1.9 and model(f).wire > 1.0


def test_where_it_drives_it_takes_one_step_a_period() -> None:
    f = ready(control=CONTROL)
    f.ask(m.MoveMicro(1e-3))
    for _ in range(30):
        f.tick()
    laws, drive = f.s.laws, f.s.drive
    f.tick()
    aim, seen = Target(1e-3, 0.0, 0.0, math.inf), Sample(f.s.time, f.s.seen.fine)
    _, kept, ctrl = micro.step(laws.micro, laws.fine, drive.fine, drive.integral, aim, seen, DT)
    assert f.s.drive.fine == kept and f.out.ctrl == ctrl


@pytest.mark.parametrize("end", [m.Disable(), m.MoveMacro(50.0)])
def test_its_model_cools_whatever_the_machine_does(end: object) -> None:
    f = ready(control=CONTROL)
    f.ask(m.MoveMicro(1e-3))
    for _ in range(100):
        f.tick()
    hot = model(f).wire
    f.ask(end)
    for _ in range(200):
        f.tick()
    assert 0.0 < model(f).wire < 0.9 * hot
    # It is stepped once a period, as a wire left alone cools.
    warm = model(f).wire
    f.tick()
    n = f.s.laws.fine[0].model.ladder
    flow = (warm - model(f).plates) / n.r1
    assert model(f).wire == pytest.approx(warm - flow * DT / n.c1, abs=0.02)


def test_a_programme_goes_on_with_it_and_leaves_it_behind() -> None:
    f = ready(control=CONTROL)
    f.ask(m.MoveMicro(1e-3))
    for _ in range(100):
        f.tick()
    before = model(f).wire
    f.ask(m.Disable())
    f.tick()
    f.ask(m.Enable())
    plan = Plan(
        np.full(2, np.nan),
        np.array([moves.MACRO, moves.MICRO]),
        np.array([50.0, 5e-4]),
        np.array([0.0, 0.05]),
        np.nan,
    )
    assert isinstance(f.ask(m.Programme(plan)), Accepted)
    f.tick()
    assert 0.0 < model(f).wire < before
    seen = set()
    for _ in range(1500):
        f.tick()
        seen.add(f.mode)
        work = f.s.work
        if hasattr(work, "progress") and math.isnan(work.over):
            assert work.progress.fine[0].memory.model.wire == model(f).wire
    assert {"moving macro", "moving micro"} <= {s.replace("-", " ").replace("_", " ") for s in seen}


def test_new_gains_keep_what_it_remembers_and_another_law_begins() -> None:
    f = ready(control=CONTROL)
    f.ask(m.MoveMicro(1e-3))
    for _ in range(50):
        f.tick()
    hot = model(f).wire
    assert isinstance(f.ask(m.SetGains((("fine.reach", 0.01),))), Accepted)
    assert model(f).wire == hot and f.s.laws.fine[0].reach == 0.01
    f.ask(m.Disable())
    assert isinstance(f.ask(m.SetGains((("micro_law", "pi"),))), Accepted)
    assert f.s.drive.fine == () and f.s.laws.fine == ()
    assert isinstance(f.ask(m.SetGains((("micro_law", "inverse"),))), Accepted)
    assert model(f).wire == 0.0


def turns(f: Follower, monkeypatch: pytest.MonkeyPatch, seconds: float, **tick: Any) -> list[int]:
    """How often the law had its turn, in each period."""
    found, now = list[int](), 0

    def counting(act: Any) -> Any:
        def counts(*given: Any) -> Any:
            nonlocal now
            now += 1
            return act(*given)

        return counts

    with monkeypatch.context() as patch:
        for name in ("step", "rest"):
            patch.setattr(micro, name, counting(getattr(micro, name)))
        for _ in range(round(seconds / DT)):
            now = 0
            f.tick(**tick)
            found.append(now)
    return found


@pytest.mark.parametrize("outcome", ["done", "stalled"])
def test_its_model_takes_one_step_in_the_period_that_ends_a_move_or_a_programme(
    outcome: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    noise = {"noise": 4e-4 if outcome == "stalled" else 0.0}
    f = ready(control=CONTROL)
    f.ask(m.MoveMicro(1e-3))
    assert set(turns(f, monkeypatch, 0.4, **noise)) == {1} and f.ends[-1].outcome == outcome
    f = ready(control=CONTROL)
    target, hold = np.array([5e-4]), np.array([0.05])
    f.ask(m.Programme(Plan(np.full(1, np.nan), np.array([moves.MICRO]), target, hold, np.nan)))
    found = turns(f, monkeypatch, 0.4, **noise)
    assert f.ends[-1].outcome == outcome
    # The supervisor's turn at the plan's end is dropped: the last move still settles.
    assert sorted(found) == [1] * (len(found) - 1) + [2]


def test_its_model_moves_on_while_the_hall_sensor_is_silent(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    f = ready(control=CONTROL)
    f.ask(m.MoveMicro(1e-3))
    f.run(0.02)
    assert set(turns(f, monkeypatch, 0.02, missing="h")) == {1}
