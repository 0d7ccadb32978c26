"""The matrices on the table's grid against plain sums over a small table."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.hysteresis.shape import Grid, densities, number_nodes, readings, roughness, slopes

N = 5
GRID = Grid(2.0, 0.5, N)
IDS = number_nodes(N)
VALUES = np.tril(np.random.default_rng(3).random((N, N)), -1)
KNOWN = VALUES[IDS >= 0]


def test_values_below_the_diagonal_are_numbered_row_by_row() -> None:
    assert number_nodes(4).tolist() == [
        [-1, -1, -1, -1],
        [0, -1, -1, -1],
        [1, 2, -1, -1],
        [3, 4, 5, -1],
    ]
    assert GRID.nodes.tolist() == [2.0, 2.5, 3.0, 3.5, 4.0]


def value(alpha: float, beta: float) -> float:
    """E of a relay density constant in each cell: that of whole cells, and shares of others.
    Relays of the cells on the diagonal lie on it."""
    x, y = (min(max((v - 2.0) / 0.5, 0.0), N - 1.0) for v in (alpha, min(alpha, beta)))
    total = 0.0
    for r in range(N - 1):
        for c in range(r + 1):
            weight = VALUES[r + 1, c] - VALUES[r, c] - VALUES[r + 1, c + 1] + VALUES[r, c + 1]
            up, left = min(max(x - r, 0.0), 1.0), min(max(y - c, 0.0), 1.0)
            share = up * (1.0 - left) if c < r else max(up - left, 0.0)
            total += weight * share
    return total


def test_a_reading_is_the_weight_of_the_relays_between_two_inputs() -> None:
    rng = np.random.default_rng(4)
    alpha, beta = rng.uniform(1.8, 4.2, 300), rng.uniform(1.8, 4.2, 300)
    alpha[:5], beta[:5] = GRID.nodes, GRID.nodes[::-1]
    found = readings(GRID, IDS, alpha, beta) @ KNOWN
    wanted = [value(a, b) for a, b in zip(alpha, beta, strict=True)]
    np.testing.assert_allclose(found, wanted, atol=1e-12)


def test_densities_are_the_weights_of_the_cells() -> None:
    cell = np.array([
        VALUES[r + 1, c] - VALUES[r, c] - VALUES[r + 1, c + 1] + VALUES[r, c + 1]
        for r in range(N - 1) for c in range(r + 1)
    ])  # fmt: skip
    np.testing.assert_allclose(densities(N, IDS) @ KNOWN, cell, atol=1e-15)
    assert cell.sum() == pytest.approx(VALUES[-1, 0])  # all relays together


def test_slopes_are_the_differences_to_the_next_smaller_value() -> None:
    """Upwards in the table, then to the right."""
    pairs = [(r, c) for r in range(N) for c in range(r)]
    up = [VALUES[r, c] - VALUES[r - 1, c] for r, c in pairs]
    right = [VALUES[r, c] - VALUES[r, c + 1] for r, c in pairs]
    np.testing.assert_allclose(slopes(N, IDS) @ KNOWN, up + right, atol=1e-15)


def test_roughness_is_between_neighbours_that_are_off_the_diagonal_or_both_on_it() -> None:
    """Cells on the diagonal are of another kind: no difference goes from one to the others."""
    m = N - 1
    cells = [(r, c) for r in range(m) for c in range(r + 1)]
    weight = dict(zip(cells, np.random.default_rng(5).random(10), strict=True))
    wanted = [weight[r + 1, c] - weight[r, c] for r, c in cells if r > c and r + 1 < m]
    wanted += [weight[r, c + 1] - weight[r, c] for r, c in cells if r > c + 1]
    wanted += [weight[r + 1, r + 1] - weight[r, r] for r in range(m - 1)]
    found = roughness(N) @ np.array([weight[cell] for cell in cells])
    np.testing.assert_allclose(sorted(found), sorted(wanted), atol=1e-15)
