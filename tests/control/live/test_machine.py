"""Faults, the frame of a restart, what the readings become."""

from __future__ import annotations

import math

import pytest

from macromicro.control.live import machine, survey
from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Refused
from macromicro.control.pid import Pid
from macromicro.types import SAFE, Sample

from .bench import HALL_OUT, PITCH, Machine
from .follower import ready


def test_nothing_moves_at_the_start() -> None:
    machine = Machine()
    for _ in range(100):
        assert machine.see(123.0) == SAFE
    assert machine.mode == "disabled" and not machine.events
    assert machine.ask(m.Enable()) == Accepted(0)
    assert machine.see(123.0) == SAFE


@pytest.mark.parametrize("request_", [m.MoveMacro(300), m.MoveMicro(1e-3), m.Home()])
def test_a_fault_latches_and_ends_the_motion(request_: m.Request) -> None:
    f = ready()
    f.ask(m.Fan(True))
    f.ask(request_)
    f.run(0.003)
    f.fault("the carriage is stuck", pushed_s=0.3)
    f.fault("something else")
    (end,) = f.ends
    assert (end.outcome, end.uncertainty) == ("fault", math.inf)
    assert end.evidence["pushed_s"] == 0.3
    assert f.s.fault is not None and f.s.fault.words == "the carriage is stuck"
    for _ in range(5):
        assert f.tick() == SAFE
    refused = f.ask(m.ClearFault(gone=False))
    assert isinstance(refused, Refused) and "the carriage is stuck" in refused.reason
    assert isinstance(f.ask(m.Enable()), Refused)
    assert f.ask(m.ClearFault(gone=True)) == Accepted(0)
    assert f.mode == "disabled" and not f.s.frame.trusted
    assert isinstance(f.ask(m.ClearFault(gone=True)), Refused)


def test_a_fault_at_rest_leaves_the_trust_unless_counts_were_lost() -> None:
    for lost in (False, True):
        f = ready()
        f.s, _ = machine.fault(f.p, f.s, "hall silent", {}, position_lost=lost)
        assert f.s.frame.trusted == (not lost)


@pytest.mark.parametrize("encoder", [0.0, 5000.0])
def test_a_kept_coordinate_names_the_first_count(encoder: float) -> None:
    machine = Machine(coordinate=700.0, trusted=True)
    machine.see(encoder)
    assert machine.s.frame.offset == encoder - 700.0
    assert machine.s.seen.position == pytest.approx(700 * PITCH, abs=20e-6)
    machine.ask(m.Enable())
    machine.ask(m.MoveMacro(710))
    machine.see(encoder)
    assert machine.command.macro_reference == encoder + 10.0


def test_without_a_coordinate_no_place_is_trusted() -> None:
    for kept in (None, math.nan):
        machine = Machine(coordinate=kept, trusted=True)
        machine.see(10.0)
        assert not machine.s.frame.trusted


def test_a_reading_that_is_no_number_is_missing() -> None:
    f = ready()
    f.ask(m.MoveMacro(300))
    f.run(0.003)
    seen = f.s.seen
    for wrong in (math.nan, math.inf, -math.inf):
        out = f.show(Sample(f.s.time + 1e-3, wrong, wrong, 0.0, 1.0, 0.0))
        assert out == SAFE
        assert (f.s.seen.encoder, f.s.seen.fine) == (seen.encoder, seen.fine)


def test_the_speed_is_the_encoders() -> None:
    machine = Machine()
    for k in range(200):
        machine.see(float(k))  # a count each millisecond
    assert machine.s.seen.speed == pytest.approx(1000.0, rel=1e-3)
    machine.see(199.0, seconds=0.1)
    assert abs(machine.s.seen.speed) < 1.0
    assert machine.s.seen.standing == pytest.approx(0.1, abs=2e-3)


def test_the_position_is_count_and_contraction() -> None:
    machine = Machine()
    machine.see(0.0, HALL_OUT)
    machine.see(1400.0, 2.5)
    fine = machine.command.micro_position
    assert machine.s.seen.position == pytest.approx(1400 * PITCH + fine)
    assert fine == pytest.approx(2e-3, abs=0.1e-3)


def test_a_time_that_is_no_number_is_counted_on() -> None:
    machine = Machine()
    machine.see()
    machine.show(Sample(math.nan, 1.0, HALL_OUT, 0.0, 1.0, 0.0))
    assert machine.s.time == pytest.approx(2e-3)


@pytest.mark.parametrize("leap", [3600.0, -10.0, 0.11])
def test_a_time_that_leaps_ends_no_wait(leap: float) -> None:
    """What is timed by it must not be cut short, nor last for ever."""
    f = ready()
    f.ask(m.MoveMacro(300))
    f.run(0.01)
    before = f.s.time
    for k in range(5):
        f.show(Sample(before + leap + 1e-3 * k, f.encoder, HALL_OUT, 0.0, 1.0, 0.0))
    assert f.mode == "moving-macro"
    assert f.s.time == pytest.approx(before + 5e-3)


