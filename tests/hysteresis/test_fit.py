"""Parts of the fit of a table: noise of a curve, its edges, a branch that must meet another."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.hysteresis.curves import Curve
from macromicro.hysteresis.fit import _edge, _ended, _scatter


@pytest.mark.parametrize("uneven", [False, True])
def test_scatter_is_the_outputs_noise_whatever_the_spacing(uneven: bool) -> None:
    """By how far each point lies from the line between its neighbours, which have noise, too."""
    rng = np.random.default_rng(6)
    u = np.sort(rng.uniform(0.0, 1.0, 4001))[::-1] if uneven else np.linspace(1.0, 0.0, 4001)
    noisy = Curve(u, 3.0 * u + rng.normal(0.0, 0.02, 4001))
    assert _scatter(noisy) == pytest.approx(0.02, rel=0.06)
    assert _scatter(Curve(u[::-1], noisy.f)) == pytest.approx(_scatter(noisy), rel=0.1)
    assert _scatter(Curve(u[:7], noisy.f[:7])) == 0.0  # too few to tell


def test_an_edge_is_the_line_through_the_points_near_it() -> None:
    """Where there are eight different ones; else the mean of those at the very edge."""
    u = np.r_[np.linspace(5.0, 4.0, 9), 3.0]
    f = 2.0 * u + 0.1 * np.array([1, -2, 1, 0, 0, 0, 1, -2, 1, 50])
    near = slice(0, 9)
    slope, at = np.polyfit(u[near] - 5.0, f[near], 1)
    assert _edge(u, f, 1.0) == pytest.approx(at)
    assert slope == pytest.approx(2.0, abs=0.1)
    assert _edge(u[2:], f[2:], 0.75) == pytest.approx(f[2])  # seven within the width
    assert _edge(np.r_[5.0, 5.0, 4.0], np.array([1.0, 2.0, 9.0]), 1.0) == 1.5


@pytest.mark.parametrize("miss", [0.05, 0.2, -0.2])
def test_a_branch_is_bent_to_its_end_only_by_more_than_its_noise(miss: float) -> None:
    """Four times the scatter; then all the way along, less and less."""
    u = np.linspace(1.0, 0.0, 2001)
    curve = Curve(u, u + np.random.default_rng(7).normal(0.0, 0.02, 2001))
    branch = np.array([1.0, 2.0, 3.0, 4.0, 5.0])
    found = _ended(branch, 1.0 + miss, curve)
    bent = np.array([1.0, 0.75, 0.5, 0.25, 0.0]) * miss if abs(miss) > 0.1 else 0.0
    wanted = branch + bent
    wanted[0] = 1.0 + miss
    np.testing.assert_allclose(found, wanted)
