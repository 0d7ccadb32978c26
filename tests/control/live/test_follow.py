"""Where a stage goes that follows set points, when it is done, and when it has stalled."""

from __future__ import annotations

import math

import pytest

from macromicro.control.live import _steering, following
from macromicro.control.live import messages as m
from macromicro.control.live.accept import BUSY
from macromicro.control.live.messages import Accepted, Refused

from .bench import DT, PITCH, Machine, homed
from .follower import QUICK, QUICK_CONTROL, Follower, hall, ready

HOLD = 1.0
START = 100.0  # counts of the homed frame
PATIENT = QUICK._replace(jogging=QUICK.jogging._replace(patience=30.0))


def put(machine: Machine, position: float) -> None:
    machine.s, notices = following.take_set_point(machine.p, machine.s, position, 0.0, 0.0)
    machine.note(notices)


def following_macro(machine: Machine, counts: float) -> None:
    """The carriage has begun to follow one set point, which is the last."""
    machine.ask(m.Follow("macro", HOLD))
    put(machine, counts * PITCH)
    machine.ask(m.EndFollow())


@pytest.mark.parametrize("goal", [START + 40.0, START - 40.0])
def test_the_carriage_goes_from_where_it_stands_in_the_homed_frame(goal: float) -> None:
    f = ready(coordinate=START)
    following_macro(f, goal)
    between = sorted((0.0, goal - START))
    while not f.ends:
        f.tick()
        if f.mode == "moving-macro":
            assert between[0] - 1e-6 <= f.command.macro_reference <= between[1] + 1e-6
            assert (f.command.macro_active, f.out.ctrl) == (1.0, 0.0)
    assert (f.ends[0].outcome, f.mode) == (m.DONE, "ready")
    left = goal - START - f.encoder
    assert f.ends[0].evidence["error_counts"] == pytest.approx(left, abs=1.0)
    assert abs(left) <= QUICK_CONTROL.sequence.tolerance


def test_from_beyond_a_soft_limit_it_comes_back() -> None:
    limits = QUICK.limits._replace(macro_low=START)
    f = ready(live=QUICK._replace(limits=limits), coordinate=START - 30.0)
    following_macro(f, START + 10.0)
    f.tick()
    assert f.command.macro_reference == pytest.approx(0.0, abs=0.1)
    while not f.ends:
        f.tick()
    assert f.ends[0].outcome == m.DONE and f.encoder == pytest.approx(40.0, abs=2.0)


def test_the_micro_stage_reaches_the_speed_of_a_jog_soon() -> None:
    f = ready()
    f.ask(m.Follow("micro", HOLD))
    put(f, 0.4e-3)
    f.run(_steering.START + 3.0 * _steering.RISE)
    speed = f.s.work.track.aim.velocity  # type: ignore[union-attr]
    assert speed == pytest.approx(QUICK.jogging.micro, rel=1e-3)


def test_a_carriage_that_stands_and_is_pushed_has_stalled_after_its_patience() -> None:
    machine = homed(live=QUICK, control=QUICK_CONTROL)
    machine.ask(m.Follow("macro", HOLD))
    put(machine, 0.05)
    pushed = 0.0
    machine.see(0.0)
    while machine.mode == "moving-macro":
        machine.see(0.0)
        leans = machine.command.macro_reference > QUICK_CONTROL.sequence.tolerance
        pushed += DT * leans
    machine.see(0.0, seconds=QUICK.brake.patience)
    (end,) = machine.ends
    assert end.outcome == m.STALLED and machine.mode == "stopped"
    assert pushed == pytest.approx(QUICK.jogging.patience, abs=3 * DT)


