"""The slow reference itself: thresholds, switching, refinement, starts."""

from __future__ import annotations

import numpy as np
import pytest

from .relays import Relays, refined, relay_grid, relay_run, relay_start, relay_step

WEIGHTS = np.array([[2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [5.0, 0.0, 0.0]])
GRID = relay_grid(WEIGHTS, 10.0, 2.0)


def test_each_cell_with_weight_has_a_relay_with_thresholds_inside_it() -> None:
    """Cells reach from 10 on in steps of 2: up at three quarters, down at one."""
    assert GRID.up.tolist() == [11.5, 13.5, 15.5]
    assert GRID.down.tolist() == [10.5, 12.5, 10.5]
    assert GRID.weights.tolist() == [0.2, 0.3, 0.5]


@pytest.mark.parametrize(
    ("before", "u", "after"),
    [(False, 13.5, True), (False, 13.4, False), (True, 12.6, True), (True, 12.5, False),
     (True, 13.0, True), (False, 13.0, False)],
)  # fmt: skip
def test_a_relay_switches_at_its_thresholds(before: bool, u: float, after: bool) -> None:
    one = Relays(np.array([13.5]), np.array([12.5]), np.array([0.3]))
    on, f = relay_step(one, np.array([before]), u)
    assert (on.tolist(), f) == ([after], 0.3 if after else 0.0)


def test_the_output_is_the_weight_of_the_relays_that_are_up() -> None:
    off = np.zeros(3, bool)
    on, f = relay_run(GRID, off, np.array([12.0, 14.0, 12.4, 16.0, 9.0]))
    np.testing.assert_allclose(f, [0.2, 0.5, 0.2, 1.0, 0.0])
    assert not on.any()


def test_a_finer_grid_has_the_same_weights_in_quarters_and_on_the_diagonal_in_halves() -> None:
    found = refined(WEIGHTS)
    assert found.tolist() == [
        [1.0, 0, 0, 0, 0, 0], [0, 1.0, 0, 0, 0, 0], [0, 0, 1.5, 0, 0, 0], [0, 0, 0, 1.5, 0, 0],
        [1.25, 1.25, 0, 0, 0, 0], [1.25, 1.25, 0, 0, 0, 0],
    ]  # fmt: skip


def test_starts() -> None:
    assert relay_start(GRID).tolist() == [False] * 3
    assert relay_start(GRID, "positive").tolist() == [True] * 3
    assert relay_start(GRID, "positive", [0.0]).tolist() == [True] * 3
    assert relay_start(GRID, "demagnetised", [16.0, 11.0]).tolist() == [True, False, True]
