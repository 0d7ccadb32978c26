"""The live machine on the twin. Truth is used only to judge what it reports."""

from __future__ import annotations

import math

import numpy as np
import pytest

from macromicro.control.live import brake
from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Refused
from macromicro.control.supervisor import Plan
from macromicro.rig.codes import OK
from macromicro.types import SAFE

from .bench import PITCH, Bench


@pytest.fixture(scope="module")
def bench() -> Bench:
    """Enabled and homed, from 2 mm above the stop."""
    b = Bench(-8e-3, seed=3)
    b.tick()
    assert isinstance(b.ask(m.MoveTo(0.01)), Refused)
    assert b.ask(m.Enable()) == Accepted(0)
    refused = b.ask(m.MoveTo(0.01))
    assert isinstance(refused, Refused) and refused.remedy == "home first"
    assert b.ask(m.Home()) == Accepted(1)
    end = b.wait(20.0)
    assert (end.id, end.outcome) == (1, "done")
    return b


def test_homing_finds_the_stop_and_names_the_place(bench: Bench) -> None:
    stop = bench.ends[0].evidence["stop_raw_counts"]
    # The stop is at -10 mm; its rubber gives under the push, by less than half a millimetre.
    assert -10.5e-3 / PITCH <= stop <= -10e-3 / PITCH
    q = bench.p.settings.homing
    assert bench.s.frame.offset == stop + q.back_off - q.coordinate
    assert bench.s.frame.trusted
    # The guard takes 3.6 V for a push that must move the carriage: homing stays below.
    assert bench.watch.fault == OK and q.volts < 3.6


def test_an_absolute_move_arrives(bench: Bench) -> None:
    before = len(bench.events)
    reply = bench.ask(m.MoveTo(0.042123))
    assert isinstance(reply, Accepted)
    end = bench.wait(30.0)
    assert (end.id, end.outcome, bench.mode) == (reply.id, "done", "holding")
    assert 7e-6 < end.uncertainty < 15e-6 and end.evidence["by"] == "laser"
    assert abs(end.position - 0.042123) < 20e-6  # one noisy Hall reading; its mean within 10 um
    assert abs(bench.true_position() - end.position) <= end.uncertainty
    assert abs(bench.true_position() - 0.042123) <= 20e-6
    modes = [e.to_mode for e in bench.events[before:] if e.kind == "mode"]
    assert modes == ["moving-macro", "settling", "moving-micro", "holding"]
    assert 0.3e-3 <= bench.s.drive.micro_reference <= 3.5e-3


def test_a_short_move_is_the_micro_stages_alone(bench: Bench) -> None:
    bench.ask(m.MoveTo(0.02))
    start = bench.wait(30.0)
    carriage, count = bench.twin.truth().carriage, bench.s.seen.encoder
    true = bench.true_position()
    bench.ask(m.MoveBy(0.0002))
    end = bench.wait(20.0)
    assert (start.outcome, end.outcome) == ("done", "done")
    assert bench.s.target.whole == pytest.approx(
        0.0202, abs=1e-12
    )  # from the target, not a reading
    assert bench.s.seen.encoder == count
    assert bench.twin.truth().carriage == pytest.approx(carriage, abs=2e-6)
    assert bench.true_position() - true == pytest.approx(0.0002, abs=20e-6)


def test_jogs_run_at_their_speed_and_end_where_told(bench: Bench) -> None:
    bench.ask(m.MoveMacro(300))
    bench.wait(20.0)
    reply = bench.ask(m.Jog("macro", 0.02))
    assert isinstance(reply, Accepted)
    bench.run(0.5)
    before = bench.twin.truth().carriage
    bench.run(0.5)
    assert bench.twin.truth().carriage - before == pytest.approx(0.01, abs=1e-3)
    assert bench.ask(m.Jog("macro", 0.0)) == Accepted(reply.id)
    end = bench.wait(3.0)
    assert (end.id, end.outcome, bench.mode) == (reply.id, "stopped", "stopped")
    reply = bench.ask(m.Jog("micro", 0.0004))
    bench.run(1.5)
    assert bench.twin.truth().micro == pytest.approx(0.6e-3, abs=60e-6)
    bench.ask(m.Jog("micro", 0.0))
    assert (bench.ends[-1].id, bench.ends[-1].outcome, bench.mode) == (
        reply.id if isinstance(reply, Accepted) else 0, "stopped", "holding",
    )  # fmt: skip


def test_a_jog_ends_at_the_soft_limit(bench: Bench) -> None:
    bench.ask(m.MoveMacro(-60))
    bench.wait(20.0)
    bench.ask(m.Jog("macro", -0.02))
    end = bench.wait(10.0)
    assert end.outcome == "limit"
    assert bench.s.seen.encoder - bench.s.frame.offset == pytest.approx(-130.0, abs=2.0)
    assert isinstance(bench.ask(m.Jog("micro", 0.0)), Refused)


