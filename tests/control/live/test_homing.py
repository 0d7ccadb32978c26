"""Feeling for the end stop, without one and with one."""

from __future__ import annotations

import math

import pytest

from macromicro.control.live import leaning
from macromicro.control.live import messages as m
from macromicro.control.live.homing import GIVE
from macromicro.control.live.leaning import SHARE
from macromicro.control.live.messages import Accepted
from macromicro.control.live.parameters import Homing, Live
from macromicro.control.macro import LAWS
from macromicro.control.settings import Control
from macromicro.rig.codes import OK, STUCK
from macromicro.rig.limits import LIVE
from macromicro.settings import Settings
from macromicro.types import SAFE

from .bench import DT, PITCH, Bench, Machine
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


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("rested", [0.0, 5.0])
def test_a_stop_is_leaned_on_for_as_long_as_is_told(law: str, rested: float) -> None:
    """However long it has stood before, and however weak the law: softly first, then the push."""
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
    assert soft * DT == pytest.approx(Homing().stand, abs=3 * DT)
    assert pushed * DT == pytest.approx(Homing().stand, abs=3 * DT)
    assert (soft + pushed) * DT <= leaning.longest(Live()) + 2 * DT


def bench(place: float, friction: float = 1.0, stiffness: float = 0.0, seed: int = 0) -> Bench:
    """On the twin with a live guard, enabled, `place` [m] above the end of its way; with a
    share of the default friction, and another stiffness of the stop [N/m]."""
    q = Settings()
    rubs, rail = q.bench.friction, q.bench.carriage
    rubs = rubs._replace(coulomb=friction * rubs.coulomb, stribeck=friction * rubs.stribeck)
    rail = rail._replace(stop_stiffness=stiffness or rail.stop_stiffness)
    q = q._replace(bench=q.bench._replace(friction=rubs, carriage=rail), guard=LIVE)
    b = Bench(rail.stop_low + place, seed, q)
    b.tick()
    b.ask(m.Enable())
    return b


@pytest.mark.parametrize("stiffness", [0.0, 5e7])
@pytest.mark.parametrize("friction", [0.4, 1.0, 1.08])
def test_homing_from_the_stop_and_beside_it(friction: float, stiffness: float) -> None:
    """Pressed against it or some millimetres away, rubber or rigid: the guard is content."""
    for seed, place in enumerate((0.0 if stiffness else -5e-5, 0.0, 1e-4, 1e-3, 5e-3)):
        b = bench(place, friction, stiffness, seed)
        b.ask(m.Home())
        end = b.wait(20.0)
        assert (end.outcome, b.watch.fault) == ("done", OK), (place, end)
        found = (end.evidence["stop_raw_counts"] + 0.5) * PITCH
        assert -0.3e-3 <= found - Settings().bench.carriage.stop_low <= PITCH
        assert b.leant <= SHARE * LIVE.leant
        b.ask(m.Home())  # from where it is left
        assert b.wait(20.0).outcome == "done"


@pytest.mark.parametrize("after", [1.2, 1.4, 1.6, 2.0])
def test_homing_again_from_the_push_against_the_stop(after: float) -> None:
    b = bench(5e-3)
    b.ask(m.Home())
    b.run(after)
    b.ask(m.EmergencyStop())
    b.ask(m.Enable())
    b.ask(m.Home())
    assert (b.wait(20.0).outcome, b.watch.fault) == ("done", OK)


@pytest.mark.parametrize("friction", [1.1, 1.3, 1.6])
def test_a_carriage_that_cannot_be_moved_is_never_homed(friction: float) -> None:
    """The push cannot break it away; nor can it be backed off then."""
    for seed, place in enumerate((0.0, 1e-3, 5e-3)):
        b = bench(place, friction, seed=seed)
        b.ask(m.Home())
        assert b.wait(60.0).outcome in ("fault", "stalled")
        assert not b.s.frame.trusted


@pytest.mark.parametrize("jammed", [0.1, 0.3, 0.5, 0.7, 0.9])
def test_a_moments_jam_is_no_stop(jammed: float) -> None:
    b = bench(10e-3)
    b.ask(m.Home())
    b.run(0.3)
    assert -9e-3 < b.twin.truth().carriage < -1e-3  # on its way
    here = b.twin.state.macro
    for _ in range(round(jammed / DT)):
        b.tick()
        b.twin.state = b.twin.state._replace(macro=here._replace(v=0.0, i=0.0))
    end = b.wait(20.0)
    assert end.outcome == "done"
    assert end.evidence["stop_raw_counts"] * PITCH < Settings().bench.carriage.stop_low
    found = [e.evidence["stop_raw_counts"] for e in b.events if e.cause == "end stop found"]
    sure = [e.evidence["stop_raw_counts"] for e in b.events if e.cause == "end stop confirmed"]
    assert len(found) == (2 if jammed > 2.0 * Homing().stand else 1) and len(sure) == 1
    assert abs(found[-1] - sure[0]) <= GIVE


def test_a_carriage_held_up_until_it_is_backed_off_goes_on_to_the_stop() -> None:
    b = bench(10e-3)
    b.ask(m.Home())
    b.run(0.3)
    here = b.twin.state.macro
    while not [e for e in b.events if e.cause == "end stop found"]:
        b.tick()
        b.twin.state = b.twin.state._replace(macro=here._replace(v=0.0, i=0.0))
    end = b.wait(20.0)
    assert (end.outcome, b.watch.fault) == ("done", OK)
    assert end.evidence["stop_raw_counts"] * PITCH < Settings().bench.carriage.stop_low


def test_a_carriage_that_stays_held_up_is_never_homed() -> None:
    b = bench(10e-3)
    b.ask(m.Home())
    b.run(0.3)
    here = b.twin.state.macro
    while not b.ends:
        b.tick()
        b.twin.state = b.twin.state._replace(macro=here._replace(v=0.0, i=0.0))
    assert b.ends[-1].outcome == "fault" and b.watch.fault == STUCK
    assert not b.s.frame.trusted


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
