"""The supervisor's rules one by one: when a move is over, due, overtaken, arrived."""

from __future__ import annotations

import math
from typing import Any

import pytest

from macromicro.control import calibration, macro, pi, supervisor
from macromicro.control.supervisor import (
    DONE,
    MACRO,
    MICRO,
    SETTLING,
    WAITING,
    Plan,
    Progress,
)
from macromicro.types import Command, Outputs, Sample
from tests.control.errors import by_error

from .test_supervisor import DT, LEFT, NAN, made, plan

# A wait of 2 s, a dwell of 0.2 s, patience of 15 s, 2 counts of tolerance.
P = made()
REST = macro.rest(0.0)


def at(move: int, phase: int, **changed: Any) -> Progress:
    """Since 10 s in this phase of this move, which began at 9 s."""
    s = Progress(move, phase, 9.0, 10.0, NAN, 1, 100.0, 0.5e-3, LEFT, 1.4)
    return s._replace(**changed)


def next_of(what: Plan, s: Progress, t: float, place: float = 100.0, **sequence: Any) -> Progress:
    return supervisor._scheduled(made(**sequence), what, s, place, t)


def shown(what: Plan, s: Progress, t: float, place: float = 100.0, hall: float = 0.7,
          **sequence: Any) -> tuple[Progress, Command, Outputs]:  # fmt: skip
    return supervisor.step(made(**sequence), what, s, Sample(t, place, hall, 0.0, 1.0, 0.0), DT)


def test_before_the_first_move_nothing_has_moved() -> None:
    assert supervisor.begin(7.0) == Progress(
        -1, WAITING, 0.0, 0.0, pytest.approx(NAN, nan_ok=True), 1, 7.0, 0.0, REST, 0.0
    )


@pytest.mark.parametrize(
    ("move", "phase", "t", "over"),
    [
        (-1, WAITING, 0.0, True),
        (0, SETTLING, 12.4, False),  # entered at 10 s: wait of 2 s and hold of 0.5 s
        (0, SETTLING, 12.5, True),
        (0, MACRO, 99.0, False),
        (1, MICRO, 9.6, False),  # began at 9 s: hold of 0.7 s
        (1, MICRO, 9.7, True),
    ],
)
def test_when_a_move_is_over(move: int, phase: int, t: float, over: bool) -> None:
    what = plan((NAN, 0, 100.0, 0.5), (NAN, 1, 1e-3, 0.7))
    assert supervisor._complete(P, what, at(move, phase), t) == over
    following = plan((NAN, 0, 100.0, 0.5), (NAN, 1, 1e-3, 0.7), (NAN, 0, 0.0, 0.0))
    assert supervisor._due(P, following, at(move, phase), t) == over
    assert not supervisor._due(P, what, at(1, MICRO), 99.0)  # there is none
    assert supervisor._over(P, what, at(move, phase), t) == (over and move == 1)


@pytest.mark.parametrize("end", [8.0, 20.0])
def test_a_programme_with_an_end_ends_by_the_clock(end: float) -> None:
    """Whether its moves are over or not."""
    what = plan((0.0, 0, 1.0, 0.0), end=end)
    for s in (at(0, MACRO), at(0, SETTLING), at(-1, WAITING)):
        assert not supervisor._over(P, what, s, end - 0.01)
        assert supervisor._over(P, what, s, end)


@pytest.mark.parametrize(
    ("stage", "phase", "t", "due"),
    [
        (0, MACRO, 10.9, False), (0, MACRO, 11.0, True), (0, SETTLING, 11.0, True),
        (0, MICRO, 11.0, True), (0, WAITING, 11.0, True),
        (1, MACRO, 99.0, False), (1, MICRO, 11.0, True), (1, WAITING, 11.0, True),
        (1, SETTLING, 11.9, False), (1, SETTLING, 12.0, True), (1, MICRO, 10.9, False),
    ],
)  # fmt: skip
def test_when_a_scheduled_move_begins(stage: int, phase: int, t: float, due: bool) -> None:
    """At 11 s; a fine one behind a coarse one has to wait, two seconds from 10 s on."""
    what = plan((0.0, 0, 100.0, 50.0), (11.0, stage, 1.0, 0.0))
    assert supervisor._due(P, what, at(0, phase), t) == due


