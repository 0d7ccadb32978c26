"""Least squares and generalised least squares: the equations that each settles at."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from macromicro.errors import InputError
from macromicro.identify import equation_error
from macromicro.identify.equation_error import gls, least_squares
from macromicro.identify.regression import MAX_ITERATIONS

RNG = np.random.default_rng(8)
U = [RNG.choice([-1.0, 1.0], 800), RNG.normal(size=500)]
D = np.array([-0.9, 0.4])


def answered(noise: float, coloured: bool) -> list[np.ndarray]:
    """A y = B u + e / D."""
    made = []
    for k, u in enumerate(U):
        e = noise * np.random.default_rng(k).normal(size=len(u))
        e = lfilter([1.0], np.r_[1.0, D], e) if coloured else e
        made.append(lfilter([1.0], [1.0, -0.8], lfilter([0.0, 0.5], [1.0], u) + e))
    return made


def columns(u: np.ndarray, y: np.ndarray) -> np.ndarray:
    return np.stack([-np.r_[0.0, y[:-1]], np.r_[0.0, u[:-1]]], axis=1)


def test_least_squares_stacks_the_records_and_weighs_their_squares() -> None:
    y = answered(0.1, False)
    w = [np.linspace(0.2, 2.0, len(u)) for u in U]
    found = least_squares(U, y, 1, 1, 0.1, weights=w)
    phi, target = np.concatenate([columns(*r) for r in zip(U, y, strict=True)]), np.concatenate(y)
    root = np.sqrt(np.concatenate(w))
    wanted = np.linalg.lstsq(phi * root[:, None], target * root, rcond=None)[0]
    np.testing.assert_allclose(np.r_[found.a, found.b], wanted, rtol=1e-9)
    np.testing.assert_allclose(np.concatenate(found.residuals), target - phi @ wanted, atol=1e-12)
    assert found.a[0] == pytest.approx(-0.8, abs=0.02) and found.iterations == 1


def test_generalised_least_squares_settles_where_residuals_are_white() -> None:
    """Its noise model is the autoregression of what plain residuals would be, and input and
    output are filtered by it."""
    y = answered(0.3, True)
    found = gls(U, y, 1, 1, 0.1, noise_order=2)
    assert found.converged and 1 < found.iterations < MAX_ITERATIONS
    np.testing.assert_allclose(found.noise, D, atol=0.06)
    theta = np.r_[found.a, found.b]
    left, right = [], []
    for u, out in zip(U, y, strict=True):
        raw = out - columns(u, out) @ theta
        left.append(-np.stack([raw[1:-1], raw[:-2]], axis=1))
        right.append(raw[2:])
    again = np.linalg.lstsq(np.concatenate(left), np.concatenate(right), rcond=None)[0]
    np.testing.assert_allclose(found.noise, again, atol=1e-3)
    d = np.r_[1.0, found.noise]
    phi = [lfilter(d, [1.0], columns(*r), axis=0) for r in zip(U, y, strict=True)]
    target = [lfilter(d, [1.0], s) for s in y]
    for rows in (*phi, *target):  # the noise was there before the record: D does not judge these
        rows[:2] = 0.0
    phi, target = np.concatenate(phi), np.concatenate(target)
    wanted = np.linalg.lstsq(phi, target, rcond=None)[0]
    np.testing.assert_allclose(theta, wanted, atol=1e-4)
    np.testing.assert_allclose(np.concatenate(found.residuals), target - phi @ theta, atol=1e-9)
    # Plain least squares is biased by the same noise.
    plain = least_squares(U, y, 1, 1, 0.1)
    assert abs(plain.a[0] + 0.8) > 3.0 * abs(found.a[0] + 0.8)


@pytest.mark.parametrize("order", [1, 4, 50])
def test_noise_models_of_order_1_to_50_are_accepted(order: int) -> None:
    assert len(gls(U, answered(0.3, True), 1, 1, 0.1, noise_order=order).noise) == order


@pytest.mark.parametrize("order", [0, 51, -1, 2.0])
def test_other_orders_are_refused(order: Any) -> None:
    with pytest.raises(InputError, match=r"noise_order.*1 to 50"):
        gls(U, answered(0.3, True), 1, 1, 0.1, noise_order=order)


def test_the_default_is_of_order_four() -> None:
    assert len(gls(U, answered(0.3, True), 1, 1, 0.1).noise) == 4


def test_errors_of_gls_are_those_of_machine_and_noise_together(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Past outputs hold past noise: with the noise's model taken as known, what is told of `a`
    is 0.6 of its scatter over records."""
    monkeypatch.setattr(equation_error, "compared", lambda task, solution, fit: fit)
    a, b = np.array([-1.65833, 0.670831]), np.array([40.0, 9.716])
    found, told = [], []
    for seed in range(50):
        random = np.random.default_rng(seed)
        u = np.repeat(random.uniform(-2.0, 2.0, 8), 300)
        pushed = u + 0.3 * random.standard_normal(len(u))
        y = lfilter(np.r_[0.0, b], np.r_[1.0, a], pushed)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            fit = gls(u, y, 2, 2, 1e-3)
        found.append(fit.a - a)
        told.append(np.sqrt(np.diag(fit.covariance))[:2])
    errors, std = np.array(found), np.array(told)
    known = np.isfinite(std).all(axis=1)
    assert known.mean() > 0.5
    ratio = np.sqrt(np.mean(std[known] ** 2, axis=0)) / errors[known].std(axis=0)
    assert np.all((ratio > 0.75) & (ratio < 1.33))
    inside = np.abs(errors[known]) <= 1.96 * std[known]
    assert np.all(inside.mean(axis=0) > 0.88)
