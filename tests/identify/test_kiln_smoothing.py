"""The smoothing of Figure 5.4 and the averaging of Figure 5.6."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.errors import InputError
from macromicro.identify.kiln import window_means, without_spikes

T = np.arange(0.0, 400.0, 0.2)
# Up and down at 0.2 K/s, a sharp peak at 200 s.
TRIANGLE = 65.0 - 0.2 * np.abs(T - 200.0)


@given(st.floats(10.0, 390.0), st.floats(1.0, 5.0), st.floats(5.0, 20.0), st.sampled_from((-1, 1)))
def test_a_spike_anywhere_is_taken_out(at: float, lasts: float, height: float, way: int) -> None:
    y = TRIANGLE + way * height * ((at <= T) & (at + lasts > T))
    made = without_spikes(T, y)
    # Off the peak exact; a line across the peak cuts a bit of it.
    assert np.abs(made.values - TRIANGLE).max() < (1.0 if 190.0 < at < 203.0 else 1e-6)


def test_two_spikes_on_each_others_heels() -> None:
    """Together longer than one can be, with a step between them that is none."""
    y = TRIANGLE.copy()
    y[500:525] += 9.0
    y[525:550] += 10.0
    made = without_spikes(T, y)
    assert np.abs(made.values - TRIANGLE).max() < 1e-6
    # A gap between two spikes is no spike.
    y = TRIANGLE + 9.0 * (np.abs(T - 51.1) < 1.0) - 9.0 * (np.abs(T - 56.1) < 1.0)
    made = without_spikes(T, y)
    assert made.spikes == 2
    assert np.abs(made.values - TRIANGLE).max() < 1e-6


def test_a_clean_record_is_left_alone() -> None:
    made = without_spikes(T, TRIANGLE)
    np.testing.assert_array_equal(made.values, TRIANGLE)
    assert made.spikes == 0


def test_spikes_at_both_ends() -> None:
    y = TRIANGLE.copy()
    y[:10] += 9.0
    y[-10:] -= 9.0
    made = without_spikes(T, y)
    assert np.isfinite(made.values).all()


@given(st.integers(1, 50), st.integers(1, 300))
def test_means_keep_the_mean(samples: int, n: int) -> None:
    random = np.random.default_rng(n)
    u, x = random.standard_normal((2, n))
    a, b = window_means(u, x, samples)
    assert len(a) == len(b) == -(-n // samples)
    count = np.full(len(a), samples)
    count[-1] = n - samples * (len(a) - 1)
    assert a @ count / n == pytest.approx(u.mean(), abs=1e-12)
    assert b @ count / n == pytest.approx(x.mean(), abs=1e-12)


def test_windows_stay_narrow() -> None:
    a, _ = window_means(TRIANGLE, TRIANGLE, 10_000, 0.5)
    assert np.abs(np.diff(a)).max() < 0.6


@pytest.mark.parametrize(
    ("t", "y", "message"),
    [
        (T[:4], T[:4], "5 or more"),
        (T, T[:-1], "as many of each"),
        (T[::-1], T, "do not increase"),
        (T, np.where(np.arange(len(T)) % 4 < 2, 0.0, 90.0), "only rare spikes"),
        (T, np.where(T == 1.0, np.nan, T), "finite"),
    ],
)
def test_bad_records_are_refused(t: np.ndarray, y: np.ndarray, message: str) -> None:
    with pytest.raises(InputError, match=message):
        without_spikes(t, y)