@pytest.mark.parametrize(
    ("moves", "overtaken"),
    [
        (((5.0, 1), (6.0, 1)), True), (((5.0, 1), (6.0, 0)), True), (((5.0, 0), (6.0, 1)), False),
        (((5.0, 1), (6.1, 1)), False), (((5.0, 1), (NAN, 1)), False), (((5.0, 1),), False),
        (((7.0, 1), (6.0, 1)), True),
    ],
)  # fmt: skip
def test_a_fine_move_is_overtaken_by_the_next_ones_time(
    moves: tuple[tuple[float, int], ...], overtaken: bool
) -> None:
    """It is 6 s."""
    what = plan((0.0, 0, 100.0, 0.0), *((start, stage, 1.0, 0.0) for start, stage in moves))
    assert supervisor._overtaken(what, 0, 6.0) == overtaken


@pytest.mark.parametrize(
    ("phase", "t", "passed"),
    [(MACRO, 10.0, 2), (SETTLING, 11.9, 2), (SETTLING, 12.0, 0), (MICRO, 11.9, 0)],
)
def test_only_while_the_carriage_is_on_its_way_are_moves_passed_over(
    phase: int, t: float, passed: int
) -> None:
    what = plan((0.0, 0, 100.0, 50.0), *((k, 1, k, 50.0) for k in (2.0, 3.0, 4.0)), (99.0, 0, 0, 0))
    found = next_of(what, at(0, phase), t, place=0.0)
    due = phase == MICRO or t >= 12.0  # the next one begins
    assert found.move == passed + (1 if due else 0)


@pytest.mark.parametrize("off", [2.0, -2.0, 2.1, -2.1, NAN])
@pytest.mark.parametrize("since", [NAN, 10.9])
def test_arrival_is_counted_from_the_first_period_within_the_tolerance(
    off: float, since: float
) -> None:
    what = plan((NAN, 0, 100.0, 0.0))
    found = next_of(what, at(0, MACRO, inside=since), 11.0, 100.0 + off)
    if abs(off) <= 2.0:
        assert found.inside == (11.0 if math.isnan(since) else since)
    else:
        assert math.isnan(found.inside)
    assert found._replace(inside=0.0) == at(0, MACRO, inside=0.0)


@pytest.mark.parametrize(("since", "settles"), [(10.79, True), (10.8, True), (10.81, False)])
def test_arrived_after_the_dwell(since: float, settles: bool) -> None:
    """The laser is reset at the wait's end."""
    found = next_of(plan((NAN, 0, 100.0, 9.0)), at(0, MACRO, inside=since), 11.0)
    if settles:
        assert found == at(0, SETTLING, inside=since, entered=11.0, zeroed=0)
    else:
        assert found == at(0, MACRO, inside=since)


@pytest.mark.parametrize(("t", "settles"), [(23.9, False), (24.0, True)])
def test_patience_is_counted_from_the_moves_begin(t: float, settles: bool) -> None:
    """15 s from 9 s on."""
    found = next_of(plan((NAN, 0, 100.0, 9.0)), at(0, MACRO), t, place=0.0)
    assert found.phase == (SETTLING if settles else MACRO)
    assert found.entered == (t if settles else 10.0)


@pytest.mark.parametrize("phase", [MACRO, SETTLING, MICRO])
@pytest.mark.parametrize("park", [0, 1])
def test_a_macro_move_begins(phase: int, park: int) -> None:
    """Without the micro-stage; without memory only where the motor has been off."""
    what = plan((0.0, 0, 100.0, 0.0), (12.0, 0, 60.0, 0.0))
    found = next_of(what, at(0, phase, zeroed=1, inside=11.9), 12.0, place=0.0, park=park)
    memory = REST if park == 1 and phase != MACRO else LEFT
    assert math.isnan(found.inside)
    assert found._replace(inside=0.0) == Progress(
        1, MACRO, 12.0, 12.0, 0.0, 1, 60.0, 0.0, memory, 0.0
    )


