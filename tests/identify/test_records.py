"""Records before a fit: averaging both directions, differences, prefilters."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from macromicro.errors import InputError
from macromicro.identify import (
    average_runs,
    differentiated,
    integrated,
    lowpassed,
    output_error,
)
from macromicro.identify.notices import SaturationWarning
from macromicro.identify.records import flag_saturation

DT = 1e-3


def test_runs_of_both_directions_are_mirrored_and_averaged() -> None:
    """Section 4.2.5: "a series of runs in opposite directions are averaged together"."""
    forth = (np.ones(5), 7.0 + np.array([0.0, 1.0, 2.0, 3.0, 4.0]))
    back = (-np.ones(6), 90.0 - np.array([0.0, 3.0, 4.0, 5.0, 6.0, 9.0]))
    u, x = average_runs([forth, back])
    np.testing.assert_array_equal(u, np.ones(5))
    np.testing.assert_array_equal(x, [0.0, 2.0, 3.0, 4.0, 5.0])


@settings(max_examples=40, deadline=None)
@given(st.lists(st.integers(-5000, 5000), min_size=2, max_size=50), st.sampled_from([1e-3, 0.01]))
def test_integrating_differences_gives_the_positions_back(counts: list[int], dt: float) -> None:
    x = np.array(counts, dtype=float)
    u, speed = differentiated(np.arange(len(x)), x, dt)
    _, again = integrated(u, speed, dt)
    np.testing.assert_allclose(again, x[1:] - x[0], atol=1e-8)
    np.testing.assert_array_equal(u, np.arange(len(x) - 1))


def test_prefilters_leave_the_model_unchanged() -> None:
    """The same filter on input and output, both from rest: the same a and b."""
    u = np.sign(np.random.default_rng(1).standard_normal(500))
    y = lfilter([0.0, 165.72], [1.0, -0.95833], u)
    for data in (integrated(u, y, DT), lowpassed(u, y, DT, cutoff=80.0)):
        fit = output_error(*data, 1, 1, DT)
        assert fit.a == pytest.approx([-0.95833])
        assert fit.b == pytest.approx([165.72])


def test_integration_whitens_the_noise_of_counts() -> None:
    """Rounding noise is white on positions and (1 - z^-1) e on speeds."""
    rng = np.random.default_rng(0)
    u = np.repeat(np.sign(rng.standard_normal(400)), 5)
    travel = np.cumsum(lfilter([0.0, 165.72], [1.0, -0.95833], u)) * DT
    counts = np.floor(np.concatenate([[0.0], travel]) + 0.5 + 0.3 * rng.standard_normal(2001))
    data = differentiated(np.concatenate([u, u[-1:]]), counts, DT)
    rough = output_error(*data, 1, 1, DT).whiteness
    assert rough.autocorrelation[0] == pytest.approx(-0.5, abs=0.05)
    assert not rough.white
    smooth = output_error(*integrated(*data, DT), 1, 1, DT).whiteness
    assert abs(smooth.autocorrelation[0]) < 0.1


def test_input_beyond_a_known_limit_is_clipped_with_a_warning() -> None:
    with pytest.warns(SaturationWarning, match="2 of 4 samples beyond the limit of 5"):
        got = flag_saturation(np.array([1.0, 6.0, -7.0, 5.0]), "u", limit=5.0)
    np.testing.assert_array_equal(got, [1.0, 5.0, -5.0, 5.0])


@pytest.mark.parametrize("levels", [1, 2, 20])
def test_steps_and_binary_sequences_are_not_called_saturated(
    levels: int, recwarn: pytest.WarningsRecorder
) -> None:
    flag_saturation(np.repeat(np.linspace(1.0, 2.0, levels), 50), "u")
    assert not recwarn.list


def test_two_levels_with_means_of_both_between_are_not_called_saturated(
    recwarn: pytest.WarningsRecorder,
) -> None:
    u = np.repeat([2.0, -2.0] * 4, 50)
    u[50::50] = np.linspace(-1.0, 1.0, 7)
    flag_saturation(u, "u")
    assert not recwarn.list


@pytest.mark.parametrize(
    ("runs", "match"),
    [
        ([], "there is no run"),
        ([(np.ones(3), np.ones(4))], r"runs\[0\]"),
        ([(np.ones(3), [0.0, np.inf, 1.0])], "row 1"),
    ],
)
def test_unusable_runs_are_refused(runs: list, match: str) -> None:
    with pytest.raises(InputError, match=match):
        average_runs(runs)


def test_unusable_filters_are_refused() -> None:
    with pytest.raises(InputError, match="500 Hz"):
        lowpassed(np.ones(50), np.ones(50), DT, cutoff=600.0)
    with pytest.raises(InputError, match="dt above 0"):
        differentiated(np.ones(3), np.ones(3), 0.0)
