"""Parts of the fit of a table: noise of a curve, its edges, a branch that must meet another."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from macromicro.hysteresis.curves import Curve
from macromicro.hysteresis.shape import (
    Grid,
    _corrected_end,
    _edge,
    _even_weights,
    _main_curve,
    _scatter,
    branches,
)


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
    found = _corrected_end(branch, 1.0 + miss, curve)
    bent = np.array([1.0, 0.75, 0.5, 0.25, 0.0]) * miss if abs(miss) > 0.1 else 0.0
    wanted = branch + bent
    wanted[0] = 1.0 + miss
    np.testing.assert_allclose(found, wanted)


GRID = Grid(0.0, 2.0, 11)
NODES = GRID.nodes


def rays(
    starts: list[float], ends: list[float] | None = None, off: list[float] | None = None
) -> list[Curve]:
    """Straight curves from s^2 / 20 at the reversals s towards 0, each ending at `ends` and
    all of it off by `off`: the falling branch is u, the rising one u^2 / 20."""
    made = []
    for k, s in enumerate(starts):
        u = np.linspace(s, ends[k] if ends else 0.0, 40)
        made.append(Curve(u, s * u / 20.0 + (off[k] if off else 0.0)))
    return made


STARTS = [6.0, 8.0, 10.0, 12.0, 14.0, 16.0, 18.0, 20.0]


def test_branches_are_the_starts_and_the_highest_curve() -> None:
    """Below the lowest start the rising branch is the lowest curve."""
    for monotone in (False, True):
        rising, falling, gap = branches(rays(STARTS), GRID, monotone)
        wanted = np.where(NODES < 6.0, 0.3 * NODES, NODES**2 / 20.0)
        np.testing.assert_allclose(rising, wanted, atol=1e-9)
        np.testing.assert_allclose(falling, NODES, atol=1e-9)
        assert gap == pytest.approx(0.0, abs=1e-9)


def test_a_drift_is_shared_out_along_both_branches() -> None:
    """Both end at the mean of all curves' ends; `gap` is by how much they missed."""
    off = [0.8, 0.1, 0.0, -0.1, 0.2, 0.0, 0.3, 0.4]
    rising, falling, gap = branches(rays(STARTS, off=off), GRID, False)
    low, left = float(np.mean(off)), 1.0 - np.arange(11) / 10.0
    raw = np.where(NODES < 6.0, 0.3 * NODES + 0.8, NODES**2 / 20.0)
    raw[3:] += off
    np.testing.assert_allclose(rising, raw + (low - 0.8) * left, atol=1e-9)
    np.testing.assert_allclose(falling, NODES + 0.4 + (low - 0.4) * left, atol=1e-9)
    assert gap == pytest.approx(0.8 - 0.4)


def test_only_curves_that_reach_the_lowest_cell_tell_its_output() -> None:
    """Two of them do, to within a grid step of the lowest input of all; the others end higher."""
    ends = [0.0, 4.0, 4.0, 1.9, 4.0, 4.0, 4.0, 0.0]
    off = [0.6, 9.0, 9.0, 0.3, 9.0, 9.0, 9.0, 0.0]
    rising, falling, _ = branches(rays(STARTS, ends, off), GRID, False)
    low = (0.6 + (12.0 * 1.9 / 20.0 + 0.3) + 0.0) / 3.0
    assert rising[0] == falling[0] == pytest.approx(low)


def test_a_curve_that_ends_early_goes_on_in_parallel_to_the_next() -> None:
    """The highest ends at 8: below it has the slope of the second, 0.9, to 4, then that of the
    third, 0.8. The lowest ends at 4, and goes on with the slope of the second lowest, 0.4."""
    ends = [4.0, 0.0, 0.0, 0.0, 0.0, 0.0, 4.0, 8.0]
    curves = rays(STARTS, ends)
    wanted = NODES.copy()
    wanted[:4] = [8.0 - 3.6 - 3.2, 8.0 - 3.6 - 1.6, 8.0 - 3.6, 8.0 - 1.8]
    np.testing.assert_allclose(_main_curve(curves[::-1], GRID), wanted, atol=1e-9)
    rising, falling, gap = branches(curves, GRID, False)
    raw = np.where(NODES < 6.0, 0.3 * NODES, NODES**2 / 20.0)
    raw[:2] = [1.2 - 1.6, 1.2 - 0.8]
    left = 1.0 - np.arange(11) / 10.0
    np.testing.assert_allclose(rising, raw + 0.4 * left, atol=1e-9)
    np.testing.assert_allclose(falling, wanted - wanted[0] * left, atol=1e-9)
    assert gap == pytest.approx(-0.4 - 1.2)


def test_starts_within_half_a_step_are_one() -> None:
    """Their means, joined by a curve that keeps the shape."""
    starts = [6.0, 8.0, 10.0, 12.0, 12.8, 14.0, 15.2, 18.0, 20.0]
    rising, _, _ = branches(rays(starts), GRID, False)
    f = np.array(starts) ** 2 / 20.0
    u = [0.0, 2.0, 4.0, 6.0, 8.0, 10.0, 12.4, 14.0, 15.2, 18.0, 20.0]
    means = [0.0, 0.6, 1.2, *f[:3], 0.5 * (f[3] + f[4]), *f[5:]]
    np.testing.assert_allclose(rising, PchipInterpolator(u, means)(NODES), atol=1e-9)