def test_periods_without_a_reading_do_not_count_as_stalled() -> None:
    machine = homed(live=QUICK)
    machine.ask(m.Follow("macro", HOLD))
    put(machine, 0.05)
    machine.see(math.nan)
    machine.see(0.0, seconds=0.02)
    machine.see(math.nan, seconds=2 * QUICK.jogging.patience)
    assert not machine.ends
    machine.see(0.0, seconds=2 * QUICK.jogging.patience)
    assert machine.ends[0].outcome == m.STALLED


def test_a_carriage_that_moves_far_behind_has_not_stalled() -> None:
    machine = homed(live=QUICK)
    machine.ask(m.Follow("macro", HOLD))
    put(machine, 0.05)
    for k in range(round(4 * QUICK.jogging.patience / DT)):
        machine.see(0.25 * k)
    assert not machine.ends and machine.mode == "moving-macro"


def test_a_carriage_that_stands_beside_the_last_set_point_has_stalled() -> None:
    machine = homed(live=PATIENT, control=QUICK_CONTROL)
    following_macro(machine, 8.0)
    began = machine.s.time
    while not machine.ends:
        machine.see(0.0)
    (end,) = machine.ends
    assert (end.outcome, end.evidence["error_counts"]) == (m.STALLED, 8.0)
    assert machine.s.time - began >= QUICK_CONTROL.sequence.patience
    machine.see(0.0)
    assert machine.mode != "moving-macro"


def test_the_micro_stage_is_led_by_no_more_than_its_lead() -> None:
    machine = homed(live=QUICK)
    machine.ask(m.Follow("micro", HOLD))
    put(machine, 3e-3)
    furthest = 0.0
    for _ in range(900):
        machine.see(hall=hall(0.1e-3))
        furthest = max(furthest, machine.command.micro_reference - machine.s.seen.fine)
    assert furthest == pytest.approx(QUICK.jogging.micro_lead)


def at_rest(goal: float, noise: float) -> Follower:
    """The micro-stage at its last set point, whose sensor reads too much."""
    f = ready()
    f.ask(m.Follow("micro", HOLD))
    put(f, goal)
    for _ in range(980):
        f.tick(noise=noise)
    f.ask(m.EndFollow())
    return f


def test_the_micro_stage_is_done_once_it_has_dwelt() -> None:
    f = at_rest(0.2e-3, 2e-6)
    began = f.s.time
    while not f.ends:
        f.tick(noise=2e-6)
    (end,) = f.ends
    assert (end.outcome, f.mode) == (m.DONE, "holding")
    assert f.s.time - began == pytest.approx(QUICK.fine.dwell, abs=2 * DT)
    assert end.evidence["error_mm"] == pytest.approx(-2e-3, rel=0.01)


def test_the_micro_stage_that_stays_off_its_set_point_has_stalled() -> None:
    off = 3.0 * QUICK.fine.band
    f = at_rest(0.2e-3, off)
    began = f.s.time
    while not f.ends:
        f.tick(noise=off)
    (end,) = f.ends
    assert (end.outcome, f.mode) == (m.STALLED, "stopped")
    assert f.s.time - began == pytest.approx(QUICK.fine.patience, abs=2 * DT)


def test_the_micro_stage_follows_only_on_a_carriage_that_rests() -> None:
    f = ready()
    f.ask(m.MoveMacro(300))
    f.tick()
    assert f.ask(m.Follow("micro", 0.1)) == BUSY
    f = ready(live=QUICK._replace(supersede=1))
    f.ask(m.MoveMacro(300))
    f.tick()
    moving = Refused("the carriage is moving", "stop it first")
    assert f.ask(m.Follow("micro", 0.1)) == moving
    f.ask(m.Disable())
    disabled = f.ask(m.Follow("macro", 0.1))
    assert isinstance(disabled, Refused) and disabled.reason == "the positioner is disabled"
    assert f.ask(m.Follow("micro", 0.1)) == disabled
    f.ask(m.Enable())
    f.ask(m.MoveMacro(0))
    f.tick()
    assert isinstance(f.ask(m.Follow("macro", 0.1)), Accepted)
