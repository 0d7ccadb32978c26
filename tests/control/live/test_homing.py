"""Feeling for the end stop, without one and with one."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from macromicro.control.live import homing, leaning
from macromicro.control.live import messages as m
from macromicro.control.live.homing import GIVE, pace
from macromicro.control.live.leaning import SHARE
from macromicro.control.live.messages import Accepted
from macromicro.control.live.parameters import Homing, Live
from macromicro.control.live.state import Frame
from macromicro.control.macro import NAMES
from macromicro.control.settings import Control
from macromicro.rig.codes import OK, STUCK
from macromicro.rig.limits import LIVE
from macromicro.settings import Settings
from macromicro.types import SAFE

from .bench import DT, PITCH, Bench, Machine
from .follower import QUICK, STOP, Follower

STOP_LOW = Settings().bench.carriage.stop_low


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
    assert (soft + pushed) * DT == pytest.approx(leaning.longest(Live()), abs=3 * DT)
    assert (soft + pushed) * DT <= leaning.longest(Live()) + 2 * DT


def bench(
    place: float, friction: float = 1.0, stiffness: float = 0.0, seed: int = 0, **begun: Any
) -> Bench:
    """On the twin with a live guard, enabled, `place` [m] above the end of its way; with a
    share of the default friction, and another stiffness of the stop [N/m]."""
    q = Settings()
    rubs, rail = q.bench.friction, q.bench.carriage
    rubs = rubs._replace(coulomb=friction * rubs.coulomb, stribeck=friction * rubs.stribeck)
    rail = rail._replace(stop_stiffness=stiffness or rail.stop_stiffness)
    q = q._replace(bench=q.bench._replace(friction=rubs, carriage=rail), guard=LIVE)
    b = Bench(rail.stop_low + place, seed, q, **begun)
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


def on_its_way() -> Bench:
    """Homing, half of the 10 mm to the stop gone."""
    b = bench(10e-3)
    b.ask(m.Home())
    while b.twin.truth().carriage > STOP_LOW + 5e-3:
        b.tick()
    return b


@pytest.mark.parametrize("jammed", [0.1, 0.3, 0.5, 0.7, 0.9])
def test_a_moments_jam_is_no_stop(jammed: float) -> None:
    b = on_its_way()
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
    b = on_its_way()
    here = b.twin.state.macro
    while not [e for e in b.events if e.cause == "end stop found"]:
        b.tick()
        b.twin.state = b.twin.state._replace(macro=here._replace(v=0.0, i=0.0))
    end = b.wait(20.0)
    assert (end.outcome, b.watch.fault) == ("done", OK)
    assert end.evidence["stop_raw_counts"] * PITCH < Settings().bench.carriage.stop_low


def test_a_carriage_that_stays_held_up_is_never_homed() -> None:
    b = on_its_way()
    here = b.twin.state.macro
    while not b.ends:
        b.tick()
        b.twin.state = b.twin.state._replace(macro=here._replace(v=0.0, i=0.0))
    assert b.ends[-1].outcome == "fault" and b.watch.fault == STUCK
    assert not b.s.frame.trusted


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


def test_the_guard_is_content_with_the_push() -> None:
    """On the twin the carriage is pushed against the stop for longer than it may be stuck."""
    b = Bench(-9.9e-3, live=QUICK._replace(homing=QUICK.homing._replace(stand=0.4, patience=5.0)))
    b.tick()
    b.ask(m.Enable())
    assert isinstance(b.ask(m.Home()), Accepted)
    assert b.wait(5.0).outcome == "done"


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


@pytest.mark.parametrize(
    ("place", "known", "most"),
    [(10e-3, False, 3.5), (110e-3, False, 5.0), (210e-3, False, 6.5), (224e-3, False, 6.7),
     (10e-3, True, 3.7), (110e-3, True, 4.7), (210e-3, True, 5.2), (224e-3, True, 5.4)],
)  # fmt: skip
def test_homing_takes_seconds_from_anywhere(place: float, known: bool, most: float) -> None:
    begun = {"coordinate": (STOP_LOW + place) / PITCH, "trusted": True} if known else {}
    b = bench(place, **begun)
    b.ask(m.Home())
    end = b.wait(most)
    assert (end.outcome, b.watch.fault) == ("done", OK)
    assert end.evidence["by"] == "laser"


def tried(seed: int) -> tuple[float, str]:
    """Homing from a drawn place, with a drawn friction, stop and knowledge, right or wrong: the
    friction's factor and the outcome; that it is no false home is checked here."""
    rng = np.random.default_rng(seed)
    place, friction = rng.uniform(0.0, 0.2243), rng.uniform(0.9, 1.1)
    told = (STOP_LOW + place) / PITCH + rng.choice([0.0, rng.uniform(-1500.0, 1500.0)])
    begun: dict[str, Any] = {"coordinate": told, "trusted": bool(rng.integers(2))}
    b = bench(place, friction, float(rng.choice([0.0, 5e7])), seed, **rng.choice([{}, begun]))
    b.ask(m.Home())
    outcome = b.wait(50.0).outcome
    assert b.s.frame.trusted == (outcome == "done")
    if outcome == "done":
        felt = b.ends[-1].evidence["stop_raw_counts"]
        assert -0.3e-3 <= (felt + 0.5) * PITCH - STOP_LOW <= PITCH, (seed, felt)
        assert b.s.frame.offset == felt + Homing().back_off
    assert b.leant <= SHARE * LIVE.leant or outcome != "done"
    return friction, outcome


MOVABLE = 1.08  # of the default friction: beyond it the push may not break the carriage away


@pytest.mark.parametrize("seed", range(8))
def test_no_false_home_and_no_fault(seed: int) -> None:
    friction, outcome = tried(seed)
    assert outcome == "done" or friction > MOVABLE


@pytest.mark.slow
def test_no_false_home_and_no_fault_in_many_places() -> None:
    found = [tried(seed) for seed in range(100, 160)]
    assert [x for x in found if x[1] != "done" and x[0] <= MOVABLE] == []
    assert sum(outcome == "done" for _, outcome in found) >= 50


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
    assert homing._slow(q, s, 4.0, pace) == volts
    assert homing._slow(q, s, -4.0, pace) == -volts


def test_backed_off_it_is_named_after_the_dwell_within_the_tolerance() -> None:
    own = QUICK._replace(homing=QUICK.homing._replace(coordinate=37.0, back_off=100.0))
    f = Follower(coordinate=0.0, trusted=True, live=own)
    f.tick()
    f.ask(m.Enable())
    f.ask(m.Home())
    search = f.s.work._replace(phase=homing.BACK, since=math.nan, stop=-142.0, sure=True)
    f.s = f.s._replace(work=search)
    f.see(-32.0, seconds=0.05)  # beyond the place by ten counts
    f.see(-52.0, seconds=0.05)
    assert f.mode == "homing"
    f.see(-43.0, seconds=0.007)
    assert f.mode == "ready" and f.ends[-1].outcome == "done"
    assert f.s.frame == Frame(-79.0, 0.0, True, 0.0, named=True)
