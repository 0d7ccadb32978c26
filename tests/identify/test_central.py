"""Slopes by differences to both sides."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.identify._central import central


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
