"""The reversal stack against relays and against the laws of Section 2.4.1."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.errors import InputError
from macromicro.hysteresis import Everett, Memory, advance, fresh, from_density, lookup, peek
from macromicro.kernel import compiled, kernel

from .relays import relay_grid, relay_step

LO, STEP, N = 20.0, 0.5, 41
HI = LO + STEP * (N - 1)
_rng = np.random.default_rng(11)
WEIGHTS = np.tril(_rng.random((N - 1, N - 1)) * (_rng.random((N - 1, N - 1)) > 0.3))
TABLE = from_density(WEIGHTS, LO, STEP, N)

inputs = st.floats(LO - 2.0, HI + 2.0)
histories = st.lists(inputs, max_size=40)
nodes = st.lists(st.integers(-2, N + 1), min_size=1, max_size=60)


def moved(history: list[float], depth: int = 256) -> tuple[Memory, list[float]]:
    """Memory and outputs after a history that starts in negative saturation."""
    memory, outputs = fresh(TABLE, LO, depth), []
    for u in history:
        memory, f = advance(TABLE, memory, u)
        outputs.append(f)
    return memory, outputs


def known(memory: Memory) -> tuple[list[list[float]], float]:
    """All that counts in a memory."""
    return memory.corners[: memory.pairs + 1].tolist(), memory.u


@given(nodes)
@settings(max_examples=100, deadline=None)
def test_equals_the_relays_on_the_grid(history: list[int]) -> None:
    """(2.2), relay by relay, against (2.11)."""
    relays = relay_grid(WEIGHTS, LO, STEP)
    on = np.zeros(relays.up.shape, dtype=bool)
    memory = fresh(TABLE, LO)
    for i in history:
        on, expected = relay_step(relays, on, LO + i * STEP)
        memory, f = advance(TABLE, memory, LO + i * STEP)
        assert f == pytest.approx(expected, abs=1e-12)


def test_one_relay_switches_at_its_own_thresholds() -> None:
    """The reference itself: a relay is up from alpha on, down from beta on (Figure 2.11)."""
    weights = np.zeros((4, 4))
    weights[2, 1] = 3.0
    relays = relay_grid(weights, 0.0, 1.0)
    on = np.zeros(1, dtype=bool)
    outputs = []
    for u in (0.0, 2.0, 3.0, 2.0, math.nan, 1.0, 2.0):
        on, f = relay_step(relays, on, u)
        outputs.append(f)
    assert outputs == [0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0]


@given(inputs, st.floats(0.0, 25.0))
@settings(max_examples=50, deadline=None)
def test_first_order_descending_curves(top: float, drop: float) -> None:
    """f_M = E(M, lo) and f_{M,m} = f_M - E(M, m): Figure 2.19, (2.8)."""
    _, (f_top, f_low) = moved([top, top - drop])
    assert f_top == pytest.approx(lookup(TABLE, top, LO), abs=1e-15)
    assert f_low == pytest.approx(f_top - lookup(TABLE, top, top - drop), abs=1e-14)


@given(st.lists(st.floats(0.02, 0.98), min_size=2, max_size=12))
@settings(max_examples=50, deadline=None)
def test_output_is_the_sum_over_the_corners(shares: list[float]) -> None:
    """(2.11) with first-order descending curves, for reversals each inside the last loop."""

    def curve(top: float, low: float) -> float:
        return moved([top, low])[1][-1]

    low, high = LO, HI
    corners: list[float] = []
    for k, share in enumerate(shares):
        middle = low + share * (high - low)
        corners.append(middle)
        low, high = (low, middle) if k % 2 == 0 else (middle, high)
    f = moved(corners)[1][-1]
    if len(corners) % 2:
        corners.append(corners[-1])  # M_n = m_n = u after a rise
    lows = [LO, *corners[1::2]]
    expected = sum(
        curve(top, lows[k + 1]) - curve(top, lows[k]) for k, top in enumerate(corners[::2])
    )
    assert f == pytest.approx(expected, abs=1e-12)


@given(histories, st.lists(inputs, min_size=1, max_size=20), inputs)
@settings(max_examples=100, deadline=None)
def test_wiping_out(history: list[float], inner: list[float], after: float) -> None:
    """Extremes within a later, wider swing leave no trace (wiping-out property)."""
    low, high = min(inner), max(inner)
    with_inner, _ = moved([*history, low, high, *inner, high, low, after])
    without, _ = moved([*history, low, high, low, after])
    assert known(with_inner) == known(without)


@given(histories)
@settings(max_examples=50, deadline=None)
def test_corners_are_nested(history: list[float]) -> None:
    """M_1 > M_2 > ... > m_2 > m_1 (Figure 2.17)."""
    memory, _ = moved(history)
    rows = memory.corners[1 : memory.pairs + 1]
    assert memory.pairs >= 1
    assert all(a[0] > b[0] and a[1] < b[1] for a, b in pairwise(rows))
    assert np.all(rows[:, 0] >= rows[:, 1])
    assert rows[-1, 1] == memory.u


@given(histories, histories, inputs, inputs)
@settings(max_examples=50, deadline=None)
def test_minor_loops_between_equal_extremes_are_congruent(
    first: list[float], second: list[float], one: float, other: float
) -> None:
    low, high = min(one, other), max(one, other)
    path = [*np.linspace(low, high, 9), *np.linspace(high, low, 9)]
    loops = []
    for history in (first, second):
        _, outputs = moved([*history, low, high, low, *path])
        loop = np.array(outputs[-len(path) :])
        loops.append(loop - loop[0])
    assert np.allclose(loops[0], loops[1], rtol=0.0, atol=1e-12)


@given(histories, inputs, st.lists(st.floats(0.0, 1.0), max_size=20))
@settings(max_examples=50, deadline=None)
def test_return_point_memory(history: list[float], turn: float, shares: list[float]) -> None:
    """A closed excursion from a turning point ends in the very state that it left."""
    before, _ = moved([*history, turn])
    state, f = known(before), before.corners[before.pairs, 3]
    start = min(max(turn, LO), HI)
    # Excursions on the side from which the input came cannot cross the last turning point.
    falling = before.corners[before.pairs, 0] > start
    edge = before.corners[before.pairs, 0] if falling else before.corners[before.pairs - 1, 1]
    edge = min(max(edge, LO), HI)
    memory = before
    for share in shares:
        memory, _ = advance(TABLE, memory, start + 0.999 * share * (edge - start))
    memory, back = advance(TABLE, memory, start)
    assert back == f
    assert known(memory) == state


@given(histories, inputs)
@settings(max_examples=100, deadline=None)
def test_peek_tells_what_advance_will_give_and_touches_nothing(
    history: list[float], u: float
) -> None:
    for depth in (256, 3):
        memory, _ = moved(history, depth)
        before = memory.corners.copy()
        told = peek(TABLE, memory, u)
        assert np.array_equal(memory.corners, before)
        assert advance(TABLE, memory, u)[1] == told


@given(histories, inputs, st.lists(st.floats(0.0, 1.0), max_size=30))
@settings(max_examples=100, deadline=None)
def test_many_small_steps_equal_one(
    history: list[float], target: float, shares: list[float]
) -> None:
    for depth in (256, 3):
        one, _ = moved([*history, target], depth)
        start = history[-1] if history else LO
        between = [start + share * (target - start) for share in sorted(shares)]
        many, _ = moved([*history, *between, target], depth)
        assert known(one) == known(many)


@given(histories, inputs, inputs)
@settings(max_examples=100, deadline=None)
def test_output_is_bounded_and_follows_the_input(
    history: list[float], one: float, other: float
) -> None:
    for depth in (256, 3):
        memory, outputs = moved(history, depth)
        low, high = peek(TABLE, memory, min(one, other)), peek(TABLE, memory, max(one, other))
        assert low <= high + 1e-14
        assert all(0.0 <= f <= 1.0 for f in [*outputs, low, high])


@given(histories)
@settings(max_examples=50, deadline=None)
def test_saturation_forgets_everything(history: list[float]) -> None:
    high, top = moved([*history, math.inf])
    assert top[-1] == 1.0
    assert high.pairs == 1
    low, bottom = moved([*history, -math.inf])
    assert bottom[-1] == 0.0
    assert low.pairs == 1
    assert advance(TABLE, low, 30.0)[1] == moved([30.0])[1][-1]


@given(histories, histories)
@settings(max_examples=50, deadline=None)
def test_nan_changes_nothing(before: list[float], after: list[float]) -> None:
    plain, plain_outputs = moved([*before, *after])
    marred, marred_outputs = moved([*before, math.nan, *after])
    assert known(plain) == known(marred)
    del marred_outputs[len(before)]
    assert plain_outputs == marred_outputs
    assert peek(TABLE, plain, math.nan) == plain.corners[plain.pairs, 3]


def guarded(depth: int) -> tuple[Memory, np.ndarray]:
    """A memory inside a larger array, whose other rows nobody may touch."""
    whole = np.full((depth + 7, 4), -1.0)
    start = fresh(TABLE, LO, depth)
    whole[3 : depth + 4] = start.corners
    return Memory(whole[3 : depth + 4], start.pairs, start.u), whole


def decaying(turns: int) -> list[float]:
    """Nested reversals: each inside all loops before."""
    middle = 0.5 * (LO + HI)
    return [middle + (-1) ** k * 9.0 * 0.97**k for k in range(turns)]


def test_a_full_stack_loses_only_the_innermost_loops() -> None:
    depth, turns = 4, decaying(40)
    small, whole = guarded(depth)
    full = fresh(TABLE, LO)
    for k, u in enumerate(turns):
        small, f = advance(TABLE, small, u)
        full, true = advance(TABLE, full, u)
        if k < 2 * depth:
            assert f == true
        else:
            bound = lookup(TABLE, turns[2 * depth - 2], turns[2 * depth - 1])
            assert abs(f - true) <= bound + 1e-14
    assert full.pairs > depth == small.pairs
    assert np.all(whole[:3] == -1.0)
    assert np.all(whole[depth + 4 :] == -1.0)
    # Up to the corner where the lost loops began, both meet again, and stay together.
    for u in (turns[2 * depth - 2], 31.0, turns[1], turns[0] + 0.1, 30.0):
        small, f = advance(TABLE, small, u)
        full, true = advance(TABLE, full, u)
        assert f == pytest.approx(true, abs=1e-14)
    assert known(small) == known(full)


def test_a_full_stack_is_continuous() -> None:
    memory, _ = moved(decaying(31), 4)
    last = memory.corners[memory.pairs, 3]
    for u in np.linspace(memory.u, HI, 4001)[1:]:
        memory, f = advance(TABLE, memory, float(u))
        assert 0.0 <= f - last < 2e-3
        last = f
    assert last == 1.0


@given(st.integers(1, 4), histories)
@settings(max_examples=50, deadline=None)
def test_no_history_writes_outside_the_stack(depth: int, history: list[float]) -> None:
    memory, whole = guarded(depth)
    for u in history:
        memory, _ = advance(TABLE, memory, u)
        assert 1 <= memory.pairs <= depth
    assert np.all(whole[:3] == -1.0)
    assert np.all(whole[depth + 4 :] == -1.0)
    assert memory.corners[0].tolist() == [math.inf, -math.inf, 0.0, 0.0]


@pytest.mark.parametrize(
    ("u", "depth", "named"), [(30.0, 0, "at least 1"), (math.nan, 8, "number")]
)
def test_impossible_memories_are_refused(u: float, depth: int, named: str) -> None:
    with pytest.raises(InputError, match=named):
        fresh(TABLE, u, depth)


@kernel
def drive(table: Everett, memory: Memory, history: np.ndarray, out: np.ndarray) -> Memory:
    """Along `history`: output, the output a little ahead."""
    for t in range(history.shape[0]):
        u = float(history[t])
        memory, f = advance(table, memory, u)
        out[t, 0] = f
        out[t, 1] = peek(table, memory, u + 0.37)
        out[t, 2] = peek(table, memory, u - 3.1)
        out[t, 3] = lookup(table, u + 1.7, u)
    return memory


@pytest.mark.parametrize("depth", [256, 3])
def test_compiled_equals_interpreted_bit_for_bit(depth: int) -> None:
    rng = np.random.default_rng(5)
    walk = LO + 10.0 + np.cumsum(rng.normal(0.0, 0.8, 3000))
    walk = LO - 1.0 + np.abs((walk - LO) % 44.0 - 22.0)
    walk[rng.integers(0, 3000, 40)] = [math.nan, math.inf, -math.inf, LO + 3 * STEP] * 10
    history = np.concatenate([walk, decaying(700)])
    ends, outs = [], []
    for run in (drive, compiled(drive)):
        out = np.zeros((history.shape[0], 4))
        ends.append(known(run(TABLE, fresh(TABLE, LO + 1.0, depth), history, out)))
        outs.append(out)
    assert outs[0].tobytes() == outs[1].tobytes()
    assert ends[0] == ends[1]
    assert np.all((outs[0][:, :3] >= 0.0) & (outs[0][:, :3] <= 1.0))
