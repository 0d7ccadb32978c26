"""Autoregression and covariance against their textbook formulas."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import lfilter

from macromicro.arrays import Array
from macromicro.identify._spread import (
    MAX_ORDER,
    autoregression,
    clustered,
    covering,
    driven,
    larger,
    robust_covariance,
    standard_errors,
)

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


def test_a_record_of_which_nothing_is_left_changes_no_covariance() -> None:
    random = np.random.default_rng(6)
    psi, residual = random.standard_normal((300, 2)), random.standard_normal(300)
    alone = robust_covariance(psi, residual, [120, 300])
    assert robust_covariance(psi, residual, [0, 120, 120, 300]) == pytest.approx(alone)


def test_residuals_that_are_zero_have_no_power() -> None:
    d, power = autoregression([np.zeros(100)])
    assert len(d) == 0 and power == 0.0


@pytest.mark.parametrize("weighted", [False, True])
def test_white_residuals_give_the_usual_covariance(weighted: bool) -> None:
    """sigma^2 (psi' psi)^-1, sigma^2 by n - p; columns of any scale, or of zeros."""
    psi = RNG.normal(size=(4000, 3)) * [1.0, 1e6, 1.0]
    psi[:, 2] = 0.0
    w = np.where(np.arange(4000) % 2 == 0, 2.0, 0.5) if weighted else None
    found = robust_covariance(psi, WHITE, [1500, 4000], w)
    d, power = autoregression([WHITE[:1500], WHITE[1500:]])
    assert len(d) == 0 or np.abs(d).max() < 0.1
    load = np.ones(4000) if w is None else w
    two = psi[:, :2]
    r = np.linalg.inv(two.T @ (two * load[:, None]))
    s = (two * load[:, None]).T @ (two * load[:, None])
    np.testing.assert_allclose(
        found[:2, :2], r @ s @ r * power * 4000.0 / 3997.0, rtol=0.02, atol=1e-12
    )
    assert (found[2] == 0.0).all() and (found[:, 2] == 0.0).all()


def test_coloured_residuals_count_as_they_pile_up() -> None:
    """A constant's variance is that of the mean of the noise: power / D(1)^2 / n."""
    e = lfilter([1.0], [1.0, -0.8], WHITE)
    found = robust_covariance(np.ones((4000, 1)), e, [4000])
    d, power = autoregression([e])
    sums = lfilter([1.0], np.r_[1.0, d], np.r_[np.ones(4000), np.zeros(100)])
    wanted = power * float(sums @ sums) / 4000.0**2 * 4000.0 / 3999.0
    assert found[0, 0] == pytest.approx(wanted, rel=1e-5)
    assert found[0, 0] == pytest.approx(0.09 / 0.2**2 / 4000.0, rel=0.2)


def test_standard_errors_are_the_textbooks_whatever_the_sizes() -> None:
    """Square roots of the diagonal of (J'J)^-1, also where a parameter hardly moves anything;
    what moves nothing at all is not known at all."""
    j = RNG.normal(size=(50, 3)) @ [[1.0, 0.4, 0.0], [0.0, 1.0, 0.3], [0.0, 0.0, 1.0]]
    wanted = np.sqrt(np.diag(np.linalg.inv(j.T @ j)))
    sizes = np.array([1.0, 1e-9, 1e5])
    np.testing.assert_allclose(standard_errors(j * sizes), wanted / sizes, rtol=1e-9)
    found = standard_errors(np.c_[j, np.zeros(50)])
    np.testing.assert_allclose(found, [*wanted, math.inf], rtol=1e-9)


def test_stretches_of_unlike_noise_tell_the_error_of_a_mean() -> None:
    """One parameter, slope 1: squared sums of the stretches over n^2, k / (k - 1), neighbours."""
    e = np.array([1.0, 2.0, -4.0, 0.5, 0.5, 3.0, -3.0])
    starts = [0, 2, 3, 5]
    sums = np.array([3.0, -4.0, 1.0, 0.0])
    wanted = (sums @ sums + 2.0 * 0.5 * (sums[1:] @ sums[:-1])) / 49.0 * 4.0 / 3.0
    found = clustered(np.ones((7, 1)), e, starts)
    assert found[0, 0] == pytest.approx(wanted)
    wide = clustered(np.full((7, 1), 0.1), e, starts)
    assert wide[0, 0] == pytest.approx(100.0 * wanted)


def test_stretches_need_no_model_of_what_happens_within() -> None:
    """Levels of 40 samples each: the error is that of as many values as there are stretches."""
    random = np.random.default_rng(0)
    found, said = [], []
    for _ in range(200):
        e = np.repeat(random.standard_normal(100), 40)
        found.append(e.mean())
        said.append(clustered(np.ones((4000, 1)), e, np.arange(0, 4000, 40))[0, 0])
    assert np.sqrt(np.mean(said)) == pytest.approx(0.1, rel=0.06)
    assert np.std(found) == pytest.approx(0.1, rel=0.12)


def test_instruments_widen_by_how_little_they_know_of_the_regressors() -> None:
    """White noise: var(e) (z'x)^-1 z'z (x'z)^-1, the textbook's."""
    random = np.random.default_rng(1)
    z = random.standard_normal((4000, 2))
    x = z @ np.array([[1.0, 0.3], [0.0, 0.5]]) + 0.2 * random.standard_normal((4000, 2))
    found = robust_covariance(z, WHITE, [4000], None, x)
    inverse = np.linalg.inv(z.T @ x)
    wanted = np.mean(WHITE**2) * inverse @ (z.T @ z) @ inverse.T
    np.testing.assert_allclose(np.sqrt(np.diag(found)), np.sqrt(np.diag(wanted)), rtol=0.05)
    np.testing.assert_allclose(found, wanted, rtol=0.2)


def test_sums_of_a_noise_scatter_as_its_autoregression_tells() -> None:
    """Of two records of e(k) = 0.9 e(k - 1) + w(k); a weight that is 0 counts no sample."""
    random = np.random.default_rng(8)
    weights = [random.standard_normal((60, 2)), np.zeros((40, 2))]
    weights[1][7:9] = 1.0, -2.0
    e = lfilter([0.3], [1.0, -0.9], random.standard_normal((4000, 400)), axis=1)[:, -100:]
    sums = e[:, :60] @ weights[0]
    apart = e[::-1, 60:] @ weights[1]  # of another record: they are by chance together
    wanted = np.cov((sums + apart).T)
    found = driven(weights, (np.array([-0.9]), 0.09))
    np.testing.assert_allclose(found, wanted, rtol=0.08, atol=0.02 * np.abs(wanted).max())


def test_the_larger_of_two_errors_with_the_correlations_of_more_of_them() -> None:
    one = np.array([[4.0, 1.0, 0.0], [1.0, 1.0, 0.2], [0.0, 0.2, 1.0]])
    other = np.array([[1.0, -0.9, 0.0], [-0.9, 9.0, 0.0], [0.0, 0.0, 16.0]])
    found = larger(one, other)
    assert np.sqrt(np.diag(found)) == pytest.approx([2.0, 3.0, 4.0])
    assert found[0, 1] / 6.0 == pytest.approx(-0.9 / 3.0)
    assert larger(other, one) == pytest.approx(found)
    assert larger(one, 0.5 * one) == pytest.approx(one)
    assert larger(one, np.zeros((3, 3))) == pytest.approx(one)


def test_what_covers_two_covariances_is_as_unsure_as_either_in_every_direction() -> None:
    random = np.random.default_rng(0)
    one, other = (m @ m.T for m in random.standard_normal((2, 3, 3)))
    found = covering(one, other)
    for least in (one, other):
        assert np.linalg.eigvalsh(found - least).min() > -1e-9
    # The least of these: in some direction it is no wider than one, and in some than the other.
    assert np.linalg.eigvalsh(found - one).min() == pytest.approx(0.0, abs=1e-9)
    assert np.linalg.eigvalsh(found - other).min() == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(covering(one, 0.5 * one), one)
    np.testing.assert_allclose(covering(one, 4.0 * one), 4.0 * one)
    scale = np.diag([1e-6, 1.0, 1e6])
    np.testing.assert_allclose(
        covering(scale @ one @ scale, scale @ other @ scale), scale @ found @ scale, rtol=1e-6
    )


def walk(n: int, pole: float, seed: int) -> Array:
    random = np.random.default_rng(seed)
    start = random.standard_normal() / math.sqrt(1.0 - pole**2)
    return np.asarray(lfilter([1.0], [1.0, -pole], random.standard_normal(n), zi=[pole * start])[0])


@pytest.mark.parametrize(("pole", "least", "many"), [(0.0, 0.9, 60), (0.97, 0.85, 40)])
def test_the_mean_of_slow_noise_is_told_with_its_error(
    pole: float, least: float, many: int
) -> None:
    """Six to seven independent values: taken from the residuals alone, 95 % hold in 74 of 100."""
    n, inside = 400, []
    for seed in range(many):
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


def test_a_swing_that_a_white_force_keeps_up_is_no_slow_noise() -> None:
    """Of 2.2 Hz in 4 s; taken for slow noise its mean was told six times too wide."""
    n, damped = 800, 0.98 * np.exp(0.07j)
    ones, off, told = np.ones((n, 1)), [], []
    for seed in range(20):
        white = np.random.default_rng(seed).standard_normal(n + 500)
        e = lfilter([1.0], [1.0, -2.0 * damped.real, abs(damped) ** 2], white)[500:]
        off.append(e.mean())
        told.append(robust_covariance(ones, e - e.mean(), [n])[0, 0])
    assert 0.6 < np.std(off) / math.sqrt(np.mean(told)) < 1.6
