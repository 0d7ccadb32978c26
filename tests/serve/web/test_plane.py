"""The estimate of the Preisach plane."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.hysteresis.pictures import staircase
from macromicro.serve.web._hub import SMALLEST, Plane


def test_turning_points_leave_the_same_memory_as_every_sample() -> None:
    walk = 80.0 + np.cumsum(np.random.default_rng(3).normal(size=4000)).clip(-50, 80)
    plane, every = Plane(25.0, 170.0), Plane(25.0, 170.0)
    for part in np.array_split(walk, 37):
        plane.feed(part)
    every.model.run(walk)
    assert plane.model.state == every.model.state
    beta, alpha = staircase(plane.model)
    assert np.diff(alpha).max() <= 0.0 <= np.diff(beta).min()


def test_corners_are_reversals_and_small_ones_are_not_drawn() -> None:
    plane = Plane(25.0, 170.0)
    plane.feed(np.array([25.0, 120.0, 60.0, 90.0, 80.0, 80.0 + SMALLEST / 2, 80.0]))
    words = plane.words()
    assert words["corners"] == [[120.0, 60.0], [90.0, 80.0]]
    assert (words["u"], words["low"], words["high"]) == (80.0, 25.0, pytest.approx(170.0))
    assert words["contraction"] is None  # nothing measured says how long the wires are
    plane.feed(np.array([np.nan, 130.0]))
    assert [top for top, _ in plane.words()["corners"]] == []
    plane.forget()
    assert plane.words()["u"] == 25.0
