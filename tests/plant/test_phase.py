"""Relays of the transformation: Section 2.4.1, thresholds at the kiln's load."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from macromicro.hysteresis import advance, fresh
from macromicro.plant import phase
from macromicro.plant.phase import Phase

P = Phase()
TABLE = phase.table(P)
phases = st.builds(
    Phase,
    heat_start=st.floats(40.0, 60.0),
    heat_end=st.floats(80.0, 118.0),
    heat_fold=st.floats(3.0, 30.0),
    cool_offset=st.floats(20.0, 50.0),
    cool_slope=st.floats(0.0, 0.6),
    cool_spread=st.floats(6.0, 20.0),
    cool_end=st.floats(25.0, 37.0),
    width_min=st.floats(0.1, 3.0),
)


def cells(p: Phase) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Weights of the table's cells and their thresholds."""
    grid = np.arange(0.25, 120.0, 0.5)
    up, down = grid[:, None], grid[None, :] + 0.0 * grid[:, None]
    return phase.weights(p, up, down), np.broadcast_to(up, down.shape), down


@given(phases)
@settings(max_examples=25)
def test_table_is_a_share_from_0_to_1(p: Phase) -> None:
    """Section 2.4.1: all relays down is 0, all up is 1, and more heat never means less."""
    table = phase.table(p)
    assert table.values[-1, 0] == pytest.approx(1.0)
    assert table.values.min() >= 0.0
    assert np.all(np.diff(table.values, axis=0) >= -1e-12)
    assert np.all(np.diff(table.values, axis=1) <= 1e-12)


@given(phases)
@settings(max_examples=25)
def test_relays_lie_where_the_parameters_say(p: Phase) -> None:
    """Heating thresholds within start..end; cooling ones above their end, below by the width."""
    weight, up, down = cells(p)
    there = weight > 0.0
    assert there.any()
    assert np.all((up[there] >= p.heat_start) & (up[there] <= p.heat_end))
    assert np.all(down[there] <= up[there] - p.width_min)
    assert np.all(down[there] >= p.cool_end)


@given(phases)
@settings(max_examples=25)
def test_heating_curve_keeps_its_shape_whatever_the_cooling(p: Phase) -> None:
    """Each heating threshold is normalised: the ascending curve depends on heat_* alone."""
    assume(p.cool_end + p.width_min + 1.0 < p.heat_start)
    other = p._replace(cool_offset=p.cool_offset + 3.0, cool_spread=1.5 * p.cool_spread)
    one, two = (phase.weights(q, *_grid()).sum(axis=1) for q in (p, other))
    np.testing.assert_allclose(one, two, rtol=1e-9, atol=1e-15)


def _grid() -> tuple[np.ndarray, np.ndarray]:
    grid = np.arange(0.25, 120.0, 0.5)
    return grid[:, None], np.broadcast_to(grid, (240, 240))


def test_heating_density_rises_e_fold_to_its_end() -> None:
    """Section 5.2.2 (S6): thresholds crowd below the last one."""
    weight, up, _ = cells(P)
    row = weight.sum(axis=1)
    inside = row > 0.0
    levels = up[:, 0][inside]
    slopes = np.diff(np.log(row[inside])) / np.diff(levels)
    np.testing.assert_allclose(slopes, 1.0 / P.heat_fold, rtol=1e-9)
    assert levels[-1] == pytest.approx(P.heat_end, abs=0.5)


@given(
    st.lists(st.floats(30.0, 115.0), min_size=1, max_size=6),
    st.floats(30.0, 115.0),
    st.floats(30.0, 115.0),
)
@settings(max_examples=50)
def test_a_minor_loop_is_wiped_out(before: list[float], a: float, b: float) -> None:
    """Section 2.4.1: an excursion that returns to its larger extreme leaves no trace."""
    memory = fresh(TABLE, 25.0)
    for u in [*before, a]:
        memory, one = advance(TABLE, memory, u)
    for u in (b, a):
        memory, two = advance(TABLE, memory, u)
    assume(abs(before[-1] - a) >= abs(b - a) and (before[-1] - a) * (b - a) >= 0.0)
    assert two == pytest.approx(one, abs=1e-12)


def test_the_hysteresis_is_wide() -> None:
    """Figure 5.8: the same half contraction lies tens of kelvins apart on the way down."""
    memory = fresh(TABLE, 25.0)
    halves = []
    for path in (np.linspace(25.0, 115.0, 901), np.linspace(115.0, 25.0, 901)):
        values = []
        for u in path:
            memory, f = advance(TABLE, memory, float(u))
            values.append(f)
        halves.append(float(path[int(np.argmin(np.abs(np.array(values) - 0.5)))]))
    assert 10.0 < halves[0] - halves[1] < 50.0


def test_a_steep_density_is_computed_without_overflow() -> None:
    """Thresholds beyond the last one weigh nothing, however fast the density falls."""
    with np.errstate(all="raise", under="ignore"):
        steep = phase.weights(P._replace(heat_fold=0.01), *cells(P)[1:])
    assert np.isfinite(steep).all() and steep.max() > 0.0


def test_cooling_thresholds_scatter_normally_about_their_line() -> None:
    """Of one heating threshold: mean 44.5 degC + 0.35 of it, standard deviation 13.5 K."""
    up, down = np.array([[100.0]]), np.array([[66.0, 79.5, 93.0, 52.5]])
    found = phase.weights(P, up, down)[0]
    # The mean is 79.5 degC: one deviation below and above, two below.
    np.testing.assert_allclose(found / found[1], np.exp([-0.5, 0.0, -0.5, -2.0]), rtol=1e-12)
    assert found.sum() == pytest.approx(np.exp((100.0 - P.heat_end) / P.heat_fold))
    other = phase.weights(P, np.array([[80.0]]), np.array([[59.0, 72.5]]))[0]
    assert other[0] / other[1] == pytest.approx(np.exp(-0.5))


@pytest.mark.parametrize("up", [42.9, 43.0, 108.9, 109.0])
def test_heating_thresholds_end_where_they_are_said_to(up: float) -> None:
    there = P.heat_start <= up <= P.heat_end
    assert (phase.weights(P, np.array([[up]]), np.array([[38.0]])).sum() > 0.0) == there


@pytest.mark.parametrize(
    ("down", "there"), [(34.9, False), (35.0, True), (48.0, True), (48.1, False)]
)
def test_cooling_thresholds_lie_between_their_end_and_the_least_width(
    down: float, there: bool
) -> None:
    assert (phase.weights(P, np.array([[50.0]]), np.array([[down]])).sum() > 0.0) == there


def test_the_table_covers_0_to_120_degrees_in_halves() -> None:
    assert phase.TABLE_END == 120.0
    assert (TABLE.lo, TABLE.step, TABLE.n) == (0.0, 0.5, 241)
