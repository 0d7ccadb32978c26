"""Errors by clusters: white noise, noise that clusters share, and what nothing shows."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.stats import t as student

from macromicro.identify import DataWarning
from macromicro.identify._errors import Spread, blocks, factors, mixed, spread, unknown, unseen

EDGES = np.arange(0, 1601, 100)


def test_of_white_noise_it_is_the_covariance_of_least_squares() -> None:
    random = np.random.default_rng(1)
    slopes = random.standard_normal((1600, 2)) * [1.0, 1e-6]
    found = []
    for _ in range(200):
        residual = random.standard_normal(1600)
        residual -= slopes @ np.linalg.lstsq(slopes, residual, rcond=None)[0]
        found.append(np.diag(spread(slopes, residual, EDGES).covariance))
    white = np.diag(np.linalg.inv(slopes.T @ slopes))
    np.testing.assert_allclose(np.mean(found, axis=0), white, rtol=0.1)


def test_noise_that_a_cluster_shares_counts_once() -> None:
    """A constant of each cluster: 16 values, not 1600; their mean has t of 15 degrees."""
    random = np.random.default_rng(2)
    slopes, inside = np.ones((1600, 1)), 0
    for _ in range(400):
        shared = np.repeat(random.standard_normal(16), 100)
        mean = float(shared.mean())
        one = spread(slopes, shared - mean, EDGES)
        inside += abs(mean) <= one.factors()[1, 0] * np.sqrt(one.covariance[0, 0])
    assert one.factors()[1, 0] == pytest.approx(student.ppf(0.975, 16), rel=0.01)
    assert inside / 400 == pytest.approx(0.95, abs=0.03)


def test_a_cluster_that_tells_most_leaves_few_degrees_of_freedom() -> None:
    slopes = np.ones((1600, 1))
    slopes[:100] = 100.0
    one = spread(slopes, np.ones(1600), EDGES)
    assert one.factors()[1, 0] > 5.0 > factors(np.array([16.0]))[1, 0]
    two = spread(np.c_[slopes, np.roll(slopes, 800)], np.ones(1600), EDGES)
    np.testing.assert_allclose(two.factors(np.eye(2)), two.factors())


def test_a_parameter_that_moves_nothing_has_no_error() -> None:
    slopes = np.c_[np.ones(1600), np.zeros(1600)]
    found = spread(slopes, np.random.default_rng(3).standard_normal(1600), EDGES)
    assert found.covariance[0, 0] > 0.0 and np.isnan(found.covariance[1]).all()
    assert np.isnan(unknown(2).covariance).all()
    assert np.isnan(spread(0.0 * slopes, np.ones(1600), EDGES).covariance).all()


def test_parts_are_even() -> None:
    assert blocks(10, 3).tolist() == [0, 3, 7, 10]
    assert blocks(2, 5).tolist() == [0, 1, 2] or blocks(2, 5)[-1] == 2


def test_what_cannot_be_separated_is_named() -> None:
    column = np.random.default_rng(4).standard_normal((50, 2))
    with pytest.warns(DataWarning, match="a and c cannot be separated"):
        lost = unseen(np.c_[column, -2.0 * column[:, :1]], ("a", "b", "c"))
    assert sorted(lost) == ["a", "c"]
    assert unseen(column, ("a", "b")) == []
    with pytest.warns(DataWarning, match="a and b cannot be separated .*correlation 0.990"):
        mixed(joint(0.99, 1.0), ("a", "b"), np.ones(2))


def joint(correlation: float, variance: float) -> Spread:
    white = np.array([[[1.0, correlation], [correlation, 1.0]]])
    return Spread(variance * np.eye(2), white)


def test_errors_that_do_no_harm_may_go_together() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mixed(joint(0.99, 1e-6), ("a", "b"), np.ones(2))
        mixed(joint(0.97, 1.0), ("a", "b"), np.ones(2))
