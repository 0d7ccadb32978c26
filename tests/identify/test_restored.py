"""What a fit has taken of a noise (`macromicro.identify._restored`)."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.signal import lfilter

from macromicro.arrays import Array
from macromicro.identify._restored import restored
from macromicro.identify._spread import autoregression, robust_covariance

KEEP = 0.8  # of a noise, from sample to sample


def slow_waves(n: int, p: int) -> Array:
    """Orthonormal and slow: a constant and the first cosines."""
    at = (np.arange(n) + 0.5) * np.pi / n
    table = np.cos(np.arange(p) * at[:, None])
    return table / np.linalg.norm(table, axis=0)


def coloured(random: np.random.Generator, n: int) -> Array:
    return np.asarray(lfilter([1.0], [1.0, -KEEP], random.standard_normal(n + 200))[200:])


def test_of_white_noise_parameters_take_their_number() -> None:
    table = slow_waves(100, 5)
    d, power = restored((np.zeros(0), 2.0), [table], [table.T])
    assert len(d) == 0
    assert power == pytest.approx(2.0 * 100 / 95)


def test_the_model_of_the_residuals_that_are_expected_is_that_of_the_noise() -> None:
    """Of two records and with instruments: what residuals are expected to be is dense algebra."""
    n, p = 300, 6
    table = slow_waves(n, p)
    guides = table + 0.05 * np.random.default_rng(0).standard_normal(table.shape)
    solve = np.linalg.solve(guides.T @ table, guides.T)
    v = np.zeros((n, n))
    for part in (slice(0, 100), slice(100, n)):
        size = part.stop - part.start
        v[part, part] = toeplitz(KEEP ** np.arange(size)) / (1.0 - KEEP**2)
    off = np.eye(n) - table @ solve
    seen = off @ v @ off.T
    lag = np.trace(seen[1:, :-1]) / (n - 2) / (np.trace(seen) / n)
    found = np.array([-lag]), float(np.trace(seen)) / n * (1.0 - lag**2)
    truth = _at_rest((np.array([-KEEP]), 1.0))
    assert _at_rest(found) < 0.7 * truth
    cuts = [table[:100], table[100:]], [solve[:, :100], solve[:, 100:]]
    once = restored(found, *cuts)
    assert _at_rest(once) == pytest.approx(truth, rel=0.06)
    # A part that is taken from one record alone is another one.
    assert restored(found, [table], [solve])[0] != pytest.approx(once[0], rel=1e-4)


def _at_rest(noise: tuple[Array, float]) -> float:
    return noise[1] / float(1.0 + noise[0].sum()) ** 2


def test_errors_of_slow_parameters_are_those_that_they_scatter_by() -> None:
    """By what residuals show alone they are a tenth too small."""
    n, p, many = 1000, 6, 400
    random, table = np.random.default_rng(1), slow_waves(n, p)
    missed, told, plain = [], [], []
    for _ in range(many):
        e = coloured(random, n)
        off = table.T @ e
        left = e - table @ off
        missed.append(off**2)
        told.append(np.diag(robust_covariance(table, left, [n])))
        d, power = autoregression([left])
        back = lfilter([1.0], np.r_[1.0, d], table[::-1].T)
        plain.append(power * np.sum(back**2, axis=1) * n / (n - p))
    scatter = np.sqrt(np.mean(missed))
    assert np.sqrt(np.mean(plain)) < 0.95 * scatter
    assert np.sqrt(np.mean(told)) == pytest.approx(scatter, rel=0.03)


@pytest.mark.parametrize("n", [6, 10_000])
def test_where_next_to_nothing_is_taken_or_all_the_number_alone_counts(n: int) -> None:
    table = slow_waves(n, 5)
    d, power = restored((np.array([-KEEP]), 1.0), [table], [table.T])
    assert d.tolist() == [-KEEP]
    assert power == pytest.approx(n / (n - 5))


def test_nothing_is_left_of_no_noise() -> None:
    table = slow_waves(100, 5)
    assert restored((np.array([-KEEP]), 0.0), [table], [table.T])[1] == 0.0
