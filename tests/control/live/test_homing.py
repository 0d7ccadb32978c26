"""Feeling for the end stop, without one and with one."""

from __future__ import annotations

import math

import pytest

from macromicro.control.live import _homing
from macromicro.control.live import messages as m
from macromicro.control.live._homing import GIVE, pace
from macromicro.control.live.parameters import Homing, Live
from macromicro.control.live.state import Frame
from macromicro.control.macro import NAMES
from macromicro.control.settings import Control
from macromicro.types import SAFE

from .bench import DT, Machine
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


@pytest.mark.parametrize(("dither", "stands"), [(1.0, True), (2.0, False)])
def test_a_carriage_that_dithers_by_one_count_stands(dither: float, stands: bool) -> None:
    machine = Machine(live=QUICK)
    machine.see(0.0)
    machine.ask(m.Enable())
    machine.ask(m.Home())
    place = 0.0
    for k in range(100):
        if machine.out.motor == -QUICK.homing.volts:
            place = -0.5 * GIVE  # what it leans on gives way a little
        machine.see(place + dither * (k % 2))
    assert any(e.cause == "end stop found" for e in machine.events) == stands


@pytest.mark.parametrize("law", NAMES)
@pytest.mark.parametrize("rested", [0.0, 5.0])
def test_a_stop_is_leaned_on_for_as_long_as_is_told(law: str, rested: float) -> None:
    """However long it has stood before, and whichever the law: softly first, then the push."""
    machine = Machine(control=Control(macro_law=law))
    machine.see(0.0, seconds=rested + DT)
    machine.ask(m.Enable())
    machine.ask(m.Home())
    soft = pushed = 0
    while not [e for e in machine.events if e.cause == "end stop found"]:
        machine.see(0.0)
        soft += 0.0 > machine.out.motor > -Homing().volts
        pushed += machine.out.motor == -Homing().volts
        assert soft * DT < 1.0
    assert soft > 0 and pushed * DT >= Homing().stand - 3 * DT
    assert (soft + pushed) * DT == pytest.approx(Live().homing.leans, abs=3 * DT)
    assert (soft + pushed) * DT <= Live().homing.leans + 2 * DT


def test_a_runaway_gets_no_effort() -> None:
    slow = QUICK.homing._replace(speed=100.0, approach=200.0, fastest=500.0)
    machine = Machine(live=QUICK._replace(homing=slow))
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


def test_the_search_is_quick_where_no_stop_can_be_and_slow_where_one_is_expected() -> None:
    q = Homing()
    assert [pace(q, above) for above in (2000.0, q.near + 1.0)] == [q.quick] * 2
    assert [pace(q, above) for above in (q.near, 0.0, -GIVE)] == [q.speed] * 3
    assert [pace(q, above) for above in (-GIVE - 1.0, math.nan)] == [q.approach] * 2
    assert pace(q._replace(approach=1.0), math.nan) == q.speed  # never below the slow touch


def test_a_stop_is_expected_where_a_homing_or_a_kept_position_has_it() -> None:
    q = QUICK.homing
    for begun, expected in (
        ({}, math.nan),
        ({"coordinate": 30.0}, 50.0 - 30.0 + q.coordinate - q.back_off),
        ({"coordinate": 0.0, "trusted": True}, 50.0 + q.coordinate - q.back_off),
    ):
        f = Follower(encoder=50.0, **begun)
        f.tick()
        f.ask(m.Enable())
        f.ask(m.Home())
        assert f.s.work.expected == pytest.approx(expected, nan_ok=True)  # type: ignore[union-attr]
        f.tick()
        f.ask(m.EmergencyStop())  # costs trust, not the name
        f.run(0.1)
        assert f.s.frame.named == (begun != {})
    f.ask(m.Enable())
    f.ask(m.Home())
    f.until("ready")
    f.ask(m.Home())
    assert f.s.work.expected == STOP  # type: ignore[union-attr]


def test_a_stop_is_expected_below_the_place_that_homing_names() -> None:
    own = QUICK.homing._replace(coordinate=37.0, back_off=145.0)
    f = Follower(coordinate=50.0, trusted=True, live=QUICK._replace(homing=own))
    f.tick()
    f.ask(m.Enable())
    f.ask(m.Home())
    assert f.s.work.expected == -50.0 + 37.0 - 145.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("speed", "pace", "volts"), [
    (699.0, 0.0, 3.0), (701.0, 0.0, 0.0), (2799.0, 2000.0, 3.0), (2801.0, 2000.0, 0.0),
])  # fmt: skip
def test_above_its_speed_homing_pushes_no_more(
    sign: float, speed: float, pace: float, volts: float
) -> None:
    """700 count/s, or 1.4 times the wanted speed; and never beyond its own effort."""
    s = Follower().s
    s = s._replace(seen=s.seen._replace(speed=sign * speed))
    q = Homing(fastest=700.0, volts=3.0)
    assert _homing._slow(q, s, 4.0, pace) == volts
    assert _homing._slow(q, s, -4.0, pace) == -volts


def test_backed_off_it_is_named_after_the_dwell_within_the_tolerance() -> None:
    own = QUICK._replace(homing=QUICK.homing._replace(coordinate=37.0, back_off=100.0))
    f = Follower(coordinate=0.0, trusted=True, live=own)
    f.tick()
    f.ask(m.Enable())
    f.ask(m.Home())
    search = f.s.work._replace(phase=_homing.BACK, since=math.nan, stop=-142.0, sure=True)
    f.s = f.s._replace(work=search)
    f.see(-32.0, seconds=0.05)  # beyond the place by ten counts
    f.see(-52.0, seconds=0.05)
    assert f.mode == "homing"
    f.see(-43.0, seconds=0.007)
    assert f.mode == "ready" and f.ends[-1].outcome == "done"
    assert f.s.frame == Frame(-79.0, 0.0, True, 0.0, named=True)