@pytest.mark.parametrize("phase", [WAITING, MICRO])
def test_a_micro_move_begins(phase: int) -> None:
    """With a laser reset and without integral, unless it follows another one."""
    what = plan((0.0, 1, 1e-3, 0.0), (30.0, 1, 1.5e-3, 0.0))
    found = next_of(what, at(0, phase), 30.0)
    again = phase == MICRO
    assert found == at(
        1, MICRO, began=30.0, entered=30.0, micro_reference=1.5e-3,
        zeroed=1 if again else 0, integral=1.4 if again else 0.0,
    )  # fmt: skip


def test_what_is_done_stays_done() -> None:
    """Though a move would be due after the end."""
    what = plan((0.0, 0, 100.0, 0.0), (30.0, 0, 60.0, 0.0), end=20.0)
    assert next_of(what, at(0, MICRO), 20.0) == at(0, DONE, entered=20.0)
    assert next_of(what, at(0, DONE), 31.0) == at(0, DONE)
    assert next_of(plan((NAN, 0, 1.0, 0.0)), at(0, DONE), 31.0) == at(0, DONE)


@pytest.mark.parametrize(
    ("phase", "park", "moves"),
    [(MACRO, 1, True), (SETTLING, 1, False), (MICRO, 1, False), (MACRO, 0, True),
     (SETTLING, 0, True), (MICRO, 0, True), (DONE, 0, False)],
)  # fmt: skip
@pytest.mark.parametrize("place", [60.0, NAN])
def test_what_the_motor_gets(phase: int, park: int, moves: bool, place: float) -> None:
    """The law's effort for the error in counts, while the stage is under control."""
    what = plan((NAN, 1, 1e-3, 99.0))
    s, command, out = shown(what, at(0, phase, entered=10.9), 11.0, place, park=park)
    memory, motor = by_error(P.macro, LEFT, 40.0, DT)
    if not moves or math.isnan(place):
        memory, motor = LEFT, 0.0
    assert (s.macro, out.motor) == (memory, motor)
    assert (command.macro_reference, command.macro_active) == (100.0, float(moves))


@pytest.mark.parametrize("phase", [SETTLING, MICRO])
@pytest.mark.parametrize("hall", [0.7, NAN])
def test_what_the_wires_get(phase: int, hall: float) -> None:
    """The law's effort for the error in mm, in the micro-stage's turn."""
    s, command, out = shown(plan((NAN, 1, 1e-3, 99.0)), at(0, phase, entered=10.9), 11.0, hall=hall)
    fine = calibration.position(P.calibration, hall)
    integral, ctrl = pi.step(P.micro, 1.4, 0.5e-3 - fine, DT)
    if phase != MICRO or math.isnan(hall):
        integral, ctrl = 1.4, 0.0
    assert (s.integral, out.ctrl) == (integral, ctrl)
    assert command[2:] == (0.5e-3, float(phase == MICRO), fine)


@pytest.mark.parametrize(
    ("phase", "t", "zeroed", "resets"),
    [(MICRO, 10.0, 0, True), (MICRO, 10.0, 1, False), (SETTLING, 11.9, 0, False),
     (SETTLING, 12.0, 0, True), (SETTLING, 12.0, 1, False), (MACRO, 12.0, 0, False),
     (DONE, 12.0, 0, False)],
)  # fmt: skip
def test_when_the_laser_is_reset(phase: int, t: float, zeroed: int, resets: bool) -> None:
    """Once, at the end of the wait of two seconds, or where a micro move comes first."""
    s, _, out = shown(plan((NAN, 1, 1e-3, 99.0)), at(0, phase, zeroed=zeroed), t, place=0.0)
    assert out.laser_reset == float(resets)
    assert s.zeroed == (1 if resets else zeroed)
