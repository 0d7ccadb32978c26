"""Programmes in the live machine."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from macromicro.control import supervisor
from macromicro.control.live import messages as m
from macromicro.control.supervisor import Plan
from macromicro.types import SAFE, Sample

from .bench import DT
from .follower import QUICK, QUICK_CONTROL, Follower, ready


def plan(*moves: tuple[int, float, float], start: float = math.nan, end: float = math.nan) -> Plan:
    stage, target, hold = (np.array(c, dtype=float) for c in zip(*moves, strict=True))
    starts = np.full(len(moves), math.nan)
    starts[0] = start
    return Plan(starts, stage.astype(np.int64), target, hold, end)


def test_the_schedule_and_the_efforts_are_the_supervisors() -> None:
    moves = plan((0, 60.0, 0.02), (1, 1e-3, 0.1), (0, 90.0, 0.0))
    f = ready()
    f.ask(m.Programme(moves))
    progress, start = supervisor.begin(0.0), f.s.time
    while f.s.motion is not None:
        f.tick()
        sample = Sample(f.s.time - start, math.floor(f.encoder), math.nan, 0.0, 1.0, 0.0)
        progress, command, out = supervisor.step(f.s.laws, moves, progress, sample, DT)
        if f.s.motion is not None:
            assert f.out.motor == out.motor
            assert f.command[:4] == command[:4]
    assert (f.ends[-1].outcome, f.mode) == ("done", "ready")
    assert f.tick() == SAFE


def test_targets_are_in_the_homed_frame() -> None:
    f = Follower(encoder=500.0, coordinate=0.0, trusted=True)
    f.tick()
    f.ask(m.Enable())
    f.ask(m.Programme(plan((0, 60.0, 0.0))))
    f.until("ready")
    assert f.encoder == pytest.approx(560.0, abs=2.0)
    assert f.ends[-1].outcome == "done"


def test_a_move_that_does_not_arrive_ends_it() -> None:
    f = ready()
    f.ask(m.Programme(plan((0, -130.0, 0.0), (1, 1e-3, 0.1))))
    for _ in range(400):
        f.see(0.0)
    assert [e.outcome for e in f.ends] == ["stalled"]
    assert not [e for e in f.events if e.to_mode == "moving-micro"]
    assert f.out == SAFE


def test_an_end_off_target_is_not_done() -> None:
    f = ready()
    f.ask(m.Programme(plan((1, 1e-3, 0.05))))
    for _ in range(200):
        f.see(0.0)  # the stage does not move
    assert [e.outcome for e in f.ends] == ["stalled"]
    assert f.ends[-1].evidence["error_mm"] == pytest.approx(1.0, abs=0.1)
    assert f.ends[-1].evidence["seconds"] == pytest.approx(0.05 + QUICK.fine.patience, abs=2 * DT)
    assert (f.mode, f.out) == ("stopped", SAFE)


@pytest.mark.parametrize("end", [math.nan, 0.002])
def test_a_last_fine_move_settles_behind_the_end_as_a_single_one_does(end: float) -> None:
    """Neither a short hold nor the timetable's end lets a stage that passes be on target."""
    f = ready()
    f.ask(m.Programme(plan((1, 1e-3, 0.002), end=end)))
    held = []
    while f.s.motion is not None:
        f.tick()
        held.append(abs(f.fine - 1e-3) <= QUICK.fine.band)
    assert [e.outcome for e in f.ends] == ["done"] and f.mode == "ready"
    assert sum(held) * DT >= QUICK.fine.dwell and all(held[-round(QUICK.fine.dwell / DT) :])
    assert abs(f.ends[-1].evidence["error_mm"]) <= 1e3 * QUICK.fine.band
    assert f.tick() == SAFE


def test_a_stop_behind_the_end_ends_it() -> None:
    f = ready()
    f.ask(m.Programme(plan((1, 1e-3, 0.002))))
    f.run(0.005)
    f.ask(m.Stop())
    assert (f.ends[-1].outcome, f.mode) == ("stopped", "holding")


