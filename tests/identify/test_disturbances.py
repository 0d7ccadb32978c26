"""A force that repeats along the way is told from others, with its period and size."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from macromicro.arrays import Array
from macromicro.identify._disturbances import Ripple, ripple

T = np.arange(4000) * 1e-3
PLACE = 0.1 * np.sin(2.0 * T) + 0.03 * np.sin(9.0 * T)
TAKEN = np.column_stack([np.ones(4000), PLACE, np.gradient(PLACE, T)])


def white(seed: int) -> Array:
    return np.random.default_rng(seed).standard_normal(4000)


@settings(max_examples=25)
@given(st.floats(0.004, 0.08), st.floats(-3.1, 3.1), st.floats(0.01, 100.0), st.integers(0, 99))
def test_period_size_and_phase_are_found(
    period: float, phase: float, size: float, seed: int
) -> None:
    force = size * np.sin(2.0 * np.pi / period * PLACE + phase) + 0.3 * size * white(seed)
    found = ripple([force + TAKEN @ [3.0 * size, 20.0 * size, size]], [PLACE], [TAKEN])
    assert found is not None
    assert 2.0 * np.pi / found.turn == pytest.approx(period, rel=0.02)
    assert found.size == pytest.approx(size, rel=0.15)
    ideal = size * np.sin(2.0 * np.pi / period * PLACE + phase)
    left = found.at(PLACE) - ideal
    left -= TAKEN @ np.linalg.lstsq(TAKEN, left, rcond=None)[0]
    assert np.sqrt(np.mean(left**2)) < 0.15 * size
    assert found.at(PLACE, np.pi) == pytest.approx(-found.at(PLACE), abs=1e-9 * size)


def test_records_are_taken_together() -> None:
    """Each sees a third of the way, and both the same period."""
    force = np.sin(2.0 * np.pi / 0.03 * PLACE + 0.4)
    ways = [PLACE < 0.0, PLACE >= 0.0]
    parts = [[a[w] for w in ways] for a in (force, PLACE, TAKEN)]
    found = ripple(*parts)
    assert found is not None and 2.0 * np.pi / found.turn == pytest.approx(0.03, rel=0.01)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("pole", [0.0, 0.95, 0.999])
def test_noise_of_any_colour_is_no_ripple(pole: float, seed: int) -> None:
    force = lfilter([1.0], [1.0, -pole], white(seed))
    assert ripple([force], [PLACE], [TAKEN]) is None


def test_an_axis_that_stands_shows_none() -> None:
    assert ripple([white(0)], [np.zeros(4000)], [np.ones((4000, 1))]) is None


def test_what_goes_with_the_place_more_slowly_than_a_period_is_none() -> None:
    assert ripple([PLACE**2 + PLACE**3 / 0.1], [PLACE], [TAKEN]) is None


def test_another_phase_and_size() -> None:
    one = Ripple(80.0, 5.0, 3.0, -4.0)
    other = one.turned(0.7, 2.0)
    assert other.at(PLACE) == pytest.approx(2.0 * one.at(PLACE, 0.7))
    assert (other.turn, other.size) == (80.0, 10.0)
    assert np.hypot(other.sine, other.cosine) == pytest.approx(10.0)


@pytest.mark.parametrize("seed", [24, 32, 45, 59])
def test_slow_noise_of_a_few_values_is_no_ripple(seed: int) -> None:
    """In four of sixty records some period explains a third of it by chance."""
    random = np.random.default_rng(seed)
    speed = lfilter([0.02], [1.0, -0.98], np.repeat(random.uniform(-1.0, 1.0, 20), 200))
    place = np.cumsum(speed) * 1e-3
    taken = np.column_stack([np.ones(4000), speed, np.sign(speed), np.gradient(speed)])
    force = lfilter([1.0], [1.0, -0.999], random.standard_normal(4000))
    assert ripple([force], [place], [taken]) is None


def test_many_periods_in_a_range() -> None:
    force = np.sin(2.0 * np.pi / 0.0003 * PLACE) + 0.2 * white(3)
    found = ripple([force], [PLACE], [TAKEN])
    assert found is not None and 2.0 * np.pi / found.turn == pytest.approx(0.0003, rel=1e-3)
