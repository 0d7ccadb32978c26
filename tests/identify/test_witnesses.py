"""Errors by a few witnesses: docs/identify.md, section on a carriage for the law `terminal`."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import t

from macromicro.identify import witnesses

SLOPES = np.array([5.0, 3.0, 2.0, 1.0, 0.5, 0.3, 0.2, 0.1])  # a few tell nearly all


def drawn(random: np.random.Generator, slopes: np.ndarray) -> tuple[float, witnesses.Told]:
    """Error of a mean slope of 1, by witnesses that are each off as a whole, and what is told."""
    y = slopes + slopes * random.standard_normal(len(slopes))
    found = float(slopes @ y / (slopes @ slopes))
    left = y - found * slopes
    told = witnesses.told((slopes**2)[:, None, None], (slopes * left)[:, None])
    return found - 1.0, told


def test_intervals_of_a_few_hold_what_they_say() -> None:
    random = np.random.default_rng(4)
    inside, plain = 0, 0
    for _ in range(4000):
        off, told = drawn(random, SLOPES)
        error = math.sqrt(told.covariance[0, 0])
        inside += abs(off) <= t.ppf(0.975, told.freedom[0]) * error
        plain += abs(off) <= 1.96 * error
    assert 0.93 <= inside / 4000 <= 0.98
    assert plain / 4000 < 0.9


def test_the_variance_has_no_bias_where_all_tell_alike() -> None:
    random = np.random.default_rng(5)
    even = np.full(6, 2.0)
    every = [drawn(random, even) for _ in range(4000)]
    told = float(np.mean([one.covariance[0, 0] for _, one in every]))
    assert told == pytest.approx(float(np.var([off for off, _ in every])), rel=0.05)
    assert every[0][1].freedom[0] == pytest.approx(6.0)


def test_parameters_that_are_told_apart_are_told_each_as_if_alone() -> None:
    """Two columns that share no witness: the covariance is of blocks, in units of each."""
    random = np.random.default_rng(6)
    a, b = random.standard_normal((2, 5, 1, 1)) ** 2
    info = np.zeros((10, 2, 2))
    info[:5, :1, :1], info[5:, 1:, 1:] = a, 1e6 * b
    scores = np.zeros((10, 2))
    one, two = random.standard_normal((2, 5))
    scores[:5, 0], scores[5:, 1] = one, 1e3 * two
    both = witnesses.told(info, scores)
    for k, (i, s, scale) in enumerate(((a, one, 1.0), (b, two, 1e-3))):
        alone = witnesses.told(i, s[:, None])
        assert both.covariance[k, k] == pytest.approx(scale**2 * alone.covariance[0, 0])
        assert both.freedom[k] == pytest.approx(alone.freedom[0])
    assert both.covariance[0, 1] == pytest.approx(0.0, abs=1e-12)


def test_what_no_witness_tells_is_a_number() -> None:
    """A combination of two parameters that moves nothing, and a parameter that does not either."""
    for info in (np.ones((4, 2, 2)), np.tile(np.diag([1.0, 0.0]), (4, 1, 1)), np.zeros((4, 2, 2))):
        told = witnesses.told(info, np.zeros((4, 2)))
        assert np.isfinite(told.covariance).all()


def test_a_witness_that_alone_tells_a_parameter_is_worth_one_degree() -> None:
    told = witnesses.told(np.array([[[1e9]], [[1.0]], [[1.0]]]), np.array([[0.0], [1.0], [-1.0]]))
    assert told.freedom[0] == pytest.approx(1.0)
    assert np.isfinite(told.covariance).all()


@given(st.lists(st.tuples(st.floats(0.1, 10.0), st.floats(1.0, 1e6)), min_size=1, max_size=6))
def test_degrees_of_a_sum_lie_between_the_least_and_all(parts: list[tuple[float, float]]) -> None:
    found = witnesses.freedom(parts)
    least, total = min(d for _, d in parts), sum(d for _, d in parts)
    assert least * (1.0 - 1e-9) <= found <= total * (1.0 + 1e-9)


def test_degrees_are_those_of_what_counts() -> None:
    assert witnesses.freedom([(1.0, 4.0), (1e-9, 1.0)]) == pytest.approx(4.0)
    assert witnesses.freedom([(1.0, math.inf)]) == math.inf
    assert witnesses.freedom([(3.0, 5.0), (4.0, 5.0)]) == pytest.approx(625.0 / (337.0 / 5.0))
    assert witnesses.freedom([(0.0, 3.0)]) == math.inf
