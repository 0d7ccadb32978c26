"""Coming to rest."""

from __future__ import annotations

import math

import pytest

from macromicro.control.live import brake
from macromicro.control.live import messages as m
from macromicro.types import SAFE

from .bench import DT, PITCH, homed


def moving(speed: float) -> tuple[object, float]:
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
