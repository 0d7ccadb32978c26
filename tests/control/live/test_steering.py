"""Jogs of the two-stage machine; what follows set points is in `test_follow`."""

from __future__ import annotations

import math

import pytest

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Refused
from macromicro.plant import carriage
from macromicro.rig.codes import OK
from macromicro.rig.limits import LIVE
from macromicro.settings import Settings
from macromicro.types import SAFE

from .bench import DT, PITCH, Bench, Machine, homed
from .follower import QUICK, QUICK_CONTROL, hall, ready


def test_a_jog_under_way_takes_a_new_speed_and_keeps_its_number() -> None:
    f = ready()
    assert f.ask(m.Jog("macro", 0.02)) == Accepted(1)
    f.run(0.2)
    assert f.ask(m.Jog("macro", -0.02)) == Accepted(1)
    there = f.encoder
    f.run(0.2)
    assert f.encoder < there
    assert isinstance(f.ask(m.Jog("micro", 1e-4)), Refused)
    assert f.ask(m.Jog("macro", 0.0)) == Accepted(1)
    f.run(0.2)
    assert [(e.id, e.outcome) for e in f.ends] == [(1, "stopped")]


@pytest.mark.parametrize("speed", [0.05, -0.05])
def test_the_reference_stops_at_the_soft_limit(speed: float) -> None:
    limits = QUICK.limits._replace(macro_low=-40.0, macro_high=60.0)
    f = ready(live=QUICK._replace(limits=limits))
    f.ask(m.Jog("macro", speed))
    last, fastest = 0.0, 0.0
    while not f.ends:
        f.tick()
        if f.mode == "moving-macro":
            reference = f.command.macro_reference
            assert -40.0 <= reference <= 60.0
            fastest, last = max(fastest, abs(reference - last) * 1e3), reference
    assert fastest <= abs(speed) / PITCH * (1.0 + 1e-6)
    assert f.ends[-1].outcome == "limit"
    assert f.s.seen.encoder == pytest.approx(60.0 if speed > 0.0 else -40.0, abs=2.0)
    further = f.ask(m.Jog("macro", speed / 5.0))
    back = f.ask(m.Jog("macro", -speed / 5.0))
    assert isinstance(back, Accepted)
    assert isinstance(further, Refused) or abs(f.s.seen.encoder) < 60.0


def test_a_carriage_that_does_not_follow_has_stalled() -> None:
    machine = homed(live=QUICK)
    machine.ask(m.Jog("macro", 0.02))
    machine.see(0.0, seconds=1.0)
    assert [(e.id, e.outcome) for e in machine.ends] == [(1, "stalled")]
    assert machine.out == SAFE
    # It never pushes so hard that the guard would take it for stuck.
    machine = homed(live=QUICK._replace(jogging=QUICK.jogging._replace(patience=30.0)))
    machine.ask(m.Jog("macro", 0.02))
    for _ in range(2000):
        assert machine.see(0.0).motor <= QUICK.homing.volts


@pytest.mark.parametrize("speed", [1e-3, 5e-2])
def test_a_jog_into_a_stop_has_stalled_before_the_guard_finds_it_stuck(speed: float) -> None:
    b = Bench(0.02, settings=Settings(guard=LIVE), coordinate=2985.0, trusted=True)  # it is not
    b.twin.state = b.twin.state._replace(
        macro=carriage.at_rest(b.twin.plant.macro.carriage.stop_high - 1e-4)
    )
    b.tick()
    b.ask(m.Enable())
    live = b.p.settings
    b.s = b.s._replace(limits=live.limits._replace(macro_high=9999.0))
    b.ask(m.Jog("macro", speed))
    end = b.wait(20.0)
    assert (end.outcome, b.watch.fault, b.mode) == ("stalled", OK, "stopped")
    assert b.leant == pytest.approx(live.jogging.patience, abs=3 * DT)


@pytest.mark.parametrize(
    ("speed", "friction"),
    [(1e-4, 1.05), (-1e-3, 0.7), (1e-2, 1.05)],
)
def test_a_sticky_carriage_that_moves_has_not_stalled(speed: float, friction: float) -> None:
    q = Settings()
    rubs = q.bench.friction
    rubs = rubs._replace(coulomb=friction * rubs.coulomb, stribeck=friction * rubs.stribeck)
    q = q._replace(bench=q.bench._replace(friction=rubs), guard=LIVE)
    b = Bench(0.07, settings=q, coordinate=1000.0, trusted=True)
    b.tick()
    b.ask(m.Enable())
    b.ask(m.Jog("macro", speed))
    b.run(6.0)
    assert not b.ends and b.watch.fault == OK
    assert (b.twin.truth().carriage - 0.07) / speed == pytest.approx(6.0, rel=0.15, abs=1.0)


def test_a_micro_jog_ends_at_its_limit_once_there() -> None:
    f = ready()
    f.ask(m.Jog("micro", 5e-4))
    while not f.ends:
        f.tick()
        assert f.command.micro_reference <= 3.5e-3
        assert f.s.time < 10.0
    assert (f.ends[-1].outcome, f.mode) == ("limit", "holding")
    assert f.s.drive.micro_reference == 3.5e-3
    assert f.s.seen.fine == pytest.approx(3.5e-3, abs=0.01e-3)


def test_a_micro_jog_does_not_run_away_from_the_stage() -> None:
    machine = homed()
    machine.ask(m.Jog("micro", 5e-4))
    for _ in range(3000):
        machine.see(0.0)  # the stage does not move
        ahead = machine.command.micro_reference - machine.command.micro_position
        assert ahead <= machine.p.settings.jogging.micro_lead + 1e-12


