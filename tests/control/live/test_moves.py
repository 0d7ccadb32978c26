"""When a move is done, and when it is not."""

from __future__ import annotations

import math

import pytest

from macromicro.control import macro
from macromicro.control.arrival import Sequence
from macromicro.control.live import _moves
from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted
from macromicro.control.settings import Control
from macromicro.types import SAFE, Sample
from tests.control.errors import by_error

from .bench import DT, PITCH, homed
from .follower import QUICK, QUICK_CONTROL, hall, ready

RESTING = 0.05


def test_a_macro_move_is_done_after_dwell_and_wait() -> None:
    machine = homed()
    assert machine.ask(m.MoveMacro(100)) == Accepted(1)
    machine.see(0.0, seconds=1.0)
    assert machine.mode == "moving-macro" and machine.out.motor > 3.0
    machine.see(98.0, seconds=0.19)
    assert machine.mode == "moving-macro"
    machine.see(98.0, seconds=0.02)
    assert machine.mode == "settling"
    machine.see(98.0, seconds=1.97)
    assert machine.mode == "settling" and machine.out == SAFE and not machine.ends
    machine.see(98.0, seconds=0.03)
    assert machine.mode == "ready"
    (end,) = machine.ends
    assert (end.id, end.outcome) == (1, "done")
    assert end.position == pytest.approx(98 * PITCH, abs=20e-6)
    assert end.uncertainty == PITCH / 2


def test_the_effort_is_the_macro_laws() -> None:
    machine = homed()
    machine.ask(m.MoveMacro(100))
    memory = macro.rest(0.0)
    for encoder in (0.0, 3.0, 10.0, 30.0):
        memory, volts = by_error(machine.s.laws.macro, memory, 100.0 - encoder, 1e-3)
        assert machine.see(encoder).motor == volts
        assert machine.command[:2] == (100.0, 1.0)


def test_one_reading_off_target_begins_the_dwell_again() -> None:
    machine = homed()
    machine.ask(m.MoveMacro(100))
    for off in (103.0, math.nan):
        machine.see(off)
        machine.see(100.0, seconds=0.15)
        assert machine.mode == "moving-macro"


def test_a_macro_move_out_of_patience_has_stalled() -> None:
    machine = homed(control=Control(sequence=Sequence(patience=1.0)))
    machine.ask(m.MoveMacro(100))
    machine.see(50.0, seconds=1.5)
    assert [(e.id, e.outcome) for e in machine.ends] == [(1, "stalled")]
    assert machine.mode == "stopped" and machine.out == SAFE


@pytest.mark.parametrize("place", [90.0, 110.0])
def test_a_carriage_that_leaves_while_settling_is_sent_back(place: float) -> None:
    machine = homed()
    machine.ask(m.MoveMacro(100))
    machine.see(100.0, seconds=0.3)
    machine.see(place, seconds=2.0)
    assert machine.mode == "moving-macro"
    assert machine.events[-1].cause == "drifted"
    machine.see(100.0, seconds=2.3)
    assert machine.ends[-1].outcome == "done"


def test_a_micro_move_is_done_when_the_means_have_stayed_in_the_band() -> None:
    machine = homed()
    machine.ask(m.MoveMicro(1e-3))
    machine.see(hall=hall(1.02e-3), seconds=3.0)  # 20 um off
    assert machine.mode == "moving-micro" and not machine.ends
    for _ in range(10):  # in the band, out of it, in it: never long enough
        machine.see(hall=hall(1e-3), seconds=0.3)
        machine.see(hall=hall(1.05e-3), seconds=0.1)
    assert machine.mode == "moving-micro" and not machine.ends
    machine.see(hall=hall(1.004e-3), seconds=0.7)
    (end,) = machine.ends
    assert (end.outcome, machine.mode) == ("done", "holding")
    assert end.evidence["error_mm"] == pytest.approx(-0.004, abs=1e-6)
    assert machine.command[2:4] == (1e-3, 1.0) and machine.out.ctrl > 0.0


def test_a_hall_sensor_that_stands_is_no_arrival() -> None:
    machine = homed()
    machine.ask(m.MoveMicro(1e-3))
    reading = Sample(0.0, 0.0, hall(1e-3), 0.0, 1.0, 0.0)
    for _ in range(2000):
        machine.show(reading._replace(t=machine.s.time + DT))
    assert machine.mode == "moving-micro" and not machine.ends
    machine.see(hall=hall(1e-3), seconds=0.6)
    assert [e.outcome for e in machine.ends] == ["done"]


