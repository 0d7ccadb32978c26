"""Spikes and windows in records of a few rows."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.identify.kiln import window_means, without_spikes

T = np.arange(60.0)


def spiked(*rows: int, height: float = 20.0) -> np.ndarray:
    y = 0.5 * T
    y[list(rows)] += height
    return y


def test_a_window_reaches_as_far_as_it_is_told_to_either_side() -> None:
    """Jumps from row 20 to 21 and from 22 to 23; 1.5 s before the first and behind the last."""
    found = without_spikes(T, spiked(21, 22), window=1.5)
    assert np.flatnonzero(found.replaced).tolist() == list(range(19, 25))
    assert found.spikes == 1
    np.testing.assert_allclose(found.values, 0.5 * T)


@pytest.mark.parametrize("slope", [7.0, 7.1])
def test_only_what_is_steeper_than_told_is_a_jump(slope: float) -> None:
    """By the time between the samples, here half a second."""
    y = np.zeros(60)
    y[30] = 0.5 * slope
    assert without_spikes(0.5 * T, y).spikes == (slope > 7.0)
    assert without_spikes(0.5 * T, -y).spikes == (slope > 7.0)


@pytest.mark.parametrize(("longest", "spikes"), [(15.0, 1), (14.9, 2)])
def test_a_spike_ends_within_its_longest_time(longest: float, spikes: int) -> None:
    """From jump to jump 15 s; where it is too long they are two steps, which stay."""
    found = without_spikes(T, spiked(*range(20, 35)), window=0.6, longest=longest)
    assert found.spikes == spikes
    assert (found.replaced.sum() == 17) == (spikes == 1)


@pytest.mark.parametrize("level", [0.0, 100.0, -100.0])
@pytest.mark.parametrize(("back", "ends"), [(0.49, True), (0.51, False)])
def test_it_ends_where_the_record_is_nearer_to_what_it_was(
    back: float, ends: bool, level: float
) -> None:
    y = np.zeros(60)
    y[20:24], y[24:] = 20.0, 20.0 * back
    y += level
    found = without_spikes(T, y, window=0.6)
    assert found.spikes == (1 if ends else 2)
    assert found.replaced[22] == ends
    np.testing.assert_allclose(without_spikes(T, -y, window=0.6).values, -found.values)


def test_a_window_becomes_the_line_between_the_means_of_three_samples() -> None:
    y = np.array([1.0, 2.0, 6.0, 50.0, 50.0, 4.0, 8.0, 9.0, 9.0, 9.0, 9.0])
    found = without_spikes(T[:11], y, window=0.1)
    # Rows 2 to 5 go: means 1.5 (two samples) at 0.5 s and 26/3 at 7 s.
    line = np.interp(np.arange(2.0, 6.0), [0.5, 7.0], [1.5, 26.0 / 3.0])
    np.testing.assert_allclose(found.values[2:6], line)
    assert np.flatnonzero(found.replaced).tolist() == [2, 3, 4, 5]
    np.testing.assert_array_equal(found.values[6:], y[6:])


def test_at_an_end_it_becomes_the_mean_of_the_other_side() -> None:
    y = np.array([90.0, 1.0, 2.0, 6.0, 6.0, 6.0, 6.0, 7.0, 5.0, 90.0])
    found = without_spikes(T[:10], y, window=0.1, longest=3.0)
    np.testing.assert_allclose(found.values[:2], (2.0 + 6.0 + 6.0) / 3.0)
    np.testing.assert_allclose(found.values[8:], (6.0 + 6.0 + 7.0) / 3.0)
    assert found.spikes == 2


@pytest.mark.parametrize(("rows", "refused"), [(5, False), (4, True)])
def test_five_samples_are_needed(rows: int, refused: bool) -> None:
    if refused:
        with pytest.raises(InputError, match="5 or more"):
            without_spikes(T[:rows], T[:rows])
    else:
        assert without_spikes(T[:rows], T[:rows]).spikes == 0


def test_half_of_the_record_may_go_and_no_more() -> None:
    y = np.zeros(12)
    y[3:7] = 50.0
    assert without_spikes(T[:12], y, window=0.1).replaced.mean() == 0.5
    with pytest.raises(InputError, match="55 % of the record"):
        without_spikes(T[:11], y[:11], window=0.1)


def test_equal_times_are_refused() -> None:
    with pytest.raises(InputError, match="do not increase"):
        without_spikes([0.0, 1.0, 1.0, 2.0, 3.0], np.zeros(5))


def test_a_window_of_means_closes_by_number_or_by_width() -> None:
    u = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 2.0, 1.9, 1.4, 1.3])
    x = np.arange(9.0)
    a, b = window_means(u, x, 3, 0.5)
    # Three; two, as 2.0 is too far from 0.3; two, as 1.4 is from 2.0; two.
    np.testing.assert_allclose(a, [0.1, 0.35, 1.95, 1.35])
    np.testing.assert_allclose(b, [1.0, 3.5, 5.5, 7.5])
    np.testing.assert_allclose(window_means(-u, x, 3, 0.5)[0], -a)
    assert window_means(u, x, 1)[0].tolist() == u.tolist()
    assert window_means([0.0, 0.5], [1.0, 2.0], 9, 0.5)[0].tolist() == [0.25]  # as wide as told
    assert [v.size for v in window_means([], [], 1)] == [0, 0]


@pytest.mark.parametrize(
    ("u", "samples", "width"), [([1.0], 1, 1.0), ([1.0, 2.0], 0, 1.0), ([1.0, 2.0], 1, 0.0)]
)
def test_impossible_windows_are_refused(u: list[float], samples: int, width: float) -> None:
    with pytest.raises(InputError, match="averaging"):
        window_means(u, [1.0, 2.0], samples, width)
