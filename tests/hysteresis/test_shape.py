"""Tables made monotone or non-negative: the laws of the result, on small tables."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

from macromicro.hysteresis import shape
from macromicro.hysteresis.shape import _factor, cells, monotone_hull, nonnegative_hull

N = 6


def table(weights: np.ndarray) -> np.ndarray:
    """E of cell weights: the sum of those with alpha below the row and beta from the column on."""
    values = np.zeros((N, N))
    for i in range(N):
        for j in range(i):
            values[i, j] = weights[:i, j:].sum()
    return values


RNG = np.random.default_rng(11)
POSITIVE = np.tril(RNG.uniform(0.1, 1.0, (N - 1, N - 1)))


def test_cells_undo_the_double_sum() -> None:
    np.testing.assert_allclose(cells(table(POSITIVE)), POSITIVE, atol=1e-12)


def test_a_good_table_is_left_as_it_is() -> None:
    values = table(POSITIVE)
    np.testing.assert_allclose(monotone_hull(values), values, atol=1e-12)
    np.testing.assert_allclose(nonnegative_hull(values), values, atol=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_the_monotone_hull_is_the_least_table_above(seed: int) -> None:
    """Rising along alpha, falling along beta, cut to the first column and the last row."""
    noise = np.tril(np.random.default_rng(seed).normal(0.0, 0.5, (N, N)), -1)
    noise[:, 0] = noise[-1] = 0.0
    values = table(POSITIVE) + noise
    found = monotone_hull(values)
    wanted = np.zeros((N, N))
    for i in range(N):
        for j in range(i):
            least = max(0.0, values[: i + 1, j:].max())
            wanted[i, j] = min(least, values[i, 0], values[-1, j])
    np.testing.assert_allclose(found, wanted, atol=1e-12)
    assert np.all(np.diff(found, axis=0) >= -1e-12) and np.all(np.diff(found, axis=1) <= 1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_the_nonnegative_hull_keeps_both_branches_of_the_major_loop(seed: int) -> None:
    """No cell weighs less than nothing; rows and columns weigh what the branches say."""
    noise = np.tril(np.random.default_rng(seed).normal(0.0, 0.9, (N, N)), -1)
    noise[:, 0] = noise[-1] = 0.0
    values = table(POSITIVE) + noise
    assert cells(values).min() < 0.0
    found = nonnegative_hull(values)
    assert cells(found).min() >= -1e-12
    np.testing.assert_allclose(found[:, 0], values[:, 0], atol=1e-8)
    np.testing.assert_allclose(found[-1], values[-1], atol=1e-8)
    assert (np.triu(found) == 0.0).all()


def test_cells_that_were_empty_are_filled_only_where_a_row_would_have_none() -> None:
    weights = np.diag([1.0, 2.0, 3.0, 4.0, 5.0])
    found = nonnegative_hull(table(weights))
    np.testing.assert_allclose(cells(found), weights, atol=1e-6)


@pytest.mark.parametrize(
    ("primal", "change", "factor"),
    [
        (1.0, 1.0, 1.0),
        (9.0, 1.0, 1.0),
        (1.0, 9.0, 1.0),
        (16.0, 1.0, 4.0),
        (1.0, 16.0, 0.25),
        (1e6, 1.0, 10.0),  # tenfold at most, either way
        (1.0, 1e6, 0.1),
        (1.0, 0.0, 10.0),
    ],
)
def test_the_weight_is_adjusted_where_one_error_is_ten_times_the_other(
    primal: float, change: float, factor: float
) -> None:
    """By the root of their ratio."""
    assert _factor(primal, change) == pytest.approx(factor)


def test_a_weight_that_is_far_off_is_made_up_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same solution, in far fewer rounds than with the weight left as it was."""
    from scipy.optimize import nnls

    random = np.random.default_rng(6)
    a, y = random.normal(size=(40, 15)), random.normal(size=40)
    rounds = []
    real = shape.solver

    def counting(matrix: Any) -> Any:
        solve = real(matrix)

        def counted(right: np.ndarray) -> np.ndarray:
            rounds[-1] += 1
            return np.asarray(solve(right))

        return counted

    monkeypatch.setattr(shape, "solver", counting)
    matrix, eye = sp.csr_array(a.T @ a), sp.csr_array(np.eye(15))
    found = []
    for _ in range(2):
        rounds.append(0)
        found.append(shape.minimise(matrix, a.T @ y, eye, np.zeros(15), 1e-4, 0.02))
        monkeypatch.setattr(shape, "_WEIGHED", ())
    np.testing.assert_allclose(found[0], nnls(a, y)[0], atol=1e-3)
    assert rounds[0] < 0.3 * rounds[1]


def test_the_bound_is_met_to_a_ten_thousandth_of_the_usual_size() -> None:
    """x + b >= 0 for the least x^2 / 2 - x: with b = -3 and bounds one after the other, x = 3."""
    one = sp.csr_array(np.eye(2))
    right, offset = np.array([1.0, 1.0]), np.array([-3.0, 3.0])
    rough, fine = (shape.minimise(one, right, one, offset, scale, 1.0) for scale in (1000.0, 1e-3))
    np.testing.assert_allclose(fine, [3.0, 1.0], atol=1e-7)
    assert 1e-4 < abs(rough[0] - 3.0) < 0.1


def test_as_many_rounds_are_made_as_are_asked_for() -> None:
    one = sp.csr_array(np.eye(2))
    right, offset = np.array([1.0, 1.0]), np.array([-3.0, 3.0])
    ends = [
        float(shape.minimise(one, right, one, offset, 1e-9, 1.0, rounds)[0])
        for rounds in (1, 5, 60)
    ]
    off = [abs(end - 3.0) for end in ends]
    assert off[0] > off[1] > off[2] and off[2] < 1e-6