@pytest.mark.parametrize("after", [0.06, 0.3])
def test_a_stop_ends_within_the_stated_distance(bench: Bench, after: float) -> None:
    bench.ask(m.MoveMacro(100))
    bench.wait(20.0)
    bench.ask(m.MoveMacro(2500))
    bench.run(after)
    before, speed = bench.twin.truth().carriage, bench.s.seen.speed
    assert speed > 1000.0
    assert bench.ask(m.Stop()) == Accepted(0)
    assert isinstance(bench.ask(m.MoveMacro(100)), Refused)  # it still moves
    end = bench.wait(3.0)
    allowed = brake.distance(bench.p, speed)
    assert end.outcome == "stopped"
    assert end.evidence["allowed_counts"] == allowed
    assert 0.0 < (bench.twin.truth().carriage - before) / PITCH <= allowed
    assert abs(bench.twin.truth().speed) < 1e-4
    bench.tick()
    assert bench.given == SAFE
    assert bench.s.frame.trusted


def test_a_programme_runs_and_can_be_stopped_in_between(bench: Bench) -> None:
    def plan(*moves: tuple[int, float, float]) -> Plan:
        stage, target, hold = (np.array(c) for c in zip(*moves, strict=True))
        return Plan(np.full(len(moves), math.nan), stage.astype(np.int64), target, hold, math.nan)

    before = len(bench.events)
    reply = bench.ask(m.Programme(plan((0, 500.0, 0.0), (1, 1e-3, 1.0), (1, 1.5e-3, 1.5))))
    end = bench.wait(30.0)
    assert isinstance(reply, Accepted)
    assert (end.id, end.outcome, bench.mode) == (reply.id, "done", "ready")
    moves = [e.evidence for e in bench.events[before:] if e.kind == "move"]
    assert [e["move"] for e in moves] == [0, 1, 2]
    assert [e.get("target_counts", e.get("target_mm")) for e in moves] == [500.0, 1.0, 1.5]
    assert abs(end.evidence["error_mm"]) <= 0.010
    bench.ask(m.Programme(plan((1, 1e-3, 5.0), (0, 700.0, 0.0))))
    bench.run(2.0)
    bench.ask(m.Stop())
    assert (bench.ends[-1].outcome, bench.mode) == ("stopped", "holding")
    bench.run(0.5)
    assert bench.twin.truth().micro == pytest.approx(1e-3, abs=30e-6)


def test_emergency_in_a_move_is_safe_in_the_very_next_step() -> None:
    b = Bench(0.05, coordinate=700.0, trusted=True)
    b.tick()
    b.ask(m.Enable())
    b.ask(m.Fan(True))
    b.ask(m.MoveMacro(1500))
    b.run(0.1)
    assert b.given.motor > 3.0 and b.given.fan == 1.0
    b.ask(m.EmergencyStop())
    assert (b.ends[-1].outcome, b.mode) == ("emergency", "disabled")
    assert b.ends[-1].uncertainty == math.inf
    b.tick()
    assert b.out == SAFE and b.given == SAFE
    b.run(0.2)
    assert b.out == SAFE and abs(b.twin.truth().speed) < 1e-4
    assert isinstance(b.ask(m.Enable()), Accepted)
    assert isinstance(b.ask(m.MoveMacro(1500)), Refused)  # home first


@pytest.mark.parametrize("target", [400, -100])
def test_a_stop_near_the_end_of_a_move_goes_no_farther_than_the_move(target: int) -> None:
    """The brake's own way from there may lead beyond the target, which may be a soft limit."""
    for k in range(8):
        b = Bench(0.02, coordinate=200.0, trusted=True)
        b.tick()
        b.ask(m.Enable())
        own = b.p.settings.limits
        b.ask(m.SetLimits(own._replace(macro_low=min(target, 0), macro_high=max(target, 250))))
        b.ask(m.MoveMacro(target))
        way = math.copysign(1.0, target - 200.0)
        b.run(0.02 * k)
        while (target - b.s.seen.encoder + b.s.frame.offset) * way > 40.0 - 5.0 * k:
            b.tick()
        b.ask(m.Stop())
        beyond = -math.inf
        ends = len(b.ends)
        while len(b.ends) == ends:
            b.tick()
            beyond = max(beyond, (b.s.seen.encoder - b.s.frame.offset - target) * way)
        assert b.ends[-1].outcome == "stopped"
        assert beyond <= b.s.laws.sequence.tolerance
