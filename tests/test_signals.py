"""Sampled references: levels, edges at the right sample, whatever the rounding of k*dt."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.errors import InputError
from macromicro.signals import (
    decaying_square,
    pulse_train,
    sine,
    square,
    step,
    times,
)


def test_times_end_before_the_duration() -> None:
    t = times(0.3, 0.1)  # 0.3 / 0.1 is just below 3
    assert t.tolist() == [0.0, 0.1, 0.2]
    assert len(times(1.0, 1e-3)) == 1000
    assert len(times(1.0005, 1e-3)) == 1001


def test_step_rises_at_its_sample() -> None:
    t = times(1.0, 0.1)
    assert step(t, 5.0, at=0.3).tolist() == [0.0] * 3 + [5.0] * 7
    assert step(t, -2.0).tolist() == [-2.0] * 10


def test_square_starts_high_and_alternates() -> None:
    t = times(4.0, 0.5)
    assert square(t, 2.0, 2.0, offset=1.0).tolist() == [3, 3, -1, -1, 3, 3, -1, -1]


@given(st.integers(1, 200), st.integers(1, 30), st.sampled_from([1e-3, 0.1, 0.01, 0.0125]))
@settings(max_examples=50)
def test_every_half_period_has_the_same_number_of_samples(half: int, n: int, dt: float) -> None:
    x = square(times(2 * half * n * dt, dt), 1.0, 2 * half * dt)
    expected = np.tile(np.repeat([1.0, -1.0], half), n)
    assert np.array_equal(x, expected)


def test_decaying_square_gives_the_macro_targets_of_chapter_6() -> None:
    """Chapter 6, Figure 6.2: 190, 10, 170, 30, 150, 50, 130 mm about 100 mm."""
    levels = decaying_square(times(7.0, 1.0), 90.0, 2.0, loss=20.0, offset=100.0)
    assert levels.tolist() == [190, 10, 170, 30, 150, 50, 130]


def test_decaying_square_ends_at_its_offset_and_keeps_its_sign() -> None:
    x = decaying_square(times(10.0, 1.0), -2.0, 2.0, loss=1.0, offset=5.0)
    assert x.tolist() == [3, 7, 4, 6, 5, 5, 5, 5, 5, 5]


def test_sine_in_hertz() -> None:
    t = times(1.0, 0.25)
    assert np.allclose(sine(t, 3.0, 1.0, offset=1.0), [1, 4, 1, -2], atol=1e-12)
    assert np.allclose(sine(t, 3.0, 1.0, phase=np.pi / 2), [3, 0, -3, 0], atol=1e-12)


def test_pulse_train_of_appendix_d() -> None:
    """Appendix D: peak 150 encoder steps, period 4 s, duty 50 %, sampled at 0.01 s."""
    x = pulse_train(times(400.0, 0.01), 150.0, 4.0).reshape(100, 400)
    assert np.array_equal(x, np.tile([150.0] * 200 + [0.0] * 200, (100, 1)))


def test_pulse_train_with_base_and_duty() -> None:
    assert pulse_train(times(2.0, 0.25), 5.0, 1.0, duty=0.25, base=1.0).tolist() == [5, 1, 1, 1] * 2


@pytest.mark.parametrize(
    "call",
    [
        lambda t: square(t, 1.0, 0.0),
        lambda t: decaying_square(t, 1.0, -1.0, 0.1),
        lambda t: decaying_square(t, 1.0, 1.0, -0.1),
        lambda t: decaying_square(t, 1.0, 1.0, float("nan")),
        lambda t: sine(t, 1.0, float("nan")),
        lambda t: pulse_train(t, 1.0, 1.0, duty=1.0),
        lambda t: times(1.0, 0.0),
    ],
)
def test_impossible_signals_are_refused(call) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(InputError):
        call(np.zeros(3))