def test_monotone_branches_are_the_nearest_and_stay_apart() -> None:
    """A dent in the rising branch is levelled to its mean; a falling branch that dips below the
    rising one is lifted to it; both ends are common."""
    off = [0.0, 0.0, 0.6, -0.4, 0.0, 0.0, 0.0, 0.0]
    curves = rays(STARTS, off=off)
    for curve, extra in zip(curves[2:4], (0.6, -0.4), strict=True):
        curve.f[1:] -= extra * np.ones(39)  # only the starts are off
    rising, falling, _ = branches(curves, GRID, True)
    assert np.all(np.diff(rising) >= -1e-12) and np.all(np.diff(falling) >= -1e-12)
    assert np.all(rising <= falling + 1e-12)
    assert rising[0] == falling[0] and rising[-1] == falling[-1]
    f = NODES**2 / 20.0
    np.testing.assert_allclose(rising[7:], f[7:], atol=1e-9)
    level = rays(STARTS)
    level[-1].f[:] = np.where(level[-1].u > 10.0, level[-1].f, 0.1 * level[-1].u)
    rising, falling, _ = branches(level, GRID, True)
    np.testing.assert_allclose(falling[2:5], rising[2:5], atol=1e-9)
    assert np.all(rising <= falling + 1e-12)


def test_each_curve_counts_once_in_each_cell() -> None:
    one = Curve(np.array([7.5, 7.0, 6.0, 5.9, 4.1]), np.zeros(5))
    two = Curve(np.array([7.5, 3.0]), np.zeros(2))
    third = 1.0 / 3.0
    assert _even_weights([one, two], GRID).tolist() == pytest.approx(
        [third, third, third, 0.5, 0.5, 1, 1]
    )
    shifted = GRID._replace(lo=1.0)  # cells 3 to 5, 5 to 7, 7 to 9
    assert _even_weights([one], shifted).tolist() == pytest.approx([0.5, 0.5, 0.5, 0.5, 1.0])


@pytest.mark.parametrize("unit", [1e-10, 1.0, 1e9])
def test_the_unit_of_the_input_does_not_matter(unit: float) -> None:
    curves = rays(STARTS, [4.0, 0.0, 0.0, 0.0, 0.0, 0.0, 4.0, 8.0])
    scaled = [Curve(unit * c.u, c.f) for c in curves]
    grid = Grid(0.0, 2.0 * unit, 11)
    for found, wanted in zip(branches(scaled, grid, False), branches(curves, GRID, False),
                             strict=True):  # fmt: skip
        np.testing.assert_allclose(found, wanted, atol=1e-9)
    np.testing.assert_allclose(_main_curve(scaled[::-1], grid), _main_curve(curves[::-1], GRID))


def test_a_curve_that_ends_at_a_node_but_for_rounding_reaches_it() -> None:
    """0.1 * 7 is more than 0.7; 0.3 and a little is not yet beyond 0.1 * 3."""
    grid = Grid(0.0, 0.1, 8)
    assert grid.nodes[7] > 0.7
    first = Curve(np.linspace(0.7, 0.3 + 1e-13, 9), 2.0 * np.linspace(0.7, 0.3, 9))
    other = Curve(np.linspace(0.7, 0.0, 9), np.linspace(0.7, 0.0, 9))
    wanted = 2.0 * grid.nodes
    wanted[:3] = 0.6 + grid.nodes[:3] - 0.3
    np.testing.assert_allclose(_main_curve([first, other], grid), wanted, atol=1e-9)


def test_where_points_are_dense_the_ends_are_those_of_the_line_near_them() -> None:
    """One reading that is off at either end does not move the branch by all that it is off."""
    u = np.linspace(20.0, 0.0, 2001)
    f = u.copy()
    f[0], f[-1] = 25.0, -5.0
    found = _main_curve([Curve(u, f)], GRID)
    np.testing.assert_allclose(found[1:-1], NODES[1:-1], atol=1e-9)
    for node, near, at in ((10, u >= 18.0, 20.0), (0, u <= 2.0, 0.0)):
        assert found[node] == pytest.approx(np.polyfit(u[near] - at, f[near], 1)[1], abs=1e-6)
        assert abs(found[node] - at) < 0.2


def test_both_monotone_branches_end_where_the_lower_one_is_levelled() -> None:
    """The rising branch dips behind its end at 0: levelled, it ends below, and both do."""
    curves = rays(STARTS)
    for curve, dip in zip(curves, [0.6 + 0.3 * 2.0, *[0.0] * 7], strict=True):
        curve.f[:] = np.interp(
            curve.u,
            [0.0, 2.0, 4.0, 20.0],
            [0.0, curve.u[0] / 10.0 - dip, curve.u[0] / 5.0, curve.u[0]],
        )
    rising, falling, _ = branches(curves, GRID, True)
    assert falling[0] == rising[0] == rising[1] < -1e-3
    assert falling[1] > 1.0