def test_noise_within_the_windows_is_averaged() -> None:
    machine = homed()
    machine.ask(m.MoveMicro(1e-3))
    for k in range(700):
        machine.see(hall=hall(1e-3 + (0.05e-3 if k % 2 else -0.05e-3)))
    assert [e.outcome for e in machine.ends] == ["done"]


def test_a_micro_move_out_of_patience_has_stalled_and_cools() -> None:
    machine = homed()
    machine.ask(m.MoveMicro(2e-3))
    machine.see(hall=hall(1.5e-3), seconds=21.0)
    assert [(e.id, e.outcome) for e in machine.ends] == [(1, "stalled")]
    assert machine.mode == "stopped" and machine.out == SAFE


def test_an_absolute_move_takes_the_rest_from_where_the_carriage_stands() -> None:
    f = ready()
    f.ask(m.MoveTo(0.0201))
    f.until("settling")
    f.encoder -= 2.0  # within the tolerance, but not on the count
    f.until("moving-micro")
    place = f.s.seen.encoder
    assert f.s.drive.micro_reference == pytest.approx(0.0201 - place * PITCH, abs=1e-12)
    f.until("holding")
    assert f.ends[-1].outcome == "done"
    assert f.ends[-1].position == pytest.approx(0.0201, abs=1e-5)


def test_a_count_lost_under_the_micro_stage_is_made_up_for() -> None:
    f = ready()
    f.ask(m.MoveTo(0.0201))
    f.until("moving-micro")
    before = f.s.drive.micro_reference
    f.encoder += 1.0
    f.until("holding")
    assert f.s.drive.micro_reference == pytest.approx(before - PITCH, abs=1e-12)
    assert f.ends[-1].position == pytest.approx(0.0201, abs=1e-5)


def test_a_carriage_out_of_the_micro_stages_reach_is_no_success() -> None:
    f = ready()
    f.ask(m.MoveTo(0.0201))
    f.until("moving-micro")
    f.encoder += 100.0
    f.run(0.5)
    assert f.ends[-1].outcome == "stalled" and f.out == SAFE
    left = 0.0201 - (f.s.seen.encoder - f.s.frame.offset) * PITCH
    assert f.ends[-1].evidence["micro_mm"] == pytest.approx(1e3 * left)


def test_the_laser_is_reset_when_the_micro_stage_comes_on() -> None:
    f = ready()
    f.ask(m.MoveTo(0.01))
    resets = []
    while f.mode != "holding":
        mode = f.mode
        if f.tick().laser_reset:
            resets.append((mode, f.mode))
    assert resets == [("settling", "moving-micro")]
    f.ask(m.MoveMicro(2e-3))  # it is on: the laser goes on counting
    resets = [f.tick().laser_reset for _ in range(50)]
    assert sum(resets) == 0.0
    f.ask(m.MoveMacro(0))
    f.until("ready")
    f.ask(m.MoveMicro(1e-3))
    assert [f.tick().laser_reset for _ in range(3)] == [1.0, 0.0, 0.0]


def test_a_macro_move_switches_the_micro_stage_off() -> None:
    f = ready()
    f.ask(m.MoveMicro(1e-3))
    f.until("holding")
    assert f.out.ctrl > 0.0
    f.ask(m.MoveMacro(50))
    assert f.tick().ctrl == 0.0 and f.command.micro_active == 0.0


@pytest.mark.parametrize("park", [0, 1])
def test_a_parked_motor_is_off_under_the_micro_stage(park: int) -> None:
    control = QUICK_CONTROL._replace(sequence=QUICK_CONTROL.sequence._replace(park=park))
    f = ready(control=control)
    f.ask(m.MoveTo(0.01))
    f.until("holding")
    f.encoder -= 1.0
    assert (f.tick().motor != 0.0) == (park == 0)
    assert f.command.macro_active == 1.0 - park


