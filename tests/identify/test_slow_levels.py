"""How strong and how slow a noise is, by the restricted likelihood."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import lfilter

from macromicro.arrays import Array
from macromicro.identify._slow_levels import (
    Level,
    _together,
    _width,
    covariance,
    is_slow,
    levels,
    together,
)


def slow(n: int, time: float, random: np.random.Generator) -> Array:
    """Of variance 1."""
    keep = math.exp(-1.0 / time)
    white = math.sqrt(1.0 - keep * keep) * random.standard_normal(n)
    begin = [keep * random.standard_normal()]
    return np.asarray(lfilter([1.0], [1.0, -keep], white, zi=begin)[0])


def dense(n: int, level: Level) -> Array:
    apart = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
    return np.asarray(level.slow * np.exp(-apart / level.time) + level.white * np.eye(n))


@pytest.mark.parametrize("pole", [0.0, 0.5, 0.95, -0.6])
def test_samples_that_go_together(pole: float) -> None:
    """(1 + pole) / (1 - pole) of a first-order autoregression."""
    found = together((np.array([-pole]), 2.0))
    assert found == pytest.approx((1.0 + pole) / (1.0 - pole), rel=1e-6)
    assert together((np.zeros(0), 1.0)) == 1.0


def test_noise_is_slow_where_more_than_three_in_a_hundred_go_together() -> None:
    assert not is_slow(400, (np.array([-0.3]), 1.0))
    nineteen = (np.array([-0.9]), 1.0)
    assert is_slow(600, nineteen) and not is_slow(700, nineteen)
    assert not is_slow(400, (np.array([-0.9]), 0.0))
    assert not is_slow(400, (np.array([-1.0]), 1.0))  # a constant


def test_a_swing_is_no_slow_noise_though_its_samples_go_together() -> None:
    def swing(angle: float) -> tuple[np.ndarray, float]:
        pole = 0.98 * np.exp(1j * angle)
        return np.array([-2.0 * pole.real, abs(pole) ** 2]), 1.0

    often = swing(0.07)  # nine times in 800 samples
    assert together(often) > 8.0 and not is_slow(800, often)
    seldom = swing(0.02)
    assert is_slow(800, seldom)  # hardly beyond its first swing


def test_means_over_blocks_go_together_as_their_samples_do() -> None:
    many, blocks, time = 200, 6, 1.7
    mean = np.kron(np.eye(blocks), np.full((1, many), 1.0 / many))
    full = mean @ dense(many * blocks, Level(1.0, time * many, 1.0, 0.0)) @ mean.T
    np.testing.assert_allclose(_together([blocks], time), full, rtol=1e-4)
    both = _together([2, 3], time)
    np.testing.assert_allclose(both[2:, 2:], full[:3, :3], rtol=1e-4)
    assert not both[:2, 2:].any()


def test_errors_by_a_known_noise_are_those_of_its_covariance() -> None:
    solve = np.random.default_rng(0).standard_normal((2, 50))
    one = Level(1.0, 12.0, 3.0, 0.5)
    whole = covariance(solve, [50], [one])
    np.testing.assert_allclose(whole, solve @ dense(50, one) @ solve.T, rtol=1e-3)
    apart = dense(50, one)
    apart[:20, 20:] = apart[20:, :20] = 0.0
    parted = covariance(solve, [20, 30], [one])
    np.testing.assert_allclose(parted, solve @ apart @ solve.T, rtol=1e-3)


def test_an_error_is_as_wide_as_the_intervals_of_all_that_is_likely() -> None:
    assert _width(np.array([1.0]), np.array([[2.0]])) == pytest.approx(2.0, rel=1e-3)
    sizes, weights = np.array([[1.0], [6.0]]), np.array([0.8, 0.2])
    found = _width(weights, sizes)[0]
    random = np.random.default_rng(0)
    drawn = np.abs(random.standard_normal(400_000) * random.choice(sizes[:, 0], 400_000, p=weights))
    ends = np.quantile(drawn, [0.6827, 0.95]) / [1.0, 1.96]
    assert found == pytest.approx(float(ends.mean()), rel=0.02)
    assert found < math.sqrt(float(weights @ sizes[:, 0] ** 2))  # which the unlikely one rules
    assert _width(weights, np.zeros((2, 1))) == 0.0


def test_strength_and_time_are_found_beside_what_was_fitted() -> None:
    """Slow noise of variance 4 over 80 samples and white noise of variance 16: what is likely
    is near, in the middle of many records."""
    n, at = 2000, []
    table = np.column_stack([np.ones(n), np.linspace(-1.0, 1.0, n)])
    back = np.linalg.pinv(table)
    for seed in range(20):
        random = np.random.default_rng(seed)
        e = 2.0 * slow(n, 80.0, random) + 4.0 * random.standard_normal(n)
        may = levels([e - table @ (back @ e)], table)
        assert sum(level.weight for level in may) == pytest.approx(1.0)
        weights = [level.weight for level in may]
        each = np.array([level[1:] for level in may])
        at.append(np.exp(np.average(np.log(each + 1e-9), axis=0, weights=weights)))
    time, power, white = np.median(at, axis=0)
    assert time == pytest.approx(80.0, rel=0.3)
    assert power == pytest.approx(4.0, rel=0.3)
    assert white == pytest.approx(16.0, rel=0.3)


@pytest.mark.slow  # repeated trials
@pytest.mark.parametrize("time", [50.0, 100.0, 200.0])
def test_the_mean_of_slow_noise_is_told_with_its_error(time: float) -> None:
    """Of 16 to 4 correlation times; by what a fit leaves, 95 % hold in 70 of 100 of the last."""
    n, off = 800, []
    ones = np.ones((n, 1))
    for seed in range(150):
        e = slow(n, time, np.random.default_rng(seed))
        may = levels([e - e.mean()], ones)
        told = math.sqrt(float(covariance(ones.T / n, [n], may)[0, 0]))
        off.append(abs(float(e.mean())) / told)
    assert 0.58 < np.mean(np.array(off) < 1.0) < 0.82
    assert 0.86 < np.mean(np.array(off) < 1.96) < 0.99


def test_records_apart_have_a_noise_of_their_own() -> None:
    """Their levels are shared: twice the data say more of the time."""
    random = np.random.default_rng(3)
    parts = [slow(600, 40.0, random) for _ in range(4)]
    ones = np.ones((600, 1))

    def spread(records: list[Array]) -> float:
        may = levels([e - e.mean() for e in records], np.kron(np.eye(len(records)), ones))
        weights, times = np.array([(m.weight, math.log(m.time)) for m in may]).T
        return math.sqrt(weights @ (times - weights @ times) ** 2)

    assert spread(parts) < 0.75 * spread(parts[:1])


def test_a_column_that_takes_nothing_does_no_harm() -> None:
    e = slow(400, 20.0, np.random.default_rng(0))
    table = np.ones((400, 1))
    idle = np.column_stack([table, np.zeros(400), 2.0 * table[:, 0]])
    one, other = levels([e - e.mean()], table), levels([e - e.mean()], idle)
    np.testing.assert_allclose(one, other, rtol=1e-6)
