"""The Prandtl-Ishlinskii operator against the laws of hysteresis (Kuhnen 2003)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.errors import InputError
from macromicro.hysteresis import prandtl
from macromicro.hysteresis.prandtl import (
    Plays,
    Prandtl,
    advance,
    inverse,
    operator,
    output,
    relaxed,
    run,
)

R = [0.0, 4.0, 10.0, 22.0, 40.0]
W = [0.5, 0.2, 0.1, 0.05, 0.02]
P = operator(R, W, offset=3.0)
WIDENS = operator(R, W, widening=0.01)

inputs = st.floats(-150.0, 150.0)
histories = st.lists(inputs, max_size=30)


def after(history: list[float], p: Prandtl = P) -> tuple[Plays, float]:
    """State and output after a history from the relaxed state."""
    s = relaxed(p)
    f = output(p, s)
    for u in history:
        s, f = advance(p, s, u, 0.0)
    return s, f


@given(st.floats(0.0, 50.0), inputs, inputs)
def test_a_play_is_a_slot_that_the_input_carries_along(r: float, u: float, y: float) -> None:
    moved = prandtl.play(r, u, y)
    assert abs(moved - u) <= r + 1e-12 * (r + abs(u))
    assert moved == y or abs(abs(moved - u) - r) <= 1e-12 * (1.0 + abs(u))
    assert (moved - y) * (u - y) >= 0.0


def test_first_rise_and_the_way_back_by_hand() -> None:
    """0 -> 30 -> 20: plays 4, 10, 22, 40 stand at 26, 20, 8, 0, then at 24, 20, 8, 0."""
    s, f = after([30.0])
    assert s.y.tolist() == [30.0, 26.0, 20.0, 8.0, 0.0]
    assert f == pytest.approx(3.0 + 15.0 + 5.2 + 2.0 + 0.4)
    s, f = after([30.0, 20.0])
    assert s.y.tolist() == [20.0, 24.0, 20.0, 8.0, 0.0]
    assert s.u == 20.0
    assert f == pytest.approx(3.0 + 10.0 + 4.8 + 2.0 + 0.4)


@given(histories, st.lists(inputs, min_size=1, max_size=12), inputs)
@settings(max_examples=60, deadline=None)
def test_wiping_out(history: list[float], inner: list[float], last: float) -> None:
    """Extremes within a later, wider swing leave no trace."""
    low, high = min(inner), max(inner)
    with_inner, f = after([*history, low, high, *inner, low, high, last])
    without, g = after([*history, low, high, last])
    assert with_inner.y == pytest.approx(without.y, abs=1e-12)
    assert f == pytest.approx(g, abs=1e-12)


@given(histories, histories, inputs, inputs)
@settings(max_examples=60, deadline=None)
def test_loops_between_equal_extremes_are_congruent(
    first: list[float], second: list[float], one: float, other: float
) -> None:
    low, high = min(one, other), max(one, other)
    path = [*np.linspace(low, high, 7).tolist(), *np.linspace(high, low, 7).tolist()]
    loops = []
    for history in (first, second):
        s, _ = after([*history, low, high, low])
        loop = np.array(run(P, path, s))
        loops.append(loop - loop[0])
    assert np.allclose(loops[0], loops[1], rtol=0.0, atol=1e-12)


@given(inputs, inputs)
@settings(max_examples=60, deadline=None)
def test_loops_have_one_shape_wherever_they_lie(low: float, move: float) -> None:
    """What a Preisach model need not have: a loop's shape depends on its width alone."""
    path = np.r_[np.linspace(0.0, 60.0, 9), np.linspace(60.0, 0.0, 9)]
    loops = []
    for start in (low, low + move):
        s, _ = after([start, start + 60.0, start])
        loop = run(P, start + path, s)
        loops.append(loop - loop[0])
    assert np.allclose(loops[0], loops[1], rtol=0.0, atol=1e-10)


@given(histories, inputs, st.floats(0.0, 100.0))
@settings(max_examples=60, deadline=None)
def test_monotone_and_no_steeper_than_all_weights(
    history: list[float], u: float, rise: float
) -> None:
    s, before = after([*history, u])
    _, above = advance(P, s, u + rise, 0.0)
    assert -1e-12 <= above - before <= sum(W) * rise + 1e-9
    assert above - before >= W[0] * rise - 1e-9


@given(histories, inputs)
@settings(max_examples=60, deadline=None)
def test_bounds(history: list[float], u: float) -> None:
    """The output lies within its thresholds' lag of the line through all weights."""
    _, f = after([*history, u])
    lag = sum(w * r for w, r in zip(W, R, strict=True))
    assert abs(f - 3.0 - sum(W) * u) <= lag + 1e-9


@given(st.lists(inputs, min_size=2, max_size=20))
@settings(max_examples=60, deadline=None)
def test_a_closed_cycle_dissipates(corners: list[float]) -> None:
    """The area of the second of two equal cycles is 2 w r for each |dy|, and never below 0."""
    path: list[float] = []
    for a, b in zip(corners, [*corners[1:], corners[0]], strict=True):
        path += np.linspace(a, b, 40)[1:].tolist()
    s, _ = after([*path, *path])
    f = run(P, path, s)
    u = np.array([s.u, *path])
    area = float(np.sum(0.5 * (u[1:] + u[:-1]) * np.diff([output(P, s), *f])))
    dissipated, y = 0.0, s.y.copy()
    for value in path:
        s, _ = advance(P, s, value, 0.0)
        dissipated += float(np.sum(P.weights * P.thresholds * np.abs(s.y - y)))
        y = s.y.copy()
    assert area >= -1e-9
    # A straight move's corner may fall inside a chord, which then cuts a triangle off.
    assert area == pytest.approx(dissipated, abs=2.0 + 0.1 * dissipated)


