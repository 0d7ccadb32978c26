"""Errors by clusters of residuals, and what follows from them."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import t as student

from macromicro.identify import DataWarning, clusters

SLOPES = np.array([5.0, 3.0, 2.0, 1.0, 0.5, 0.3, 0.2, 0.1])  # a few tell nearly all


def drawn(random: np.random.Generator, slopes: np.ndarray) -> tuple[float, clusters.Spread]:
    """Error of a mean slope of 1, by clusters that are each off as a whole, and what is told."""
    y = slopes + slopes * random.standard_normal(len(slopes))
    found = float(slopes @ y / (slopes @ slopes))
    left = y - found * slopes
    spread = clusters.by_scores((slopes**2)[:, None, None], (slopes * left)[:, None])
    return found - 1.0, spread


def test_intervals_of_a_few_hold_what_they_say() -> None:
    random = np.random.default_rng(4)
    inside, plain = 0, 0
    for _ in range(4000):
        off, spread = drawn(random, SLOPES)
        error = math.sqrt(spread.covariance[0, 0])
        inside += abs(off) <= student.ppf(0.975, spread.degrees()[0]) * error
        plain += abs(off) <= 1.96 * error
    assert 0.93 <= inside / 4000 <= 0.98
    assert plain / 4000 < 0.9


def test_the_variance_has_no_bias_where_all_tell_alike() -> None:
    random = np.random.default_rng(5)
    even = np.full(6, 2.0)
    every = [drawn(random, even) for _ in range(4000)]
    mean = float(np.mean([one.covariance[0, 0] for _, one in every]))
    assert mean == pytest.approx(float(np.var([off for off, _ in every])), rel=0.05)
    assert every[0][1].degrees()[0] == pytest.approx(6.0)


def test_parameters_that_are_told_apart_are_told_each_as_if_alone() -> None:
    """Two columns that share no witness: the covariance is of blocks, in units of each."""
    random = np.random.default_rng(6)
    a, b = random.standard_normal((2, 5, 1, 1)) ** 2
    info = np.zeros((10, 2, 2))
    info[:5, :1, :1], info[5:, 1:, 1:] = a, 1e6 * b
    scores = np.zeros((10, 2))
    one, two = random.standard_normal((2, 5))
    scores[:5, 0], scores[5:, 1] = one, 1e3 * two
    both = clusters.by_scores(info, scores)
    for k, (i, s, scale) in enumerate(((a, one, 1.0), (b, two, 1e-3))):
        alone = clusters.by_scores(i, s[:, None])
        assert both.covariance[k, k] == pytest.approx(scale**2 * alone.covariance[0, 0])
        assert both.degrees()[k] == pytest.approx(alone.degrees()[0])
    assert both.covariance[0, 1] == pytest.approx(0.0, abs=1e-12)


def test_what_no_witness_tells_is_a_number() -> None:
    """A combination of two parameters that moves nothing, and a parameter that does not either."""
    for info in (np.ones((4, 2, 2)), np.tile(np.diag([1.0, 0.0]), (4, 1, 1)), np.zeros((4, 2, 2))):
        spread = clusters.by_scores(info, np.zeros((4, 2)))
        assert np.isfinite(spread.covariance).all()


def test_a_witness_that_alone_tells_a_parameter_is_worth_one_degree() -> None:
    spread = clusters.by_scores(
        np.array([[[1e9]], [[1.0]], [[1.0]]]), np.array([[0.0], [1.0], [-1.0]])
    )
    assert spread.degrees()[0] == pytest.approx(1.0)
    assert np.isfinite(spread.covariance).all()


@given(st.lists(st.tuples(st.floats(0.1, 10.0), st.floats(1.0, 1e6)), min_size=1, max_size=6))
def test_degrees_of_a_sum_lie_between_the_least_and_all(parts: list[tuple[float, float]]) -> None:
    found = clusters.freedom(parts)
    least, total = min(d for _, d in parts), sum(d for _, d in parts)
    assert least * (1.0 - 1e-9) <= found <= total * (1.0 + 1e-9)


def test_degrees_are_those_of_what_counts() -> None:
    assert clusters.freedom([(1.0, 4.0), (1e-9, 1.0)]) == pytest.approx(4.0)
    assert clusters.freedom([(1.0, math.inf)]) == math.inf
    assert clusters.freedom([(3.0, 5.0), (4.0, 5.0)]) == pytest.approx(625.0 / (337.0 / 5.0))
    assert clusters.freedom([(0.0, 3.0)]) == math.inf


EDGES = np.arange(0, 1601, 100)


def test_of_white_noise_it_is_the_covariance_of_least_squares() -> None:
    random = np.random.default_rng(1)
    slopes = random.standard_normal((1600, 2)) * [1.0, 1e-6]
    found = []
    for _ in range(200):
        residual = random.standard_normal(1600)
        residual -= slopes @ np.linalg.lstsq(slopes, residual, rcond=None)[0]
        found.append(np.diag(clusters.spread(slopes, residual, EDGES).covariance))
    white = np.diag(np.linalg.inv(slopes.T @ slopes))
    np.testing.assert_allclose(np.mean(found, axis=0), white, rtol=0.1)


def test_noise_that_a_cluster_shares_counts_once() -> None:
    """A constant of each cluster: 16 values, not 1600; their mean has t of 15 degrees."""
    random = np.random.default_rng(2)
    slopes, inside = np.ones((1600, 1)), 0
    for _ in range(400):
        shared = np.repeat(random.standard_normal(16), 100)
        mean = float(shared.mean())
        one = clusters.spread(slopes, shared - mean, EDGES)
        inside += abs(mean) <= one.factors()[1, 0] * np.sqrt(one.covariance[0, 0])
    assert one.factors()[1, 0] == pytest.approx(student.ppf(0.975, 16), rel=0.01)
    assert inside / 400 == pytest.approx(0.95, abs=0.03)


def test_a_cluster_that_tells_most_leaves_few_degrees_of_freedom() -> None:
    slopes = np.ones((1600, 1))
    slopes[:100] = 100.0
    one = clusters.spread(slopes, np.ones(1600), EDGES)
    assert one.factors()[1, 0] > 5.0 > clusters.factors(np.array([16.0]))[1, 0]
    two = clusters.spread(np.c_[slopes, np.roll(slopes, 800)], np.ones(1600), EDGES)
    np.testing.assert_allclose(two.factors(np.eye(2)), two.factors())


def test_a_parameter_that_moves_nothing_has_no_error() -> None:
    slopes = np.c_[np.ones(1600), np.zeros(1600)]
    found = clusters.spread(slopes, np.random.default_rng(3).standard_normal(1600), EDGES)
    assert found.covariance[0, 0] > 0.0 and np.isnan(found.covariance[1]).all()
    assert np.isnan(clusters.unknown(2).covariance).all()
    assert np.isnan(clusters.spread(0.0 * slopes, np.ones(1600), EDGES).covariance).all()


def test_parts_are_even() -> None:
    assert clusters.blocks(10, 3).tolist() == [0, 3, 7, 10]
    assert clusters.blocks(2, 5).tolist() == [0, 1, 2] or clusters.blocks(2, 5)[-1] == 2


def test_what_cannot_be_separated_is_named() -> None:
    column = np.random.default_rng(4).standard_normal((50, 2))
    with pytest.warns(DataWarning, match="a and c cannot be separated"):
        lost = clusters.unseen(np.c_[column, -2.0 * column[:, :1]], ("a", "b", "c"))
    assert sorted(lost) == ["a", "c"]
    assert clusters.unseen(column, ("a", "b")) == []
    with pytest.warns(DataWarning, match="a and b cannot be separated .*correlation 0.990"):
        clusters.warn_of_mixture(joint(0.99, 1.0), ("a", "b"), np.ones(2))


def joint(correlation: float, variance: float) -> clusters.Spread:
    white = np.array([[[1.0, correlation], [correlation, 1.0]]])
    return clusters.Spread(variance * np.eye(2), white)


def test_errors_that_do_no_harm_may_go_together() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        clusters.warn_of_mixture(joint(0.99, 1e-6), ("a", "b"), np.ones(2))
        clusters.warn_of_mixture(joint(0.97, 1.0), ("a", "b"), np.ones(2))


def test_normal_errors_have_the_factors_of_all() -> None:
    assert clusters.normal(3).tolist() == [[1.0] * 3, [1.96] * 3]


def test_errors_of_what_follows() -> None:
    spread = np.array([[4.0, 1.0, np.nan], [1.0, 9.0, np.nan], [np.nan, np.nan, np.nan]])
    slopes = np.array([[1.0, 0.0, 0.0], [2.0, -1.0, 0.0], [0.0, 1.0, 1.0], [0.0, 0.0, 0.0]])
    found = clusters.errors(spread, slopes)
    assert found[:2] == pytest.approx([2.0, math.sqrt(16.0 - 4.0 + 9.0)])
    assert math.isnan(found[2]) and found[3] == 0.0


@pytest.mark.parametrize(
    ("factor", "normal"), [(1.96, True), (1.8, True), (1.7, False), (2.3, False), (math.nan, True)]
)
def test_an_interval_is_told_where_it_is_not_twice_the_error(factor: float, normal: bool) -> None:
    assert clusters.is_normal(factor) is normal


def test_functions_of_what_is_known_are_known_beside_what_nothing_shows() -> None:
    slopes = np.array([[1.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    found = clusters.spread(slopes, np.array([0.1, -0.2, 0.1]), [0, 1, 2, 3])
    made = found.of(np.array([[2.0, 0.0], [1.0, 1.0]]))
    assert made.covariance[0, 0] == pytest.approx(4.0 * found.covariance[0, 0])
    assert np.isnan(made.covariance[1, 1])
    assert made.degrees()[0] == pytest.approx(found.degrees()[0])


def test_a_prior_adds_to_what_clusters_show() -> None:
    slopes, residual = np.ones((4, 1)), np.array([0.1, -0.2, 0.3, -0.1])
    alone = clusters.spread(slopes, residual, range(5))
    surer = clusters.spread(slopes, residual, range(5), np.array([[1e6]]))
    assert surer.covariance[0, 0] < 1e-6 * alone.covariance[0, 0]
    none = clusters.spread(slopes, residual, range(5), np.zeros((1, 1)))
    assert none.covariance == pytest.approx(alone.covariance)


def test_half_widths_count_errors_beside_the_clusters() -> None:
    own = clusters.Spread(np.array([[4.0]]), np.full((6, 1, 1), 0.5))
    one = np.ones((1, 1))
    assert clusters.half_widths(own, one, np.zeros(1), 12)[0] == pytest.approx(4.894, rel=1e-3)
    assert clusters.half_widths(own, one, np.array([1e3]), 12)[0] == pytest.approx(2178.8, rel=1e-3)
