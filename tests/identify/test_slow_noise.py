"""Errors where noise is as slow as the record."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import lfilter

from macromicro.identify.slow_noise import Fit, _slowed, is_slow, together, unshown
from macromicro.identify.spread import autoregression, robust_covariance


def walk(n: int, pole: float, seed: int) -> np.ndarray:
    random = np.random.default_rng(seed)
    start = random.standard_normal() / math.sqrt(1.0 - pole**2)
    return np.asarray(lfilter([1.0], [1.0, -pole], random.standard_normal(n), zi=[pole * start])[0])


@pytest.mark.parametrize("pole", [0.0, 0.5, 0.95, -0.6])
def test_samples_that_go_together(pole: float) -> None:
    """(1 + pole) / (1 - pole) of a first-order autoregression."""
    found = together((np.array([-pole]), 2.0))
    assert found == pytest.approx((1.0 + pole) / (1.0 - pole), rel=1e-6)
    assert together((np.zeros(0), 1.0)) == 1.0


def test_the_slowest_root_is_slowed() -> None:
    d = np.real(np.poly([0.9, 0.5, -0.7]))[1:]
    slower, power = _slowed((d, 3.0), 2.0)
    assert sorted(np.roots(np.r_[1.0, slower]).real) == pytest.approx([-0.7, 0.5, 0.95])
    assert power == 3.0
    assert np.isclose(np.roots(np.r_[1.0, _slowed((d, 3.0), 0.01)[0]]), 0.0, atol=1e-6).sum() == 1
    swings = np.real(np.poly([0.9j, -0.9j]))[1:]
    np.testing.assert_array_equal(_slowed((swings, 1.0), 2.0)[0], swings)  # none is real


def test_quick_noise_and_long_records_are_left_alone() -> None:
    assert not is_slow(400, (np.array([-0.3]), 1.0))
    assert is_slow(400, (np.array([-0.9]), 1.0))
    assert not is_slow(300_000, (np.array([-0.99999]), 1.0))  # too long to draw anew


@pytest.mark.parametrize(("pole", "least"), [(0.0, 0.9), (0.97, 0.85)])
def test_the_mean_of_slow_noise_is_told_with_its_error(pole: float, least: float) -> None:
    """Six to seven independent values: taken from the residuals alone, 95 % hold in 74 of 100."""
    n, inside = 400, []
    for seed in range(60):
        y = walk(n, pole, seed)
        psi = np.ones((n, 1))
        mean = float(y.mean())
        told = math.sqrt(robust_covariance(psi, y - mean, [n])[0, 0])
        inside.append(abs(mean) <= 1.96 * told)
    assert np.mean(inside) > least


def test_a_record_that_stands_has_no_part() -> None:
    """Two records, one of which leaves nothing."""
    y = np.r_[walk(300, 0.97, 3), np.zeros(300)]
    psi = np.r_[np.ones(300), np.zeros(300)][:, None]
    found = robust_covariance(psi, y - psi[:, 0] * y[:300].mean(), [300, 600])
    assert np.isfinite(found).all() and found[0, 0] > 0.0


def test_residuals_show_noise_quicker_than_it_is() -> None:
    """Of a record of eight correlations the mean is taken off; what is unshown comes back: in the
    middle of many records, as slow as it was, and drawn as widely as it may be off."""
    n, pole = 400, 0.96
    ones = np.ones((n, 1))
    fit = Fit([n], ones.T / n, ones)
    seen, mended, above = [], [], []
    truth = (1.0 + pole) / (1.0 - pole)
    for seed in range(60):
        y = walk(n, pole, seed)
        shown = autoregression([y - y.mean()])
        seen.append(together(shown))
        may = [shown]
        if is_slow(n, shown):
            may = unshown(fit, shown, autoregression, np.random.default_rng(0))
        slow = [together(one) for one in may]
        assert max(slow) < 1.5 * n  # what goes together for longer than a record is a constant
        mended.append(np.median(slow))
        above.append(np.mean(np.array(slow) > truth))
    assert np.median(seen) < 0.8 * truth
    assert 0.75 * truth < np.median(mended) < 1.35 * truth
    # Of what it may be, the truth is neither always the least nor always the most.
    assert np.mean([0.05 < a < 0.95 for a in above]) > 0.7