def without_wait(**sequence: float) -> Follower:
    """The supervisor passes through the wait within the period of the arrival."""
    q = QUICK_CONTROL.sequence._replace(wait=0.0, **sequence)
    return ready(control=QUICK_CONTROL._replace(sequence=q))


@pytest.mark.parametrize("moves", [
    [(0, 60.0, 0.0)], [(0, 60.0, 0.0), (1, 1e-3, 0.05)], [(0, 60.0, 0.0), (0, 20.0, 0.0)],
    [(1, 1e-3, 0.05), (0, 60.0, 0.0)],
])  # fmt: skip
def test_without_a_wait_what_arrives_is_done(moves: list[tuple[int, float, float]]) -> None:
    f = without_wait()
    f.ask(m.Programme(plan(*moves)))
    f.run(0.5)
    assert [e.outcome for e in f.ends] == ["done"]
    arrivals = [e.evidence["move"] for e in f.events if e.cause == "arrived"]
    assert arrivals == [k for k, (stage, _, _) in enumerate(moves) if stage == 0]
    told = [e for e in f.events if e.kind == "mode"]
    assert all(a.to_mode == b.from_mode for a, b in itertools.pairwise(told))


@pytest.mark.parametrize("after", [(1, 1e-3, 0.1), (0, 10.0, 0.0), None])
def test_without_a_wait_what_does_not_arrive_has_stalled(
    after: tuple[int, float, float] | None,
) -> None:
    f = without_wait()
    f.ask(m.Programme(plan((0, 2000.0, 0.0), *([after] if after else []))))
    for _ in range(600):
        f.see(0.0)
    assert [e.outcome for e in f.ends] == ["stalled"]
    assert (f.ends[-1].evidence["move"], f.ends[-1].evidence["error_counts"]) == (0, 2000.0)
    assert not [e for e in f.events if e.to_mode == "moving-micro" or e.cause == "next move"][1:]
    assert f.out == SAFE


def test_what_the_timetable_cuts_off_is_told_and_not_done() -> None:
    f = ready()
    moves = plan((0, 2000.0, 0.0), (0, 20.0, 0.0), (1, 1e-3, 0.05))
    f.ask(m.Programme(moves._replace(start=np.array([0.0, 0.02, math.nan]))))
    f.run(0.5)
    assert [e.outcome for e in f.ends] == ["stalled"]
    found = f.ends[-1].evidence
    assert found["cut_off_move"] == 0
    assert found["cut_off_error_counts"] == pytest.approx(1800.0, abs=40.0)
    assert found["moves"] == 3 and abs(f.encoder - 20.0) <= 2.0  # it went on to its end
    assert [e.evidence["move"] for e in f.events if e.cause == "cut off"] == [0]


def test_moves_that_the_end_leaves_out_are_not_done() -> None:
    f = ready()
    moves = plan((0, 20.0, 0.0), (0, 40.0, 0.0), end=0.2)
    f.ask(m.Programme(moves._replace(start=np.array([0.0, 5.0]))))
    f.run(0.5)
    assert [e.outcome for e in f.ends] == ["stalled"]
    assert f.ends[-1].evidence["moves_left"] == 1


def test_a_scheduled_programme_waits_for_its_time_and_ends_by_it() -> None:
    f = ready()
    f.ask(m.Programme(plan((0, 40.0, 0.05), start=0.02, end=0.1)))
    f.run(0.018)
    assert f.out == SAFE
    f.run(0.1)
    assert [e.outcome for e in f.ends] == ["done"]
    assert f.ends[-1].evidence["seconds"] == pytest.approx(0.1, abs=2 * DT)


def test_a_stop_in_between_ends_all_of_it() -> None:
    f = ready()
    f.ask(m.Programme(plan((0, 60.0, 0.0), (1, 1e-3, 1.0), (0, 90.0, 0.0))))
    f.until("moving-micro")
    f.run(0.05)
    f.ask(m.Stop())
    assert (f.ends[-1].outcome, f.mode) == ("stopped", "holding")
    f.run(1.0)
    assert f.mode == "holding" and f.command.macro_active == 0.0


