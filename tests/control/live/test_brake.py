"""Coming to rest."""

from __future__ import annotations

import math
from typing import Any

import pytest

from macromicro.control.live import brake
from macromicro.control.live import messages as m
from macromicro.control.live.parameters import Live
from macromicro.control.live.state import REST, Drive
from macromicro.types import SAFE, Sample

from .bench import DT, PITCH, Machine, homed


def moving(speed: float) -> tuple[Any, float]:
    machine = homed()
    machine.ask(m.MoveMacro(2900 if speed > 0.0 else -130))
    place = 1000.0
    for _ in range(200):
        place += speed * DT
        machine.see(math.floor(place))
    return machine, place


@pytest.mark.parametrize("speed", [1500.0, -1500.0])
def test_the_reference_slows_down_at_the_deceleration(speed: float) -> None:
    machine, _ = moving(speed)
    machine.ask(m.Stop())
    found = machine.s.seen.speed
    assert found == pytest.approx(speed, rel=0.1)
    references = []
    while machine.s.work.speed != 0.0:
        machine.see(math.floor(machine.s.drive.macro_reference))  # it follows
        references.append(machine.command.macro_reference)
        assert len(references) < 1000
    way = references[-1] - machine.s.work.origin
    ideal = found * abs(found) * PITCH / (2.0 * machine.p.settings.brake.deceleration)
    assert way == pytest.approx(ideal, rel=0.05)
    assert abs(way) <= brake.distance(machine.p, found)
    machine.see(math.floor(references[-1]), seconds=0.2)
    assert (machine.mode, machine.ends[-1].outcome) == ("stopped", "stopped")
    assert machine.out == SAFE


def test_a_reading_is_not_believed_to_be_any_speed() -> None:
    machine, place = moving(1500.0)
    machine.see(place + 1e6)
    machine.ask(m.Stop())
    assert machine.s.work.speed == machine.p.settings.brake.fastest


def test_what_does_not_come_to_rest_is_not_reported_as_stopped() -> None:
    machine, place = moving(500.0)
    machine.ask(m.Stop())
    for _ in range(3000):
        place += 0.5
        machine.see(math.floor(place))
    assert machine.ends[-1].outcome == "stalled"
    assert "rest" in machine.ends[-1].evidence
    assert machine.out == SAFE


def test_missing_readings_are_no_rest() -> None:
    machine, place = moving(0.0)
    machine.ask(m.Stop())
    machine.see(math.nan, seconds=0.5)
    assert not machine.ends
    machine.see(place, seconds=0.2)
    assert machine.ends[-1].outcome == "stopped"


def test_a_stop_near_a_soft_limit_stays_within_it() -> None:
    machine = homed()
    machine.ask(m.MoveMacro(2990))
    place = 2500.0
    while place < 2985.0:
        place += 4.0
        machine.see(place)
    machine.ask(m.Stop())
    for _ in range(300):
        machine.see(2988.0)
        assert machine.command.macro_reference <= 2990.0


def test_a_stop_begins_with_empty_memories() -> None:
    machine, _ = moving(800.0)
    s = machine.s._replace(drive=machine.s.drive._replace(integral=1.4, micro_reference=0.9e-3))
    s, _ = brake.start(machine.p, s, m.STALLED, "stalled")
    assert s.drive == Drive(s.seen.encoder, 0.0, REST, 0.0, False)


def braking(speed: float, goal: float, offset: float = 0.0, origin: float = 1000.0) -> list[float]:
    """The machine and its reference, period by period, from `origin` on [raw counts]."""
    machine = Machine(coordinate=origin - offset, trusted=True)
    machine.see(origin)
    machine.ask(m.Enable())
    machine.ask(m.MoveMacro(500))
    machine.see(origin)
    seen = machine.s.seen._replace(speed=speed, standing=0.0)
    s = machine.s._replace(seen=seen, drive=machine.s.drive._replace(macro_reference=goal))
    if math.isnan(goal):
        s = s._replace(work=None)
    machine.s, _ = brake.start(machine.p, s, m.STOPPED_BY_REQUEST, "stop")
    references = []
    while machine.s.work is not None and machine.s.work.speed != 0.0:
        machine.show(Sample(machine.s.time + DT, math.nan, 0.05, 0.0, 1.0, 0.0))
        references.append(machine.command.macro_reference)
        assert len(references) < 2000
    return references


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("ahead", [7.0, 0.5])
def test_what_was_near_its_target_ends_there(sign: float, ahead: float) -> None:
    references = braking(sign * 1500.0, 1000.0 + sign * ahead)
    assert references[-1] == 1000.0 + sign * ahead
    assert all(0.0 <= sign * (r - 1000.0) <= ahead for r in references)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_target_behind_it_is_none(sign: float) -> None:
    references = braking(sign * 1500.0, 1000.0 - sign * 7.0)
    assert sign * (references[-1] - 1000.0) == pytest.approx(1500.0**2 * PITCH / 4.0, rel=0.03)


def test_the_last_part_of_a_count_is_not_passed_either() -> None:
    assert braking(57.0, 1000.017)[-1] == 1000.017


@pytest.mark.parametrize("offset", [0.0, 400.0, -400.0])
def test_a_jog_is_stopped_within_the_soft_limits_of_the_homed_frame(offset: float) -> None:
    q = Live().limits
    for edge, sign in ((q.macro_high, 1.0), (q.macro_low, -1.0)):
        last = edge + offset
        assert braking(sign * 2000.0, math.nan, offset, last - sign * 10.0)[-1] == last
        beyond = last + sign * 5.0  # where it stands beyond them, it goes no farther
        assert set(braking(sign * 2000.0, math.nan, offset, beyond)) == {beyond}
