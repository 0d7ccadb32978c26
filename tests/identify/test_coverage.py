"""Coverage factors (JCGM 100:2008, 2.3.6; JCGM 101:2008, 7.7)."""

from __future__ import annotations

import math

import numpy as np
import pytest

from macromicro.identify import coverage

UNIT = np.eye(1)
PLACES = (np.arange(2000) + 0.5)[:, None] / 2000


def test_normal_errors_have_the_factors_of_all() -> None:
    assert coverage.factors(None, np.eye(3)).tolist() == [[1.0] * 3, [1.96] * 3]
    draws = np.random.default_rng(0).standard_normal((20_000, 1))
    assert coverage.factors(draws, UNIT)[:, 0] == pytest.approx(coverage.NORMAL, rel=0.02)


def test_one_harmonic_and_one_rounding() -> None:
    """An arcsine's and a rectangle's quantiles over their standard deviations."""
    wave = coverage.factors(np.sin(2.0 * np.pi * PLACES), UNIT)[:, 0]
    share = np.array(coverage.SHARES)
    assert wave == pytest.approx(np.sqrt(2.0) * np.sin(0.5 * np.pi * share), rel=2e-3)
    even = coverage.factors(7.0 * (PLACES - 0.5), UNIT)[:, 0]  # of any size
    assert even == pytest.approx(np.sqrt(3.0) * share, rel=2e-3)


def test_what_follows_from_parameters_scatters_as_their_sum() -> None:
    """Two equal waves, in phase, come to one; what nothing is drawn of is normal."""
    wave = np.sin(2.0 * np.pi * PLACES)
    draws = np.hstack([wave, wave, 0.0 * wave])
    slopes = np.array([[1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 0.0, 1.0]])
    found = coverage.factors(draws, slopes)
    assert found[:, 0] == pytest.approx(coverage.factors(wave, UNIT)[:, 0])
    assert found[:, 1:].tolist() == [[1.0, 1.0], [1.96, 1.96]]


def test_errors_of_what_follows() -> None:
    spread = np.array([[4.0, 1.0, np.nan], [1.0, 9.0, np.nan], [np.nan, np.nan, np.nan]])
    slopes = np.array([[1.0, 0.0, 0.0], [2.0, -1.0, 0.0], [0.0, 1.0, 1.0], [0.0, 0.0, 0.0]])
    found = coverage.errors(spread, slopes)
    assert found[:2] == pytest.approx([2.0, math.sqrt(16.0 - 4.0 + 9.0)])
    assert math.isnan(found[2]) and found[3] == 0.0


@pytest.mark.parametrize(
    ("factor", "normal"), [(1.96, True), (1.8, True), (1.7, False), (2.3, False), (math.nan, True)]
)
def test_an_interval_is_told_where_it_is_not_twice_the_error(factor: float, normal: bool) -> None:
    assert coverage.is_normal(factor) is normal


@pytest.mark.parametrize("ratio", [0.02, 0.5, 1.0])
def test_a_positive_parameter_is_held_by_its_logarithm(ratio: float) -> None:
    """By standard errors of what was found, the truth is held too seldom where they are large."""
    draws = ratio * np.random.default_rng(0).standard_normal(3000)
    found = 3.0 * np.exp(draws)
    factors = np.array([coverage.positive(v, ratio * v, None) for v in found.tolist()])
    held = np.abs(found - 3.0)[:, None] <= factors * (ratio * found)[:, None]
    np.testing.assert_allclose(held.mean(axis=0), coverage.SHARES, atol=0.025)
    if ratio == 0.02:
        np.testing.assert_allclose(factors[0], coverage.NORMAL, rtol=0.02)
    else:
        assert (np.abs(found - 3.0) <= 1.96 * ratio * found).mean() < 0.93
    drawn = coverage.positive(3.0, 3.0 * ratio, 3.0 * draws)
    np.testing.assert_allclose(drawn, factors[0], rtol=0.08)


def test_an_error_that_is_not_known_has_the_factors_of_a_normal_one() -> None:
    for value, error in ((3.0, np.nan), (0.0, 1.0), (3.0, 0.0)):
        np.testing.assert_array_equal(coverage.positive(value, error, None), coverage.NORMAL)
    assert np.isfinite(coverage.positive(1e-9, 1.0, None)).all()


def test_normal_errors_have_their_covariance_in_any_units() -> None:
    size = np.array([1e-9, 3.0, 1e6])
    told = np.array([[1.0, 0.5, 0.0], [0.5, 1.0, -0.8], [0.0, -0.8, 1.0]]) * np.outer(size, size)
    draws = coverage.normal(told, 40_000, np.random.default_rng(0)) / size
    assert draws.T @ draws / 40_000 == pytest.approx(told / np.outer(size, size), abs=0.02)
    assert not coverage.normal(np.zeros((2, 2)), 5, np.random.default_rng(0)).any()
