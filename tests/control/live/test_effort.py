"""Windows of the Hall reading, reading by reading."""

from __future__ import annotations

import math

import pytest

from macromicro.control import micro
from macromicro.control.live._effort import lead_carriage, macro_effort, micro_effort, observe
from macromicro.control.live.parameters import Fine
from macromicro.control.live.state import EMPTY, Window
from macromicro.control.settings import Control
from macromicro.control.stage_law import Target
from tests.control.own_laws import HERE

from .bench import Machine

DT = 1e-3
FOUR = Fine(window=0.004, band=10e-6)


def seen(p: Fine, readings: list[float], error: float = 1e-6, w: Window = EMPTY) -> Window:
    for volts in readings:
        w = observe(p, w, volts, error, DT)
    return w


@pytest.mark.parametrize("readings", [[1.0, 2.0, 2.0, 2.0], [1.0, 1.0, 1.0, 2.0]])
def test_one_other_reading_shows_that_the_sensor_lives(readings: list[float]) -> None:
    w = seen(FOUR, readings)
    assert (w.held, w.number, w.mean) == (pytest.approx(0.004), 0, pytest.approx(1e-6))


def test_a_window_of_one_reading_only_tells_nothing() -> None:
    w = seen(FOUR, [1.0, 1.0, 1.0, 1.0], w=EMPTY._replace(held=0.02, hall=0.0))
    assert (w.held, w.mean) == (0.0, pytest.approx(1e-6))
    assert seen(Fine(window=0.002), [1.0, 1.0]).held == 0.0
    assert seen(Fine(window=0.002), [1.0, 2.0]).held == pytest.approx(0.002)


def test_where_every_window_has_one_reading_that_one_counts() -> None:
    w = seen(Fine(window=0.0), [1.0, 1.0, 1.0])
    assert w.held == pytest.approx(0.003)


def test_a_missing_reading_is_left_out() -> None:
    half = seen(FOUR, [1.0, 2.0])
    assert observe(FOUR, half, math.nan, 9.0, DT) == half


@pytest.mark.parametrize(("error", "counts"), [(10e-6, True), (-10e-6, True), (10.1e-6, False)])
def test_the_band_has_two_sides(error: float, counts: bool) -> None:
    w = seen(FOUR, [1.0, 2.0, 1.0, 2.0], error, EMPTY._replace(held=0.1))
    assert w.held == (pytest.approx(0.104) if counts else 0.0)
    assert w.mean == pytest.approx(error)


def test_a_law_is_told_the_time_and_that_a_target_stands() -> None:
    """A law of another package sees more than the error."""
    machine = Machine(control=Control().joined(f"{HERE}:Told", "a test"))
    s = machine.s._replace(time=0.25)
    drive, motor = macro_effort(s, 3.0, 9.0, 1e-3)
    assert (drive.macro_reference, motor) == (9.0, 0.25)


@pytest.fixture
def machine() -> Machine:
    """Under a law whose effort [V] is the time [s]."""
    return Machine(control=Control().joined(f"{HERE}:Told", "a test"))


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_carriage_is_led_no_farther_ahead_than_homing_leads_it(
    machine: Machine, way: float
) -> None:
    lead = machine.p.settings.homing.lead
    far = lead_carriage(machine.p, machine.s, 5.0, 5.0 + way * 3.0 * lead, DT)
    assert (far.reference, far.ahead) == (5.0 + way * lead, way * 3.0 * lead)
    assert far.drive.macro_reference == far.reference
    near = lead_carriage(machine.p, machine.s, 5.0, 5.0 + way * 0.5 * lead, DT)
    assert (near.reference, near.ahead) == (5.0 + way * 0.5 * lead, way * 0.5 * lead)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_it_is_pushed_no_harder_than_homing_pushes(machine: Machine, way: float) -> None:
    most = machine.p.settings.homing.volts
    hard = lead_carriage(machine.p, machine.s._replace(time=way * 100.0), 0.0, 0.0, DT)
    assert hard.motor == way * most
    soft = lead_carriage(machine.p, machine.s._replace(time=way * 0.5 * most), 0.0, 0.0, DT)
    assert soft.motor == way * 0.5 * most


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize(
    ("ahead", "push", "stands", "stuck"),
    [
        (1.0, 0.0, True, True),  # as far ahead as it may be
        (0.9, 0.0, True, False),
        (0.0, 1.0, True, True),  # pushed as hard as it takes to move it slowly
        (0.0, 0.9, True, False),
        (1.0, 1.0, False, False),  # it moves
    ],
)
def test_it_is_stuck_where_it_is_pushed_and_stands(
    machine: Machine, ahead: float, push: float, stands: bool, stuck: bool, way: float
) -> None:
    seen = machine.s.seen._replace(standing=0.1 if stands else 0.0)
    volts = push * machine.p.settings.jogging.lean
    s = machine.s._replace(seen=seen, time=way * volts)
    reference = way * ahead * machine.p.settings.homing.lead
    assert lead_carriage(machine.p, s, 0.0, reference, DT).stuck is stuck


def test_a_micro_law_is_told_that_its_target_stands(monkeypatch: pytest.MonkeyPatch) -> None:
    aims = []

    def step(laws, fine, kept, integral, aim, *_):  # type: ignore[no-untyped-def]
        aims.append(aim)
        return integral, kept, 0.0

    monkeypatch.setattr(micro, "step", step)
    drive, _ = micro_effort(Machine().s, 1.0, 1e-3, DT)
    assert aims == [Target(1e-3, 0.0, 0.0, math.inf)] and drive.micro_reference == 1e-3
