"""The machine before its first sample, and how well it says that it knows its place."""

from __future__ import annotations

import math

import pytest

from macromicro.control.live import state
from macromicro.control.live.state import REST, Drive, Frame

from .bench import PITCH, Machine, homed


@pytest.mark.parametrize("kept", [None, math.nan, math.inf, -math.inf])
def test_without_a_kept_coordinate_the_first_count_is_nought(kept: float | None) -> None:
    machine = Machine(coordinate=kept, trusted=True)
    assert machine.s.drive == Drive(0.0, 0.0, REST, 0.0, False)
    machine.see(10.0)
    assert machine.s.frame == Frame(10.0, 0.0, False, 0.0, False)
    assert state.coordinate(machine.s) == 0.0


@pytest.mark.parametrize("trusted", [True, False])
def test_a_kept_coordinate_is_named_whether_it_is_trusted_or_not(trusted: bool) -> None:
    machine = Machine(coordinate=7, trusted=trusted)
    machine.see(10.0)
    assert machine.s.frame == Frame(3.0, 7.0, trusted, 0.0, True)


def test_a_doubtful_hall_sensor_leaves_no_certainty_without_the_laser() -> None:
    machine = homed()
    assert state.uncertainty(machine.p, machine.s) == 0.5 * PITCH
    doubtful = machine.s._replace(doubt="noisy")
    assert state.uncertainty(machine.p, doubtful) == math.inf
    by_laser = doubtful._replace(survey=doubtful.survey._replace(half=7e-6))
    assert state.uncertainty(machine.p, by_laser) == 7e-6
    lost = machine.s._replace(frame=machine.s.frame._replace(trusted=False))
    assert state.uncertainty(machine.p, lost) == math.inf