@given(histories, inputs)
@settings(max_examples=80, deadline=None)
def test_the_inverse_gives_the_input_back(history: list[float], u: float) -> None:
    q = inverse(P)
    s, back = relaxed(P), relaxed(q)
    for value in [*history, u]:
        s, f = advance(P, s, value, 0.0)
        back, found = advance(q, back, f - P.offset, 0.0)
        assert found == pytest.approx(value, abs=1e-9)


@given(histories, inputs)
@settings(max_examples=80, deadline=None)
def test_the_operator_follows_what_its_inverse_asks(history: list[float], target: float) -> None:
    q = inverse(P)
    s, back = relaxed(P), relaxed(q)
    for wanted in [*history, target]:
        back, u = advance(q, back, wanted, 0.0)
        s, f = advance(P, s, u, 0.0)
        assert f - P.offset == pytest.approx(wanted, abs=1e-9)


def test_the_inverse_of_the_inverse_is_the_operator() -> None:
    twice = inverse(inverse(P))
    assert twice.thresholds == pytest.approx(P.thresholds, abs=1e-12)
    assert twice.weights == pytest.approx(P.weights, abs=1e-12)
    assert (twice.offset, twice.widening) == (0.0, 0.0)


@given(histories, inputs, st.floats(-1e4, 1e4))
@settings(max_examples=60, deadline=None)
def test_a_rate_widens_the_thresholds(history: list[float], u: float, rate: float) -> None:
    """r_i + widening |du/dt| for all plays but the first (Al Janaideh and Krejci 2013)."""
    s, _ = after(history, WIDENS)
    wide = operator(R[:1] + [r + 0.01 * abs(rate) for r in R[1:]], W) if rate else WIDENS
    _, expected = advance(wide, Plays(s.y.copy(), s.u), u, 0.0)
    assert advance(WIDENS, s, u, rate)[1] == pytest.approx(expected, abs=1e-12)


def test_a_faster_loop_is_wider() -> None:
    path = np.r_[np.linspace(0, 100, 201), np.linspace(100, 0, 201)[1:]]
    widths = []
    for dt in (math.inf, 1e-2, 1e-3):
        f = run(WIDENS, np.tile(path, 2), dt=dt)[-401:]
        widths.append(f[300] - f[100])
    assert widths[0] < widths[1] < widths[2]
    still = run(WIDENS, np.tile(path, 2))
    assert still == pytest.approx(run(operator(R, W), np.tile(path, 2)), abs=1e-12)


@given(histories)
@settings(max_examples=30, deadline=None)
def test_nan_moves_nothing(history: list[float]) -> None:
    s, f = after(history)
    before = s.y.tolist()
    again, g = advance(P, s, math.nan, 0.0)
    assert again.y.tolist() == before
    assert (g, again.u) == (f, s.u)


def test_run_leaves_its_start_alone_and_is_the_same_compiled() -> None:
    start, _ = after([40.0, 10.0])
    before = start.y.tolist()
    path = 60.0 * np.sin(np.linspace(0.0, 9.0, 2100))
    long = run(WIDENS, path, start, 1e-3)
    assert start.y.tolist() == before
    short = run(WIDENS, path[:1500], start, 1e-3)
    assert np.array_equal(long[:1500], short)
    assert prandtl.WORTH_COMPILING in range(1501, 2101)
    assert run(P, [5.0], relaxed(P, 5.0))[0] == pytest.approx(3.0 + 5.0 * sum(W))


@pytest.mark.parametrize(
    ("thresholds", "weights", "named"),
    [
        ([0.0, 1.0], [1.0], "as many weights"),
        ([1.0, 2.0], [1.0, 1.0], "0 first"),
        ([0.0, 2.0, 2.0], [1.0, 1.0, 1.0], "0 first"),
        ([0.0, math.inf], [1.0, 1.0], "0 first"),
        ([0.0, 1.0], [0.0, 1.0], "the first above 0"),
        ([0.0, 1.0], [1.0, -0.1], "the first above 0"),
        ([0.0, 1.0], [1.0, math.nan], "the first above 0"),
        (["a"], [1.0], "numbers"),
        ([[0.0]], [[1.0]], "as many weights"),
        (list(range(201)), [1.0] * 201, "1 to 200"),
    ],
)
def test_what_is_no_operator_is_refused(
    thresholds: list[float], weights: list[float], named: str
) -> None:
    with pytest.raises(InputError, match=named):
        operator(thresholds, weights)


def test_offset_widening_and_start_must_be_finite() -> None:
    for offset, widening in ((math.nan, 0.0), (0.0, math.inf), (0.0, -1.0)):
        with pytest.raises(InputError, match="widening of at least 0"):
            operator(R, W, offset, widening)
    with pytest.raises(InputError, match="finite"):
        relaxed(P, math.inf)
