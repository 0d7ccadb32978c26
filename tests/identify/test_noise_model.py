"""Box-Jenkins: the model, the noise beside it, its errors, and what it says of other methods."""

from __future__ import annotations

import warnings
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.signal import lfilter

from macromicro import identify
from macromicro.arrays import Array
from macromicro.identify import noise_model as model
from macromicro.identify.notices import DataWarning
from macromicro.identify.regression import Solution, covariance, prepared

A, B = np.array([-1.65833, 0.670831]), np.array([40.0, 9.716])
TRUTH = np.r_[A, B]
DT = 1e-3
METHODS = ("least_squares", "gls", "mls", "sriv", "output_error", "box_jenkins")


def steps(seed: int, n: int = 3000) -> Array:
    return np.asarray(np.repeat(np.random.default_rng(seed).uniform(-2.0, 2.0, n // 250), 250))


def disturbed(seed: int, pole: float = 0.95) -> tuple[Array, Array]:
    """The input and the output of a machine whose input is pushed by coloured noise."""
    u = steps(seed)
    noise = np.random.default_rng(seed + 500).standard_normal(len(u) + 500)
    force = lfilter([0.03], [1.0, -pole], noise)[500:]
    return u, np.asarray(lfilter(np.r_[0.0, B], np.r_[1.0, A], u + force))


def fit(name: str, u: Array, y: Array, order: int = 2) -> identify.LinearFit:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DataWarning)
        found: identify.LinearFit = getattr(identify, name)(u, y, order, order, DT)
    return found


@cache
def of_disturbed(name: str, seed: int) -> identify.LinearFit:
    return fit(name, *disturbed(seed))


def test_the_machine_is_found_where_output_error_follows_the_noise() -> None:
    """Three records: each parameter within four standard errors; output error is far off in most,
    and says so."""
    far = slow = 0
    for seed in range(3):
        found = of_disturbed("box_jenkins", seed)
        assert not found.doubt and found.whiteness.white and found.converged
        np.testing.assert_array_less(np.abs(np.r_[found.a, found.b] - TRUTH), 4.0 * found.std)
        assert abs(found.b[0] - 40.0) < 1.0
        other = of_disturbed("output_error", seed)
        if abs(other.b[0] - 40.0) > 10.0:
            far += 1
            if np.abs(np.roots(np.r_[1.0, other.a])).max() > 0.97:  # a slow pole that cancels
                slow += 1
                assert "box_jenkins" in other.doubt and np.isnan(other.std).all()
    assert far >= 2 and slow >= 1


def test_its_residuals_are_the_noise_through_d_and_the_sum_is_least() -> None:
    u, y = disturbed(1)
    found = of_disturbed("box_jenkins", 1)
    d = np.r_[1.0, found.noise]
    left = lfilter(d, [1.0], y - found.free_run[0])
    left[: len(found.noise)] = 0.0
    np.testing.assert_allclose(found.residuals[0], left, atol=1e-6 * np.abs(left).max())
    least = float(left @ left)
    theta = np.r_[found.a, found.b]
    for k in range(4):
        for by in (2.0, -2.0):
            moved = theta.copy()
            moved[k] += by * found.std[k]
            run = lfilter(np.r_[0.0, moved[2:]], np.r_[1.0, moved[:2]], u)
            e = lfilter(d, [1.0], y - run)[len(found.noise) :]
            assert float(e @ e) > least


@pytest.mark.slow  # repeated trials
def test_its_errors_are_those_of_repeated_trials() -> None:
    """Over 40 records: the spread within 35 % of what is told; a smaller one would be a lie."""
    found = [fit("box_jenkins", *disturbed(seed, 0.99)) for seed in range(40)]
    values = np.array([np.r_[f.a, f.b] for f in found])
    told = np.median([f.std for f in found], axis=0)
    np.testing.assert_allclose(values.std(axis=0), told, rtol=0.35)


@pytest.mark.parametrize("name", ["least_squares", "gls", "mls"])
def test_methods_that_suppose_white_residuals_withhold_their_errors_elsewhere(name: str) -> None:
    u = steps(3)
    noise = 50.0 * np.random.default_rng(0).standard_normal(len(u))
    y = lfilter([0.0, 165.72], [1.0, -0.95833], u)
    if name == "mls":  # whose residuals are the output's own noise: white would do
        assert not fit(name, u, y + noise, 1).doubt
        noise = np.asarray(lfilter([1.0], [1.0, -0.9], noise))
    found = fit(name, u, y + noise, 1)
    assert found.doubt == f"{name} is biased where residuals are not white; see box_jenkins"
    assert np.isnan(found.covariance).all() and np.isnan(found.gain_std)
    assert "+-" not in str(found) and "a1 -0.9" in str(found)


def test_modified_least_squares_of_higher_order_tells_no_errors() -> None:
    """Its variance is not that which its residuals show: 40 records scatter by twice as much."""
    u = steps(3)
    y = lfilter(np.r_[0.0, B], np.r_[1.0, A], u)
    noise = 50.0 * np.random.default_rng(0).standard_normal(len(u))
    found = fit("mls", u, y + noise)
    assert "order above 1" in found.doubt and np.isnan(found.std).all()


def test_what_is_exact_is_never_doubted() -> None:
    u = steps(4)
    y = np.asarray(lfilter(np.r_[0.0, B], np.r_[1.0, A], u))
    for name in METHODS:
        found = fit(name, u, y)
        assert not found.doubt and np.isfinite(found.std).all()
        np.testing.assert_allclose(np.r_[found.a, found.b], TRUTH, rtol=1e-5)


@pytest.mark.slow  # repeated trials
def test_errors_are_told_of_what_is_off_by_chance() -> None:
    """Output error under slow noise, which is far from the likeliest model: its 95 % intervals hold
    in 52 to 59 of 60 records, and all are told, those beyond two standard errors, too."""
    held = np.zeros(2)
    for seed in range(60):
        random = np.random.default_rng(seed)
        u = np.repeat(random.uniform(-2.0, 2.0, 30), 50)
        noise = lfilter([0.02], [1.0, -0.95], random.standard_normal(2000))[500:]
        y = lfilter([0.0, 165.72], [1.0, -0.95833], u + noise)
        found = fit("sriv", u, y, 1)
        assert not found.doubt
        missed = np.r_[found.a + 0.95833, found.b - 165.72]
        held += np.abs(missed) <= 1.96 * found.std
    assert (held >= 52).all() and (held <= 59).all()


def cogged(u: Array) -> Array:
    """Outputs of a machine of first order under a sine of the travel."""
    y, place, pull = np.zeros(len(u)), 0.0, 0.0
    for k in range(1, len(u)):
        y[k] = 0.95833 * y[k - 1] + 165.72 * (u[k - 1] + pull)
        place += y[k] * DT
        pull = 0.1 * np.sin(2.0 * np.pi * place / 60.0)
    return y


def test_a_disturbance_that_is_no_noise_has_no_errors() -> None:
    """Cogging, a sine of the travel: an autoregression of almost any length fits it better."""
    u = steps(5)
    y = cogged(u)
    found = fit("box_jenkins", u, y, 1)
    assert len(found.noise) > model._LONG
    assert "is no noise: an autoregression of" in found.doubt and np.isnan(found.std).all()


def test_cogging_is_told_by_its_way_where_an_autoregression_is_short(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Output error, which it moves by what repeats, tells errors."""
    monkeypatch.setattr(model, "_LONG", 99)
    u = steps(5)
    y = cogged(u)
    found = fit("box_jenkins", u, y, 1)
    assert found.doubt.endswith("a force that repeats along the way") and found.draws is None
    for name in ("sriv", "output_error"):
        found = fit(name, u, y, 1)
        assert not found.doubt and found.draws is not None and found.draws.shape[1] == 2
        assert (np.abs(np.r_[found.a, found.b] - [-0.95833, 165.72]) < 2.0 * found.std).all()


def test_how_far_a_model_is_from_linear_in_its_parameters() -> None:
    """A gain alone is linear; of one pole p, two free runs tell by hand."""
    u = steps(8)
    gains = prepared(u, u, (0, 2, 1), DT, None, "rest")
    assert model.bent(gains, np.array([3.0, 2.0]), np.diag([9.0, 4.0])) < 1e-9
    pole = prepared(u, u, (1, 1, 1), DT, None, "rest")
    more, less, middle = (lfilter([0.0, 2.0], [1.0, -p], u) for p in (0.93, 0.87, 0.9))
    expected = np.linalg.norm(more + less - 2.0 * middle) / np.linalg.norm(more - less)
    theta, spread = np.array([-0.9, 2.0]), np.diag([0.03**2, 1e-6])
    assert model.bent(pole, theta, spread) == pytest.approx(expected)
    with np.errstate(over="ignore", invalid="ignore"):
        assert model.bent(pole, theta, np.diag([0.5, 1e-6])) == np.inf


def test_errors_that_are_not_proportional_are_withheld() -> None:
    """Of output error under coloured noise, where a zero is off by three times its size."""
    doubts = []
    for seed in range(3):
        found = of_disturbed("output_error", seed)
        doubts.append(found.doubt)
        assert np.isnan(found.std).all() and found.draws is None
    assert sum("are not proportional" in text for text in doubts) >= 2


def test_stretches_widen_errors_and_never_narrow_them() -> None:
    """White residuals that are large where one parameter shows: its error grows, by as much as
    its scores scatter from stretch to stretch; of the other one the model's own stays. Of other
    parameters that are combinations of these the same is told."""
    u, y = disturbed(6)
    task = prepared(u, y, (1, 1, 1), DT, None, "rest")
    rng = np.random.default_rng(1)
    loud = np.arange(len(u)) % 1000 < 100
    psi = np.stack([np.where(loud, 1.0, 0.0), np.where(loud, 0.0, 1.0)], axis=1)
    psi *= rng.choice([-1.0, 1.0], len(u))[:, None]
    solution = Solution(np.zeros(2), psi, np.where(loud, 3.0, 0.1) * rng.standard_normal(len(u)))
    own = covariance(task, solution)
    plain = fit("sriv", u, y, 1)
    found = model._widened(task, solution, replace(plain, covariance=own))
    ratio = found.std / np.sqrt(np.diag(own))
    assert ratio[0] > 1.5 and ratio[1] == pytest.approx(1.0, abs=1e-3)
    mixed = np.array([[1.0, 3.0], [0.9, -2.0]])
    turned = solution._replace(psi=psi @ np.linalg.inv(mixed))
    same = model._widened(task, turned, replace(plain, covariance=mixed @ own @ mixed.T))
    np.testing.assert_allclose(same.covariance, mixed @ found.covariance @ mixed.T, rtol=1e-6)
    even = solution._replace(residual=rng.standard_normal(len(u)))
    own = covariance(task, even)
    same = model._widened(task, even, replace(plain, covariance=own))
    assert same.std == pytest.approx(np.sqrt(np.diag(own)))  # a little more is by chance


def test_samples_of_no_weight_and_what_d_reaches_of_them_do_not_count() -> None:
    u, y = disturbed(7)
    weights = np.ones(len(u))
    weights[1000:1010] = 0.0
    spoilt = y.copy()
    spoilt[1000:1010] += 1e4
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DataWarning)
        found = identify.box_jenkins(u, spoilt, 2, 2, DT, weights=weights)
        good = identify.box_jenkins(u, y, 2, 2, DT, weights=weights)
    np.testing.assert_allclose(found.b, good.b, rtol=1e-3)
    rows = slice(1000, 1010 + len(found.noise))
    assert not found.residuals[0][rows].any() and found.residuals[0][1010 + len(found.noise)] != 0.0