def test_what_a_law_cannot_compute_is_left_to_the_guard() -> None:
    """Gains beyond all bounds: inf - inf is no number, and no motion could explain it."""
    f = ready()
    macro = f.s.laws.macro._replace(law=0, dead_zone=0.0).with_gains(Pid(1e308, 0.0, -1e308))
    f.s = f.s._replace(laws=f.s.laws._replace(macro=macro))
    f.ask(m.MoveMacro(300))
    assert math.isnan(f.tick().motor)


@pytest.mark.parametrize("leap", [3600.0, -10.0, 0.15])
def test_after_a_leap_events_are_in_the_samples_time_again(leap: float) -> None:
    """And what had begun before it lasts for as long as has passed."""
    f = ready()
    f.ask(m.MoveMacro(300))
    f.run(0.01)
    began, told = f.s.time - 0.01, f.s.time + leap
    for k in range(1, 6):
        f.show(Sample(told + 1e-3 * k, f.encoder, HALL_OUT, 0.0, 1.0, 0.0))
    f.show(Sample(math.nan, f.encoder, HALL_OUT, 0.0, 1.0, 0.0))
    f.ask(m.Fan(True))
    assert f.events[-1].time == pytest.approx(told + 6e-3)
    f.fault("stuck")
    assert f.s.fault is not None and f.s.fault.time == f.events[-1].time
    assert f.events[-1].time == pytest.approx(told + 6e-3)
    assert f.ends[-1].evidence["seconds"] == pytest.approx(f.s.time - began) == pytest.approx(0.016)


def test_two_leaps_add_up() -> None:
    f = ready()
    began = f.s.time
    for told in (50.0, 50.001, 7.0, 7.001, 7.002):
        f.show(Sample(told, 0.0, HALL_OUT, 0.0, 1.0, 0.0))
    f.ask(m.Fan(True))
    assert f.events[-1].time == 7.002
    assert f.s.time - began == pytest.approx(5e-3)


@pytest.mark.parametrize("moving", [True, False])
@pytest.mark.parametrize("lost", [True, False])
def test_a_fault_that_costs_the_trust_tells_so(moving: bool, lost: bool) -> None:
    f = ready()
    if moving:
        f.ask(m.MoveMacro(300))
        f.tick()
    f.events.clear()
    f.s, notices = machine.fault(f.p, f.s, "carriage stuck", {}, position_lost=lost)
    f.note(notices)
    gone = moving or lost
    assert f.s.frame.trusted is not gone
    causes = [("trust", "fault: carriage stuck")] * gone + [("mode", "fault")]
    assert [(e.kind, e.cause) for e in f.events] == causes
    if gone:
        assert f.events[0].evidence == {"trusted": False}


def test_a_period_lasts_as_long_as_the_samples_say_before_a_leap_and_after_it() -> None:
    f = ready()
    f.run(0.3)
    before = f.s.time
    f.show(Sample(before + 0.002, 0.0, HALL_OUT, 0.0, 1.0, 0.0))
    assert f.s.time == pytest.approx(before + 0.002)
    f.show(Sample(before + 50.0, 0.0, HALL_OUT, 0.0, 1.0, 0.0))
    assert f.s.time == pytest.approx(before + 0.003)
    for k in (1, 2):
        f.show(Sample(before + 50.0 + 0.004 * k, 0.0, HALL_OUT, 0.0, 1.0, 0.0))
        assert f.s.time == pytest.approx(before + 0.003 + 0.004 * k)
    f.show(Sample(before + 50.008 + 0.09, 0.0, HALL_OUT, 0.0, 1.0, 0.0))
    assert f.s.time == pytest.approx(before + 0.101)


def test_the_first_sample_sets_the_time() -> None:
    machine = Machine()
    machine.show(Sample(1000.0, 0.0, HALL_OUT, 0.0, 1.0, 0.0))
    assert (machine.s.time, machine.s.shift) == (1000.0, 0.0)


DRIVEN = {"homing", "moving-macro", "settling"}


@pytest.mark.parametrize("mode", ["disabled", "ready", "holding", "moving-micro", *sorted(DRIVEN)])
@pytest.mark.parametrize("apart", [0.049, 0.05])
def test_laser_and_encoder_apart_are_a_fault_while_the_motor_has_its_turn(
    mode: str, apart: float
) -> None:
    f = ready(coordinate=-7.0)
    requests = {
        "disabled": m.Disable(), "homing": m.Home(), "moving-macro": m.MoveMacro(60),
        "settling": m.MoveMacro(60), "moving-micro": m.MoveMicro(1e-3),
        "holding": m.MoveMicro(1e-3),
    }  # fmt: skip
    if mode in requests:
        f.ask(requests[mode])
    f.until(mode)
    shown = Sample(f.s.time + 1e-3, f.s.seen.encoder, HALL_OUT, 0.0, 1.0, 0.0)
    told = survey.NOTHING._replace(apart=apart, gap=-3.5)
    f.s, *_, notices = machine.step(f.p, f.s, shown, 1e-3, lambda *_: told)
    f.note(notices)
    assert (f.mode == "fault") == (mode in DRIVEN and apart == 0.05)
    if f.mode == "fault":
        facts = f.ends[-1].evidence
        count = f.s.seen.encoder - f.s.frame.offset
        assert facts["by_encoder_counts"] == count
        assert facts["by_laser_counts"] == count - 3.5
        assert (facts["allowed_counts"], facts["for_s"]) == (2.0, 0.05)
        assert not f.s.frame.trusted