@pytest.mark.parametrize(("start", "end"), [(math.nan, 0.02), (1.0, 0.02)])
def test_a_schedule_that_ends_too_early_is_not_done(start: float, end: float) -> None:
    """Its only move is under way, or has not begun."""
    f = ready()
    f.ask(m.Programme(plan((0, 2000.0, 0.0), start=start, end=end)))
    f.run(0.5)
    assert [e.outcome for e in f.ends] == ["stalled"]
    assert f.mode == "stopped" and f.out == SAFE


def scheduled(*starts: float, end: float = math.nan) -> Plan:
    """Macro moves at these times [s], each in the other direction: far, near, far, ..."""
    moves = plan(*((0, 2000.0 if k % 2 else 20.0, 0.0) for k in range(len(starts))), end=end)
    return moves._replace(start=np.array(starts))


def test_the_patience_with_a_move_begins_with_that_move() -> None:
    """The second one begins long after the first one's patience and is cut off within its own."""
    f = ready()
    f.ask(m.Programme(scheduled(0.0, 0.5, 0.6, end=1.0)))
    f.run(0.7)
    assert [e.evidence["move"] for e in f.events if e.cause == "cut off"] == [1]
    assert not f.ends and f.mode != "stopped"


def test_of_several_moves_that_were_cut_off_the_first_is_told() -> None:
    f = ready()
    f.ask(m.Programme(scheduled(0.0, 0.15, 0.18, 0.21, 0.24, end=0.6)))
    f.run(0.7)
    cut = [e.evidence["move"] for e in f.events if e.cause == "cut off"]
    assert len(cut) > 1 and f.ends[-1].evidence["cut_off_move"] == cut[0]


def test_a_reset_that_was_asked_for_just_before_is_given() -> None:
    f = ready()
    f.ask(m.Zero())
    f.ask(m.Programme(plan((0, 60.0, 0.0))))
    assert [f.tick().laser_reset for _ in range(3)] == [1.0, 0.0, 0.0]


@pytest.mark.parametrize(("off", "outcome"), [(2.0, "done"), (-2.0, "done"), (3.0, "stalled"),
                                              (-3.0, "stalled")])  # fmt: skip
def test_a_carriage_that_leaves_its_last_target_has_not_done_it(off: float, outcome: str) -> None:
    f = ready()
    f.ask(m.Programme(plan((0, 20.0, 0.2))))
    f.until("settling")
    f.encoder = 20.0 + off
    f.run(0.5)
    assert [e.outcome for e in f.ends] == [outcome]
    assert f.ends[-1].evidence["error_counts"] == -off


def test_the_end_waits_for_the_window_that_is_under_way() -> None:
    """Windows of 4 ms: where a hold ends within one, what is reported is the full one."""
    seconds = []
    for hold in (0.0485, 0.0495, 0.0505):
        f = ready()
        f.ask(m.Programme(plan((1, 1e-3, hold))))
        f.run(0.1)
        assert f.ends[-1].outcome == "done"
        seconds.append(f.ends[-1].evidence["seconds"])
    assert seconds == [pytest.approx(seconds[0])] * 3 and seconds[0] > 0.0505


def test_set_points_of_a_profile_are_one_move_that_is_not_cut_off() -> None:
    """They follow one another by the clock; one event tells of them all."""
    rows = [(0, 20.0, 0.0)] + [(0, float(k), DT) for k in range(21, 61)] + [(1, 1e-3, 0.05)]
    moves = plan(*rows)
    moves.start[2:41] = -math.inf
    f = ready()
    f.ask(m.Programme(moves))
    f.run(3.0)
    assert [e.outcome for e in f.ends] == ["done"]
    begun = [e.evidence["move"] for e in f.events if e.kind == "move"]
    assert begun == [0, 1, 41]
    assert f.encoder == pytest.approx(60.0, abs=2.0)


def test_a_profile_that_does_not_arrive_stalls() -> None:
    moves = plan(*[(0, 2000.0 + k, DT) for k in range(30)])
    moves.start[1:] = -math.inf
    f = ready()
    f.ask(m.Programme(moves))
    for _ in range(600):
        f.see(0.0)
    assert [e.outcome for e in f.ends] == ["stalled"] and f.ends[-1].evidence["move"] == 29
