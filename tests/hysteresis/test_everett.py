"""The Everett table of relay weights (Section 2.4.1, (2.8))."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.errors import InputError
from macromicro.hysteresis import Everett, from_density, lookup

LO, STEP, N = -3.0, 0.25, 25
HI = LO + STEP * (N - 1)


def random_weights(seed: int, n: int = N) -> np.ndarray:
    """Cell weights, a third of them zero."""
    rng = np.random.default_rng(seed)
    weights = rng.random((n - 1, n - 1)) * (rng.random((n - 1, n - 1)) > 0.33)
    return np.tril(weights)


TABLE = from_density(random_weights(7), LO, STEP, N)
inputs = st.floats(LO - 1.0, HI + 1.0)
seeds = st.integers(0, 2**32 - 1)


def test_a_value_is_the_weight_of_its_triangle() -> None:
    weights = random_weights(1, 9)
    table = from_density(weights, 10.0, 2.0, 9)
    for i in range(9):
        for j in range(9):
            # up threshold at or below alpha_i, down threshold at or above beta_j
            triangle = sum(weights[r, c] for r in range(i) for c in range(j, 8) if r >= c)
            assert table.values[i, j] == pytest.approx(triangle / weights.sum(), abs=1e-14)


@given(seeds, st.integers(2, 30))
@settings(max_examples=50, deadline=None)
def test_table_is_monotone_zero_on_the_diagonal_and_weighs_one(seed: int, n: int) -> None:
    weights = random_weights(seed, n)
    weights[-1, 0] += 0.1
    values = from_density(weights, LO, STEP, n).values
    assert values[-1, 0] == 1.0
    assert np.all(np.triu(values) == 0.0)
    below = np.tri(n, dtype=bool)
    assert np.all((np.diff(values, axis=0) >= 0.0) | ~below[:-1])
    assert np.all((np.diff(values, axis=1) <= 0.0) | ~below[:, 1:])
    assert values.flags.c_contiguous
    assert values.dtype == np.float64


def test_uniform_density_gives_the_square_of_the_distance() -> None:
    """A triangle of uniform density weighs as its area does."""
    table = from_density(lambda alpha, beta: np.ones_like(alpha), LO, STEP, N)
    grid = LO + STEP * np.arange(N)
    expected = np.maximum(grid[:, None] - grid[None, :], 0.0) ** 2 / (HI - LO) ** 2
    assert np.allclose(table.values, expected, atol=1e-14)


def test_density_is_asked_at_centres_of_mass_and_believed_below_the_diagonal_only() -> None:
    seen: list[np.ndarray] = []

    def density(alpha: np.ndarray, beta: np.ndarray) -> np.ndarray:
        seen.extend((alpha, beta))
        return np.where(alpha > beta, 1.0, np.nan)

    table = from_density(density, 0.0, 3.0, 3)
    assert np.allclose(seen[0], [[2.0, 1.5], [4.5, 5.0]])
    assert np.allclose(seen[1], [[1.0, 4.5], [1.5, 4.0]])
    assert np.allclose(table.values, [[0, 0, 0], [0.25, 0, 0], [1.0, 0.25, 0]])


def test_lookup_meets_the_table_on_the_grid() -> None:
    for i in range(N):
        for j in range(i + 1):
            found = lookup(TABLE, LO + i * STEP, LO + j * STEP)
            assert found == pytest.approx(TABLE.values[i, j], abs=1e-15)


def test_lookup_is_bilinear_in_a_cell_and_linear_on_the_diagonal() -> None:
    values = np.array([[0.0, 0.0, 0.0], [0.2, 0.0, 0.0], [1.0, 0.5, 0.0]])
    table = Everett(0.0, 1.0, 3, values)
    assert lookup(table, 1.25, 0.5) == pytest.approx(
        0.75 * 0.5 * (0.2 + 0.0) + 0.25 * 0.5 * (1.0 + 0.5)
    )
    assert lookup(table, 0.75, 0.25) == pytest.approx(0.2 * 0.5)
    assert lookup(table, 1.9, 1.1) == pytest.approx(0.5 * 0.8)


@given(inputs)
@settings(max_examples=50, deadline=None)
def test_lookup_is_exactly_zero_for_equal_inputs(u: float) -> None:
    assert lookup(TABLE, u, u) == 0.0


@given(inputs, inputs, st.floats(0.0, 2.0))
@settings(max_examples=100, deadline=None)
def test_lookup_is_monotone_and_bounded(alpha: float, beta: float, further: float) -> None:
    here = lookup(TABLE, alpha, beta)
    assert 0.0 <= here <= 1.0 + 1e-15
    assert lookup(TABLE, alpha + further, beta) >= here - 1e-15
    assert lookup(TABLE, alpha, beta - further) >= here - 1e-15


@given(st.integers(0, N - 1), inputs)
@settings(max_examples=100, deadline=None)
def test_lookup_is_continuous_across_grid_lines(i: int, other: float) -> None:
    line = LO + i * STEP
    for gap in (1e-9, 1e-12):
        before, after = line - gap, line + gap
        # No cell weighs so much that a step of 1e-9 could matter at 1e-7.
        assert abs(lookup(TABLE, after, other) - lookup(TABLE, before, other)) < 1e2 * gap
        assert abs(lookup(TABLE, other, after) - lookup(TABLE, other, before)) < 1e2 * gap


def test_lookup_clamps_to_the_grid() -> None:
    assert lookup(TABLE, HI + 5.0, LO - 5.0) == 1.0
    assert lookup(TABLE, math.inf, -math.inf) == 1.0
    assert lookup(TABLE, HI + 5.0, HI + 4.0) == 0.0
    assert lookup(TABLE, LO - 4.0, LO - 5.0) == 0.0
    assert lookup(TABLE, math.nan, LO) == 0.0
    assert lookup(TABLE, HI, math.nan) == 0.0


GOOD = random_weights(3, 4)


@pytest.mark.parametrize(
    ("density", "lo", "step", "n", "named"),
    [
        (GOOD, 0.0, 1.0, 1, "at least 2 grid points"),
        (GOOD, 0.0, 0.0, 4, "step above 0"),
        (GOOD, math.nan, 1.0, 4, "finite lo"),
        (GOOD[:2], 0.0, 1.0, 4, "(3, 3)"),
        (-GOOD, 0.0, 1.0, 4, "at least 0"),
        (np.where(GOOD > 0.0, math.inf, 0.0), 0.0, 1.0, 4, "finite weights"),
        (GOOD.T, 0.0, 1.0, 4, "0 where row < column"),
        (GOOD * 0.0, 0.0, 1.0, 4, "above 0"),
        (np.tril(np.full((3, 3), 1e308)), 0.0, 1.0, 4, "total weight: inf"),
        (lambda alpha, beta: np.ones(2), 0.0, 1.0, 4, "(3, 3)"),
        (lambda alpha, beta: alpha * math.nan, 0.0, 1.0, 4, "finite weights"),
    ],
)
def test_impossible_densities_are_refused(
    density: Any, lo: float, step: float, n: int, named: str
) -> None:
    with pytest.raises(InputError) as caught:
        from_density(density, lo, step, n)
    assert named in str(caught.value)