def test_missing_readings_give_no_effort_and_leave_the_memory() -> None:
    f = ready()
    f.ask(m.MoveMacro(400))
    f.run(0.004)
    memory = f.s.drive.memory
    assert f.tick(missing="e").motor == 0.0
    assert f.s.drive.memory == memory
    assert f.tick().motor > 0.0
    f = ready()
    f.ask(m.MoveMicro(2e-3))
    f.run(0.001)
    integral = f.s.drive.integral
    assert f.tick(missing="h").ctrl == 0.0
    assert f.s.drive.integral == integral
    assert f.tick().ctrl > 0.0


def test_steps_by_the_target_do_not_collect_errors() -> None:
    f = ready()
    f.ask(m.MoveTo(0.002))
    f.until("holding")
    for k in range(1, 6):
        f.ask(m.MoveBy(1e-4))
        f.until("holding")
        assert f.ends[-1].outcome == "done"
        assert f.s.target.whole == pytest.approx(0.002 + k * 1e-4, abs=1e-12)


def test_what_drifts_for_longer_than_the_patience_has_stalled() -> None:
    machine = homed(control=Control(sequence=Sequence(patience=2.0)))
    machine.ask(m.MoveMacro(100))
    machine.see(100.0, seconds=0.3)
    machine.see(90.0, seconds=2.5)
    assert [e.outcome for e in machine.ends] == ["stalled"]


def test_a_rest_beyond_the_micro_stages_reach_has_stalled() -> None:
    f = ready(live=QUICK._replace(gains_while_moving=1))
    f.ask(m.MoveTo(0.0201))
    f.tick()
    f.ask(m.SetGains((("sequence.tolerance", 60.0),)))
    target = f.command.macro_reference
    for _ in range(100):
        f.see(target - 55.0)
    assert [e.outcome for e in f.ends] == ["stalled"]
    assert f.out == SAFE


def test_a_missing_reading_at_the_waits_end_is_no_arrival() -> None:
    machine = homed()
    machine.ask(m.MoveMacro(100))
    machine.see(100.0, seconds=0.3)
    machine.see(math.nan, seconds=3.0)
    assert machine.mode == "settling" and not machine.ends
    machine.see(100.0)
    assert [e.outcome for e in machine.ends] == ["done"]


def test_a_rest_beyond_the_soft_limit_of_the_micro_stage_has_stalled() -> None:
    """Though within the band that absolute moves use."""
    own = QUICK._replace(limits=QUICK.limits._replace(micro_high=1e-3), gains_while_moving=1)
    f = ready(live=own)
    f.ask(m.MoveTo(0.0201))
    f.tick()
    f.ask(m.SetGains((("sequence.tolerance", 30.0),)))
    target = f.command.macro_reference
    for _ in range(100):
        f.see(target - 12.0)
    (end,) = f.ends
    assert end.outcome == "stalled" and 1.0 < end.evidence["micro_mm"] < 3.5


def test_arrival_waits_for_the_encoder_and_then_for_a_full_window() -> None:
    f = ready()
    f.ask(m.MoveMicro(1e-3))
    for _ in range(60):
        f.tick(missing="e")
    assert f.mode == "moving-micro" and f.s.work.window.held > 2.0 * QUICK.fine.dwell
    while f.s.work.window.number != 0:
        f.tick(missing="e")
    for _ in range(3):
        f.tick()
        assert not f.ends
    f.tick()
    assert [e.outcome for e in f.ends] == ["done"]


def test_a_contraction_is_reached_wherever_the_carriage_is() -> None:
    f = ready()
    f.ask(m.MoveMicro(1e-3))
    f.run(0.005)
    f.encoder += 1.0
    f.until("holding")
    assert f.ends[-1].outcome == "done" and f.command.micro_reference == 1e-3


@pytest.mark.parametrize("laser", [0.05, -0.05, 0.009, -0.009, math.nan])
def test_two_witnesses_that_differ_are_told_as_the_reason(laser: float) -> None:
    machine = homed()
    machine.ask(m.MoveMicro(1e-3))
    found = {"error_mm": 0.002, "error_by_laser_mm": laser}
    s, efforts = _moves._gives_up(machine.p, machine.s, found)
    assert efforts[:4] == (0.0, 0.0, 0.0, 0.0) and s.mode == m.STOPPED
    end = next(n for n in efforts.notices if isinstance(n, m.Finished))
    reason = end.evidence.get("reason", "")
    if abs(laser) > 0.01:
        assert f"2.0 um and the laser {laser * 1e3:.1f} um off, allowed 10 um" in reason
    else:
        assert not reason
