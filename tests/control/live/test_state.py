"""The machine before its first sample, and how well it says that it knows its place."""

from __future__ import annotations

import math
from typing import Any

import pytest

from macromicro.control.live import edges, state
from macromicro.control.live import messages as m
from macromicro.control.live.parameters import prepare
from macromicro.control.live.state import NOWHERE, REST, Drive, Frame, LiveState, Seen, Targets
from macromicro.control.live.survey import Survey

from .bench import PITCH, Machine, homed

MACHINE = homed()
P = MACHINE.p


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


def test_before_its_first_sample_it_is_off_and_knows_nothing() -> None:
    s = Machine().s
    assert (s.mode, s.time, s.shift, s.fan, s.given) == (m.DISABLED, 0.0, 0.0, 0.0, 0)
    assert (s.motion, s.work, s.fault, s.doubt) == (None, None, None, "")
    assert repr(s.seen) == "Seen(encoder=nan, speed=0.0, standing=0.0, fine=nan, position=nan)"
    assert s.survey == Survey() and s.target == NOWHERE
    assert all(value == 0.0 for memory in state.REST for value in memory)
    assert state.EMPTY[:2] == (0.0, 0) and (state.EMPTY.held, state.EMPTY.lives) == (0.0, False)


def placed(half: float = math.inf, trusted: bool = True, **changed: Any) -> LiveState:
    """At 100 counts of the homed frame, raw 60, with 2 mm; the laser has it 3 um off."""
    s = MACHINE.s
    frame = s.frame._replace(offset=-40.0, trusted=trusted)
    laser = 100 * PITCH + 2e-3 + 3e-6
    phase = edges.begin(-40.0, 0.0, PITCH, 2e-4)._replace(aa=1e-12, bb=0.0)
    survey = Survey(phase=phase, laser=laser, base=-40 * PITCH, counts=60.0, half=half)
    whole = laser if half < math.inf else 100 * PITCH + 2e-3
    seen = Seen(60.0, 0.0, 1.0, 2e-3, whole)
    return s._replace(frame=frame, seen=seen, survey=survey, **changed)


NEAR = pytest.approx


def test_the_place_is_count_and_contraction_or_the_lasers() -> None:
    s = placed()
    assert state.coordinate(s) == 100.0
    assert not state.by_laser(P, s)
    assert state.position(P, s) == NEAR(100 * PITCH + 2e-3, abs=1e-12)
    assert state.carriage(P, s) == NEAR(100 * PITCH, abs=1e-12)
    s = placed(half=9e-6)
    assert state.by_laser(P, s)
    assert state.position(P, s) == NEAR(100 * PITCH + 2e-3 + 3e-6, abs=1e-12)
    assert state.carriage(P, s) == NEAR(100 * PITCH + 3e-6, abs=1e-12)


def test_the_laser_tells_the_place_where_it_does_better_than_half_a_count() -> None:
    assert state.by_laser(P, placed(half=0.499 * PITCH))
    assert not state.by_laser(P, placed(half=0.5 * PITCH))
    assert not state.by_laser(P, placed(half=9e-6, trusted=False))
    assert state.uncertainty(P, placed(half=9e-6)) == 9e-6
    assert state.uncertainty(P, placed(half=9e-6, trusted=False)) == math.inf


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_on_a_fast_way_the_place_is_less_certain(sign: float) -> None:
    """By what the slack wire bounces unseen, beside half a count."""
    q = P.settings.edges
    for speed, more in ((q.fastest, 0.0), (1.01 * q.fastest, q.bounce)):
        s = placed()
        s = s._replace(seen=s.seen._replace(speed=sign * speed))
        assert state.uncertainty(P, s) == NEAR(0.5 * PITCH + more, abs=1e-15)


def test_a_laser_that_has_the_stage_elsewhere_is_within_what_is_told() -> None:
    s = placed()
    s = s._replace(survey=s.survey._replace(laser=s.survey.laser + 1e-3))
    assert state.uncertainty(P, s) == NEAR(1e-3 + 3e-6 + PITCH, abs=1e-12)


def test_times_are_told_as_the_samples_have_them() -> None:
    assert state.now(placed(time=5.0, shift=2.0)) == 7.0


def test_it_is_busy_while_a_motion_is_under_way() -> None:
    machine = homed()
    assert not state.busy(machine.s)
    machine.ask(m.MoveMicro(1e-3))
    assert state.busy(machine.s)


@pytest.mark.parametrize("mode", [m.READY, m.MOVING_MACRO, m.HOLDING])
def test_the_target_is_that_of_the_whole_positioner(mode: int) -> None:
    """A move of the micro-stage leaves the carriage where it is."""
    for given, whole in (
        (Targets(0.25, 7.0, 1e-3), 0.25),
        (Targets(micro=1e-3), 100 * PITCH + 1e-3),
    ):
        s = placed(target=given, mode=mode)
        assert state.target(P, s) == state.goal(P, s) == NEAR(whole, abs=1e-12)
    carriage = prepare(stages=(m.MACRO,))
    s = placed(target=Targets(macro=7.0), mode=mode)
    assert state.target(carriage, s) == NEAR(7 * PITCH, abs=1e-12)


@pytest.mark.parametrize(
    ("mode", "goal"),
    [
        (m.MOVING_MICRO, 100 * PITCH + 1.5e-3),
        (m.HOLDING, 100 * PITCH + 1.5e-3),
        (m.MOVING_MACRO, 110 * PITCH),
        (m.SETTLING, 110 * PITCH),
        (m.READY, math.nan),
    ],
)
def test_without_a_target_it_goes_to_its_set_point(mode: int, goal: float) -> None:
    drive = MACHINE.s.drive._replace(macro_reference=70.0, micro_reference=1.5e-3)
    s = placed(mode=mode, drive=drive, target=NOWHERE)
    assert math.isnan(state.target(P, s))
    assert state.goal(P, s) == NEAR(goal, abs=1e-12, nan_ok=True)
