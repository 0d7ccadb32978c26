"""Output error over pieces: exact parameters, eliminated states, bounds, an end by the user."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.arrays import Array
from macromicro.identify import engine
from macromicro.identify.engine import (
    Fit,
    Pieces,
    Space,
    fit,
    held_out,
    no_better,
    settle_starts,
    simplest,
    typical,
    without_starts,
)
from macromicro.identify.search import until

N, DT = 60, 0.1


def simulated(values: Array, pieces: Pieces) -> Array:
    """x'' = a u - b x', from a state, by hand."""
    out = np.empty(len(pieces.y))
    for k, first in enumerate(pieces.edges[:-1]):
        x, v = pieces.x[k], pieces.v[k]
        for j in range(pieces.many[k]):
            out[first + j] = x
            push = values[0] * pieces.force[pieces.first[k] + j] - values[1] * v
            x, v = x + DT * v, v + DT * push
    return out


def made(truth: Array, noise: float = 0.0, count: int = 4, seed: int = 1) -> Pieces:
    """Pieces whose states are known but roughly."""
    random = np.random.default_rng(seed)
    many = np.full(count, N)
    begin = np.arange(count) * N
    force = np.repeat(random.uniform(-1.0, 1.0, count * N // 5), 5)
    x, v = random.uniform(-1.0, 1.0, (2, count))
    exact = Pieces(force, begin, many, np.full(count, DT), x, v, np.zeros(count * N))
    y = simulated(truth, exact) + noise * random.standard_normal(count * N)
    off = random.uniform(-0.2, 0.2, (2, count))
    return exact._replace(x=x + off[0], v=v + off[1], y=y)


def space(low: tuple[float, ...] = (0.0, 0.0)) -> Space:
    return Space(("a", "b"), np.ones(2), np.array(low), np.full(2, np.inf), (1.0, 1.0), 1.0)


@settings(max_examples=10, deadline=None)
@given(a=st.floats(0.5, 3.0), b=st.floats(0.1, 2.0))
def test_exact_pieces_give_exact_parameters_from_unknown_states(a: float, b: float) -> None:
    truth = np.array([a, b])
    end = fit(simulated, space(), made(truth), np.array([1.0, 1.0]))
    assert end.settled and not end.bound.any()
    np.testing.assert_allclose(end.values, truth, rtol=1e-7)
    assert end.rms < 1e-8


def test_long_pieces_are_simulated_side_by_side_with_the_same_bits(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pieces, begin = made(np.array([1.5, 0.7]), noise=1e-3), np.array([1.0, 1.0])
    threads = set()

    def watched(values: Array, pieces: Pieces) -> Array:
        threads.add(threading.current_thread().name)
        return simulated(values, pieces)

    alone = fit(watched, space(), pieces, begin)
    assert len(threads) == 1
    monkeypatch.setattr(engine, "_LONG", len(pieces.y))
    beside = fit(watched, space(), pieces, begin)
    assert len(threads) > 2
    np.testing.assert_array_equal(beside.values, alone.values)
    np.testing.assert_array_equal(beside.slopes, alone.slopes)


def test_what_a_state_explains_is_in_no_residual_and_no_slope() -> None:
    truth = np.array([1.5, 0.7])
    end = fit(simulated, space(), made(truth, 0.01), truth)
    step = 1e-3
    for change in ({"x": end.pieces.x + step}, {"v": end.pieces.v + step}):
        by = simulated(end.values, end.pieces._replace(**change))
        by = (by - simulated(end.values, end.pieces)) / step
        for first, last in zip(end.pieces.edges[:-1], end.pieces.edges[1:], strict=True):
            own = by[first:last]
            assert np.abs(end.slopes[first:last].T @ own).max() < 1e-6 * (own @ own)
            assert abs(end.residual[first:last] @ own) < 1e-6 * (own @ own)
        assert np.abs(without_starts(simulated, end, by)).max() < 1e-6


def test_a_parameter_that_wants_below_its_bound_ends_there() -> None:
    truth = np.array([1.5, -0.05])
    end = fit(simulated, space(), made(truth), np.array([1.0, 0.5]))
    assert end.bound.tolist() == [False, True] and end.values[1] == 0.0
    free = fit(simulated, space((0.0, -np.inf)), made(truth), np.array([1.0, 0.5]))
    assert not free.bound.any()
    np.testing.assert_allclose(free.values, truth, rtol=1e-6)


def test_states_are_found_for_known_parameters() -> None:
    truth = np.array([1.5, 0.7])
    rough = made(truth)
    near = settle_starts(simulated, space(), rough, truth)
    assert np.abs(simulated(truth, near) - near.y).max() < 1e-9
    assert np.abs(simulated(truth, rough) - rough.y).max() > 1e-2


def test_an_end_that_the_user_asks_for_keeps_the_best_so_far() -> None:
    truth, calls = np.array([1.5, 0.7]), 0

    def wanted() -> bool:
        nonlocal calls
        calls += 1
        return calls > 3

    with until(wanted):
        end = fit(simulated, space(), made(truth), np.array([1.0, 1.0]))
    assert isinstance(end, Fit) and not end.settled
    assert abs(end.values[0] - 1.5) < 0.5


def test_some_pieces_are_what_they_were() -> None:
    whole = made(np.array([1.5, 0.7]))
    kept = np.array([False, True, False, True])
    part = whole.some(kept)
    assert part.y.tolist() == [*whole.y[N : 2 * N], *whole.y[3 * N :]]
    values = np.array([1.1, 0.3])
    every = np.split(simulated(values, whole), 4)
    np.testing.assert_array_equal(simulated(values, part), np.concatenate(every[1::2]))


def test_pieces_held_out_tell_a_model_that_is_too_poor() -> None:
    pieces = made(np.array([1.5, 0.7]), 0.01, 9)
    rich = held_out(simulated, space(), pieces, np.array([1.0, 1.0]))
    stiff = space()._replace(high=np.array([np.inf, 1e-6]))
    poor = held_out(simulated, stiff, pieces, np.array([1.0, 1e-7]))
    assert len(rich) == len(poor) == 9
    assert typical(rich) == pytest.approx(0.01, rel=0.1) and typical(poor) > 0.05
    judged = simplest({"poor": poor, "rich": rich, "same": rich * 0.99})
    assert judged.structure == "rich"
    assert judged.reasons == {"poor": "rich is better", "same": "not 2 % better than rich"}


def test_a_gain_within_the_scatter_of_the_pieces_is_none() -> None:
    gained = np.array([1.0, -0.9, 1.0, -0.7])
    assert "scatter" in no_better(1.0, 0.9, gained, "poor")
    assert no_better(1.0, 0.9, np.full(4, 0.2), "poor") == ""
    assert "not 2 %" in no_better(1.0, 0.981, np.full(4, 0.2), "poor")