@pytest.mark.parametrize("rested", [False, True])
def test_and_while_the_carriage_comes_to_rest(rested: bool) -> None:
    f = ready()
    f.ask(m.MoveMacro(300))
    f.run(0.01)
    f.ask(m.Stop())
    if rested:
        f.run(0.5)
    shown = Sample(f.s.time + 1e-3, f.s.seen.encoder, HALL_OUT, 0.0, 1.0, 0.0)
    told = survey.NOTHING._replace(apart=0.06, gap=3.0)
    f.s, *_ = machine.step(f.p, f.s, shown, 1e-3, lambda *_: told)
    assert (f.mode == "fault") != rested


@pytest.mark.parametrize("wrong", [math.inf, -math.inf, math.nan])
def test_each_reading_alone_that_is_no_number_stops_its_stage(wrong: float) -> None:
    f = ready()
    f.ask(m.MoveMacro(300))
    f.tick()
    assert f.show(Sample(f.s.time + 1e-3, wrong, HALL_OUT, 0.0, 1.0, 0.0)).motor == 0.0
    assert f.tick().motor != 0.0
    f = ready()
    f.ask(m.MoveMicro(2e-3))
    f.tick()
    assert f.show(Sample(f.s.time + 1e-3, 0.0, wrong, 0.0, 1.0, 0.0)).ctrl == 0.0
    assert f.tick().ctrl != 0.0


@pytest.mark.parametrize(("dt", "share"), [(0.001, 0.1), (0.005, 0.5), (0.01, 1.0), (0.04, 1.0)])
def test_the_speed_takes_in_no_more_than_the_new_one(dt: float, share: float) -> None:
    f = ready()
    f.s = f.s._replace(seen=f.s.seen._replace(speed=50.0))
    shown = Sample(f.s.time + dt, 3.0, HALL_OUT, 0.0, 1.0, 0.0)
    s, *_ = machine.step(f.p, f.s, shown, dt)
    assert s.seen.speed == pytest.approx(50.0 + (3.0 / dt - 50.0) * share)


@pytest.mark.parametrize("moving", [True, False])
def test_in_a_fault_the_laser_is_followed_while_the_count_is_to_be_relied_on(moving: bool) -> None:
    f = ready()
    if moving:
        f.ask(m.MoveMacro(300))
        f.run(0.01)
    f.fault("stuck")
    shown = Sample(f.s.time + 1e-3, 0.0, HALL_OUT, 0.0, 1.0, 0.0)
    told = survey.NOTHING._replace(laser=0.25)
    s, *_ = machine.step(f.p, f.s, shown, 1e-3, lambda *_: told)
    assert (s.survey == told) != moving
    assert (s.survey is survey.NOTHING) == moving


NOISY = "the Hall sensor is noisy"


@pytest.mark.parametrize("laser", [True, False])
def test_a_doubt_of_the_hall_sensor_costs_what_only_it_tells(laser: bool) -> None:
    f = ready()
    if laser:
        f.s = f.s._replace(survey=f.s.survey._replace(half=9e-6))
    f.events.clear()
    known = f.s
    f.s, notices = machine.doubt(f.p, f.s, NOISY)
    f.note(notices)
    assert f.s == known._replace(doubt=NOISY)
    causes = [] if laser else [(NOISY, {"trusted": False})]
    assert [(e.cause, e.evidence) for e in f.events] == causes
    f.s, notices = machine.doubt(f.p, f.s, "")
    f.note(notices)
    if laser:  # what the laser has seen is kept
        assert f.s == known
    else:
        assert f.s == known._replace(survey=survey.NOTHING)
        causes.append(("the Hall sensor is back", {"trusted": True}))
    assert [(e.kind, e.cause, e.evidence) for e in f.events] == [("trust", *c) for c in causes]


def test_what_was_judged_in_doubt_is_not_held_against_the_encoder() -> None:
    f = ready()
    apart = f.s.survey._replace(half=9e-6, apart=0.02, laser=0.5)
    f.s = f.s._replace(survey=apart)
    f.s, _ = machine.doubt(f.p, f.s, NOISY)
    assert f.s.survey == apart
    f.s, _ = machine.doubt(f.p, f.s, "")
    assert f.s.survey is survey.NOTHING


def test_an_untrusted_frame_is_not_trusted_when_a_doubt_ends() -> None:
    f = ready(trusted=False)
    for words in (NOISY, ""):
        f.s, notices = machine.doubt(f.p, f.s, words)
        assert not notices and f.s.doubt == words
