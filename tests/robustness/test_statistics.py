"""Shares, intervals and ranks, against closed forms, scipy and laws."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binom, spearmanr

from macromicro.robustness.statistics import LEVELS, rank_correlation, share, spread

counts = st.integers(1, 400).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n)))


def test_interval_as_published() -> None:
    """None of 10: 1 - 0.025^(1/10) = 0.30850; 10 of 20: 0.2720 to 0.7280."""
    assert share(0, 10)[3:] == (0.0, pytest.approx(0.308497, abs=1e-6))
    assert share(10, 10)[3:] == (pytest.approx(0.691503, abs=1e-6), 1.0)
    assert share(10, 20)[3:] == pytest.approx((0.271958, 0.728042), abs=1e-6)


@given(counts)
def test_interval_holds_the_share_and_mirrors(case: tuple[int, int]) -> None:
    """Failing is passing seen from the other side."""
    passed, total = case
    here, there = share(passed, total), share(total - passed, total)
    assert here.low <= here.share <= here.high
    assert (here.low, here.high) == pytest.approx((1.0 - there.high, 1.0 - there.low), abs=1e-9)


@given(counts)
def test_interval_narrows_with_the_sample(case: tuple[int, int]) -> None:
    passed, total = case
    few, many = share(passed, total), share(4 * passed, 4 * total)
    assert many.high - many.low < few.high - few.low


@pytest.mark.parametrize("p", [0.05, 0.3, 0.5, 0.93])
def test_interval_covers_at_least_as_often_as_it_says(p: float) -> None:
    n = 40
    bounds = [share(k, n) for k in range(n + 1)]
    inside = [s.low <= p <= s.high for s in bounds]
    assert binom.pmf(np.flatnonzero(inside), n, p).sum() >= 0.95


def test_nothing_of_nothing() -> None:
    assert math.isnan(share(0, 0).share)


@pytest.mark.parametrize(("passed", "total"), [(-1, 5), (6, 5)])
def test_impossible_counts(passed: int, total: int) -> None:
    with pytest.raises(ValueError, match=f"{passed} of {total}"):
        share(passed, total)


@given(st.lists(st.integers(0, 9), min_size=12, max_size=40), st.integers(0, 2**32 - 1))
def test_rank_correlation_is_spearman_s(values: list[int], seed: int) -> None:
    """With ties, as scipy has it."""
    y = np.array(values, dtype=float)
    x = np.random.default_rng(seed).standard_normal(len(y))
    found = rank_correlation(x, y)
    if np.ptp(y) == 0.0:
        assert math.isnan(found.value) and not found.significant()
    else:
        assert found == pytest.approx(tuple(spearmanr(x, y)), abs=1e-12)


@given(st.lists(st.integers(-1000, 1000), min_size=12, max_size=30, unique=True))
def test_rank_correlation_sees_order_only(values: list[int]) -> None:
    x = np.array(values, dtype=float)
    assert rank_correlation(x, x**3).value == pytest.approx(1.0)
    assert rank_correlation(x, -x).value == pytest.approx(-1.0)
    assert rank_correlation(x, -x).significant(of=20)


def test_the_largest_of_many_correlations_is_seldom_called_significant() -> None:
    """Of twenty quantities that have nothing to do with a metric: in one study of twenty."""
    rng = np.random.default_rng(5)
    called = 0
    for _ in range(200):
        y, many = rng.standard_normal(40), rng.standard_normal((20, 40))
        called += any(rank_correlation(x, y).significant(of=20) for x in many)
    assert called <= 20


def test_never_ranks_highest_and_unknown_is_left_out() -> None:
    x = np.arange(13.0)
    y = np.array([*range(10), math.inf, math.inf, math.nan])
    expected = spearmanr(x[:12], [*range(10), 99, 99])
    assert rank_correlation(x, y) == pytest.approx(tuple(expected))
    assert math.isnan(rank_correlation(x[3:], y[3:]).value)  # nine known rows are too few


def test_what_never_settles_is_worse_than_any_number() -> None:
    """In the worst and in the quantiles: as a number that is larger than all others would be."""
    values = np.array([3.0, 1.0, math.inf, math.nan, 2.0, math.inf, 4.0, 5.0])
    found = spread(values)
    assert (found.known, found.never, found.least, found.most) == (7, 2, 1.0, math.inf)
    large = np.quantile([1.0, 2.0, 3.0, 4.0, 5.0, 1e9, 1e9], LEVELS)
    assert found.quantiles[:3] == pytest.approx(large[:3])
    assert found.quantiles[3:] == (math.inf, math.inf) and (large[3:] > 1e8).all()


def test_spread_of_finite_numbers_is_numpy_s() -> None:
    values = np.array([3.0, 1.0, math.nan, 2.0, 7.0])
    found = spread(values)
    assert (found.known, found.never, found.least, found.most) == (4, 0, 1.0, 7.0)
    assert found.quantiles == pytest.approx(np.quantile([1.0, 2.0, 3.0, 7.0], LEVELS))


def test_spread_of_nothing_finite() -> None:
    found = spread(np.array([math.inf, math.nan]))
    assert (found.known, found.never, found.most, found.quantiles[2]) == (1, 1, math.inf, math.inf)
    assert math.isnan(spread(np.array([math.nan])).most)