def test_a_micro_jog_that_does_not_get_to_its_limit_has_stalled() -> None:
    machine = homed(live=QUICK)
    machine.ask(m.Jog("micro", 5e-4))
    machine.see(hall=hall(3.45e-3), seconds=1.5)
    assert [(e.id, e.outcome) for e in machine.ends] == [(1, "stalled")]
    assert machine.mode == "stopped" and machine.out == SAFE
    sent = machine.ends[0].evidence["micro_mm"]
    assert sent == pytest.approx(1e3 * machine.s.limits.micro_high)


def test_no_stage_no_speed_no_jog() -> None:
    f = ready()
    for stage, speed in (("third", 0.01), (None, 0.01), ("macro", 0.0), ("macro", 0.0501),
                         ("micro", 0.0006), ("macro", math.nan)):  # fmt: skip
        reply = f.ask(m.Jog(stage, speed))  # type: ignore[arg-type]
        assert isinstance(reply, Refused) and reply.reason and reply.remedy


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("offset", [500.0, -500.0])
def test_soft_limits_are_those_of_the_homed_frame(sign: float, offset: float) -> None:
    limits = QUICK.limits._replace(macro_low=-40.0, macro_high=40.0)
    machine = Machine(live=QUICK._replace(limits=limits), coordinate=0.0, trusted=True)
    machine.see(offset)
    machine.ask(m.Enable())
    machine.ask(m.Jog("macro", sign * 0.05))
    for _ in range(200):
        machine.see(math.floor(machine.command.macro_reference or offset))
    assert [e.outcome for e in machine.ends] == ["limit"]
    assert machine.s.seen.encoder == offset + sign * 40.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_jog_of_less_than_a_count_a_second_moves(sign: float) -> None:
    machine = homed(live=QUICK)
    machine.ask(m.Jog("macro", sign * 0.5 * PITCH))
    machine.see(0.0, seconds=0.04)
    assert machine.command.macro_reference == pytest.approx(sign * 0.02, rel=1e-6)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_at_the_limit_the_reference_rests(sign: float) -> None:
    """And begins to move back from there as from any rest."""
    limits = QUICK.limits._replace(macro_low=-40.0, macro_high=40.0)
    machine = homed(live=QUICK._replace(limits=limits))
    machine.ask(m.Jog("macro", sign * 0.05))
    for k in range(100):
        machine.see(sign * 10.0 + k % 2)  # it lags, and does not stand
    assert machine.command.macro_reference == sign * 40.0
    machine.ask(m.Jog("macro", -sign * 0.05))
    machine.see(sign * 10.0)
    first = machine.p.settings.brake.deceleration / PITCH * DT * DT
    assert machine.command.macro_reference == pytest.approx(sign * (40.0 - first), abs=1e-9)


def test_what_stands_at_its_limit_ends_in_the_period_in_which_the_reference_gets_there() -> None:
    machine = homed(live=QUICK._replace(limits=QUICK.limits._replace(macro_high=40.0)))
    machine.see(39.0, seconds=0.02)
    machine.ask(m.Jog("macro", 0.05))
    shown = []
    while machine.mode == "moving-macro":
        machine.see(39.0)
        shown.append(machine.command.macro_reference)
    assert max(shown) < 40.0 and len(shown) < 20  # it is over before 40 is shown
    assert machine.events[-1].cause == "limit reached"


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_reference_does_not_run_away_from_a_carriage_that_lags(sign: float) -> None:
    live = QUICK._replace(jogging=QUICK.jogging._replace(patience=5.0))
    machine = homed(live=live)
    machine.ask(m.Jog("macro", sign * 0.05))
    for k in range(400):
        machine.see(math.nan if k % 50 == 7 else 0.0)
        assert abs(machine.command.macro_reference) <= live.homing.lead + 1.0
    assert machine.command.macro_reference == sign * live.homing.lead


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_jog_pushes_no_harder_than_homing(sign: float) -> None:
    """Though the carriage is thrown back, to which the law would answer with more."""
    machine = homed(live=QUICK)
    machine.ask(m.Jog("macro", sign * 0.02))
    machine.see(0.0)
    assert machine.see(-sign * 60.0).motor == sign * QUICK.homing.volts


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_carriage_that_is_left_behind_by_the_whole_lead_is_leaned_on(sign: float) -> None:
    """However weak the law: 100 counts at 280 a second, and the patience of 50 ms."""
    machine = homed(live=QUICK, control=QUICK_CONTROL._replace(dead_zone_inverse="off"))
    machine.ask(m.Jog("macro", sign * 0.02))
    periods = 0
    while machine.mode == "moving-macro":
        machine.see(0.0)
        periods += 1
        assert abs(machine.out.motor) < 2.0 and periods < 1000
    assert machine.events[-1].cause == "stalled"
    assert periods * DT == pytest.approx(100.0 / 280.0 + 0.05, abs=0.008)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_push_without_a_count_is_leaning_whichever_way(sign: float) -> None:
    machine = homed(live=QUICK)
    machine.ask(m.Jog("macro", sign * 0.02))
    machine.see(0.0, seconds=0.06)
    assert machine.events[-1].cause == "stalled"


def test_a_micro_jog_on_its_way_does_not_end_however_short_the_windows() -> None:
    machine = homed(live=QUICK._replace(fine=QUICK.fine._replace(window=0.0, dwell=0.001)))
    machine.ask(m.Jog("micro", 1e-5))
    machine.see(0.0, hall(0.0), seconds=0.05)
    assert machine.mode == "moving-micro" and not machine.ends
