"""A noise as an autoregression (J. Burg, 1967), and its correlation length."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import lfilter

from macromicro.identify._disturbances import MAX_ORDER, autoregression, correlation_length

RNG = np.random.default_rng(5)
WHITE = RNG.normal(0.0, 0.3, 4000)


def test_white_residuals_have_no_autoregression() -> None:
    d, power = autoregression([WHITE])
    assert power == pytest.approx(np.mean(WHITE**2), rel=0.01)
    assert np.abs(d).max(initial=0.0) < 0.1


def test_coloured_residuals_give_their_filter_back() -> None:
    """D = 1 - 1.2 z^-1 + 0.5 z^-2; records one after the other count together."""
    e = lfilter([1.0], [1.0, -1.2, 0.5], WHITE)
    d, power = autoregression([e[:2500], e[2500:]])
    np.testing.assert_allclose(d[:2], [-1.2, 0.5], atol=0.06)
    assert power == pytest.approx(0.09, rel=0.08)


def test_burgs_reflections_make_forward_and_backward_errors_least() -> None:
    """Of the order that Akaike's criterion, n ln(power) + 2 order, prefers up to 30; errors of two
    records are summed, none reaches from one into the other."""
    e = lfilter([1.0, 0.7], [1.0, -0.5], WHITE[:600])
    parts = [e[:250], e[250:]]
    d, power = np.zeros(0), float(np.mean(e**2))
    scores = []
    for order in range(MAX_ORDER + 1):
        if order:
            top = np.r_[1.0, d]
            ahead = np.concatenate([np.convolve(x, top, "valid")[1:] for x in parts])
            behind = np.concatenate([np.convolve(x, top[::-1], "valid")[:-1] for x in parts])
            k = -2.0 * (ahead @ behind) / (ahead @ ahead + behind @ behind)
            d, power = np.r_[d + k * d[::-1], k], power * (1.0 - k * k)
        scores.append((600.0 * math.log(power) + 2.0 * order, order, d, power))
    _, order, wanted, least = min(scores, key=lambda s: s[0])
    found, left = autoregression(parts)
    assert len(found) == order > 1
    np.testing.assert_allclose(found, wanted, rtol=1e-8)
    assert left == pytest.approx(least, rel=1e-9)


def test_a_slow_disturbance_keeps_its_slowness() -> None:
    """A root of 0.999: autocovariances of such a record put it at 0.997 and lose most of its
    power at low frequencies."""
    roots = []
    for seed in range(20):
        drift = lfilter([1.0], [1.0, -0.999], np.random.default_rng(seed).standard_normal(8000))
        roots.append(-autoregression([drift[5000:]])[0].sum())
    assert np.mean(roots) == pytest.approx(0.998, abs=0.001)


@pytest.mark.parametrize(("n", "most"), [(45, 4), (9, 0), (4000, 30)])
def test_a_short_record_allows_a_tenth_of_its_length(n: int, most: int) -> None:
    e = np.cumsum(WHITE[:n])
    d, _ = autoregression([e])
    assert len(d) <= most


def test_a_record_of_a_few_samples_does_not_hide_the_colour_of_a_long_one() -> None:
    white = np.random.default_rng(5).standard_normal(4000)
    long = lfilter([1.0], [1.0, -0.9], white)
    alone, power = autoregression([long])
    both, same = autoregression([long, np.array([0.1]), np.array([0.2, -0.1])])
    assert both[:1] == pytest.approx(alone[:1], abs=1e-3)
    assert same == pytest.approx(power, rel=1e-2)


def test_residuals_that_are_zero_have_no_power() -> None:
    d, power = autoregression([np.zeros(100)])
    assert len(d) == 0 and power == 0.0


@pytest.mark.parametrize("pole", [0.0, 0.5, 0.95, -0.6])
def test_samples_that_go_correlation_length(pole: float) -> None:
    """(1 + pole) / (1 - pole) of a first-order autoregression."""
    found = correlation_length((np.array([-pole]), 2.0))
    assert found == pytest.approx((1.0 + pole) / (1.0 - pole), rel=1e-6)
    assert correlation_length((np.zeros(0), 1.0)) == 1.0
