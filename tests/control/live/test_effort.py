"""Windows of the Hall reading, reading by reading."""

from __future__ import annotations

import math

import pytest

from macromicro.control.live._effort import macro_effort, observe
from macromicro.control.live.parameters import Fine
from macromicro.control.live.state import EMPTY, Window
from macromicro.control.settings import Control
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
