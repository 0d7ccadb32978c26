"""Feeling for the end stop, without one and with one."""

from __future__ import annotations

import math

import pytest

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted
from macromicro.types import SAFE

from .bench import DT, Bench, Machine
from .follower import QUICK, STOP, Follower


def test_the_place_found_gets_its_name() -> None:
    f = Follower(encoder=50.0)
    f.tick()
    f.ask(m.Enable())
    f.ask(m.Home())
    f.until("ready")
    q = QUICK.homing
    assert f.ends[-1].outcome == "done" and f.s.frame.trusted
    assert f.s.frame.offset == STOP + q.back_off - q.coordinate
    assert f.ends[-1].position == pytest.approx(0.0, abs=3 * QUICK.pitch)


def test_a_homed_place_is_not_trusted_while_homing_again() -> None:
    f = Follower(coordinate=0.0, trusted=True)
    f.tick()
    f.ask(m.Enable())
    f.ask(m.Home())
    assert not f.s.frame.trusted
    f.tick()
    f.ask(m.Stop())
    f.run(0.2)
    assert (f.ends[-1].outcome, f.mode) == ("stopped", "stopped")
    assert not f.s.frame.trusted


def test_no_stop_is_no_success() -> None:
    machine = Machine(live=QUICK)
    machine.see(0.0)
    machine.ask(m.Enable())
    machine.ask(m.Home())
    for k in range(1500):  # a carriage that runs and runs
        machine.see(float(-k))
    machine.see(-1500.0, seconds=0.1)
    assert [e.outcome for e in machine.ends] == ["stalled"]
    assert (machine.mode, machine.out) == ("stopped", SAFE)
    assert not machine.s.frame.trusted


def test_a_carriage_that_had_only_stuck_is_searched_on() -> None:
    machine = Machine(live=QUICK)
    machine.see(0.0)
    machine.ask(m.Enable())
    machine.ask(m.Home())
    while machine.out.motor != -QUICK.homing.volts:
        machine.see(0.0)  # it stands; the effort rises to the push
    for k in range(30):
        machine.see(float(-k))  # the push frees it
    machine.see(-30.0, seconds=5 * DT)
    assert machine.mode == "homing"
    assert not [e for e in machine.events if e.cause == "end stop found"]


def test_a_stop_needs_the_push_and_the_time() -> None:
    machine = Machine(live=QUICK)
    machine.see(0.0)
    machine.ask(m.Enable())
    machine.ask(m.Home())
    pushed = 0
    while not [e for e in machine.events if e.cause == "end stop found"]:
        machine.see(0.0)
        pushed += machine.out.motor == -QUICK.homing.volts
        assert abs(machine.out.motor) <= QUICK.homing.volts
        assert machine.s.time < 1.0
    assert pushed * DT >= QUICK.homing.stand - 1.5 * DT


def test_a_runaway_gets_no_effort() -> None:
    machine = Machine(live=QUICK._replace(homing=QUICK.homing._replace(fastest=500.0)))
    machine.see(0.0)
    machine.ask(m.Enable())
    machine.ask(m.Home())
    for k in range(100):
        machine.see(float(-k))  # 1000 counts a second
    assert machine.out.motor == 0.0 and machine.mode == "homing"


def test_missing_readings_find_no_stop() -> None:
    machine = Machine(live=QUICK)
    machine.see(0.0)
    machine.ask(m.Enable())
    machine.ask(m.Home())
    machine.see(math.nan, seconds=0.5)
    assert machine.mode == "homing" and machine.out.motor == 0.0
    assert not [e for e in machine.events if e.cause == "end stop found"]


def test_the_guard_is_content_with_the_push() -> None:
    """On the twin the carriage is pushed against the stop for longer than it may be stuck."""
    b = Bench(-9.9e-3, live=QUICK._replace(homing=QUICK.homing._replace(stand=0.4, patience=5.0)))
    b.tick()
    b.ask(m.Enable())
    assert isinstance(b.ask(m.Home()), Accepted)
    assert b.wait(5.0).outcome == "done"
