"""Slopes by differences to both sides, and the triangle that stands for a long table."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.identify import search as module
from macromicro.identify.search import central, stretches, triangle


@pytest.mark.parametrize("cuts", [[], [1], [3, 3, 250]])
def test_products_of_columns_are_those_of_all_tables(
    cuts: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_ROWS", 100)
    table = np.random.default_rng(0).standard_normal((1050, 4))
    found = triangle(np.split(table, cuts))
    assert found.shape == (4, 4)
    np.testing.assert_array_equal(found, np.triu(found))
    np.testing.assert_allclose(found.T @ found, table.T @ table, rtol=1e-12, atol=1e-10)


def test_least_squares_of_the_triangle_are_those_of_the_table(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As exact as by the whole table, and not as by products, which square the condition."""
    monkeypatch.setattr(module, "_ROWS", 100)
    random = np.random.default_rng(1)
    near = random.standard_normal(1000)
    left = np.stack([near, near + 1e-7 * random.standard_normal(1000)], axis=1)
    table = np.c_[left, left @ [1.0, 2.0]]
    found = triangle([table])
    theta = np.linalg.lstsq(found[:2, :2], found[:2, 2], rcond=None)[0]
    np.testing.assert_allclose(theta, [1.0, 2.0], rtol=1e-6)


def test_a_column_of_zeros_stays_one_and_few_rows_are_enough() -> None:
    table = np.array([[1.0, 0.0, 2.0], [3.0, 0.0, 1.0]])
    found = triangle([table, np.empty((0, 3))])
    assert found.shape == (2, 3) and (found[:, 1] == 0.0).all()


def test_stretches_are_views_of_all_rows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_ROWS", 4)
    rows = np.arange(10)
    parts = list(stretches(rows))
    assert [part.tolist() for part in parts] == [[0, 1, 2, 3], [4, 5, 6, 7], [8, 9]]
    assert all(np.shares_memory(part, rows) for part in parts)
    assert [len(part) for part in stretches(rows[:0])] == [0]


def test_slopes_are_exact_of_squares_and_stay_within_the_bounds() -> None:
    seen = []

    def made(z: np.ndarray) -> np.ndarray:
        seen.append(z.copy())
        return np.array([z[0] ** 2, z[0] + 3.0 * z[1], z[1]])

    at, nudge = np.array([2.0, 1.0]), np.array([0.1, 0.5])
    free = central(made, at, nudge, np.full(2, -9.0), np.full(2, 9.0))
    assert free == pytest.approx(np.array([[4.0, 0.0], [1.0, 3.0], [0.0, 1.0]]))
    seen.clear()
    central(made, at, nudge, np.array([2.0, 0.8]), np.array([2.05, 9.0]))
    assert [list(z) for z in seen] == [[2.05, 1.0], [2.0, 1.0], [2.0, 1.5], [2.0, 0.8]]
