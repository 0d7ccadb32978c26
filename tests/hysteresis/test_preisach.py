"""The model of a table in its user's units: forward, inverse, its starts and its state."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.errors import InputError
from macromicro.hysteresis import FodTable, Preisach, advance, fresh, from_density
from macromicro.hysteresis.preisach import demagnetising

from .relays import refined, relay_grid, relay_run, relay_start

LO, STEP, N = 20.0, 0.5, 41
HI = LO + STEP * (N - 1)
LOW, HIGH = -0.7, 3.3
_rng = np.random.default_rng(3)
WEIGHTS = np.tril(_rng.random((N - 1, N - 1)) * (_rng.random((N - 1, N - 1)) > 0.3))
TABLE = FodTable.from_everett(from_density(WEIGHTS, LO, STEP, N), LOW, HIGH)
SIGNED = np.tril(_rng.normal(0.3, 1.0, (N - 1, N - 1)))
_edges = np.zeros((N, N))
_edges[1:, :-1] = np.cumsum(np.cumsum(SIGNED, axis=0)[:, ::-1], axis=1)[:, ::-1]
MIXED = FodTable(LO, STEP, np.tril(_edges, -1) * (4.0 / _edges[-1, 0]), LOW)
FALLING = FodTable.from_everett(from_density(WEIGHTS, LO, STEP, N), HIGH, LOW)

inputs = st.floats(LO - 2.0, HI + 2.0)
histories = st.lists(inputs, max_size=40)
nodes = st.lists(st.integers(-2, N + 1), min_size=1, max_size=60)
starts = st.sampled_from(["negative", "positive", "demagnetised"])
tables = st.sampled_from([TABLE, MIXED, FALLING])


def after(history: list[float], table: FodTable = TABLE) -> Preisach:
    model = Preisach(table)
    for u in history:
        model.step(u)
    return model


@given(starts, nodes, st.booleans())
@settings(max_examples=60, deadline=None)
def test_equals_the_relays_on_the_grid(start: Any, history: list[int], signed: bool) -> None:
    """(2.2) to (2.4), relay by relay, against (2.11), from all three starts."""
    table = MIXED if signed else TABLE
    # The demagnetised staircase has corners half way between grid lines.
    relays = relay_grid(refined(SIGNED if signed else WEIGHTS), LO, STEP / 2)
    swing = demagnetising(LO, STEP, N)
    on = relay_start(relays, start, swing)
    model = Preisach(table)
    model.reset(start)
    scale = float(np.abs(relays.weights).sum())
    assert (model.f - LOW) / 4.0 == pytest.approx(relays.weights[on].sum(), abs=1e-12 * scale)
    path = np.array([LO + i * STEP for i in history])
    _, expected = relay_run(relays, on, path)
    assert np.allclose((model.run(path) - LOW) / 4.0, expected, rtol=0.0, atol=1e-12 * scale)


def test_refined_relays_have_the_same_curves() -> None:
    coarse, fine = relay_grid(WEIGHTS, LO, STEP), relay_grid(refined(WEIGHTS), LO, STEP / 2)
    path = LO + STEP * np.array([0, 12, 3, 30, 7, 25, 9, 40, 0])
    outputs = [relay_run(r, relay_start(r), path)[1] for r in (coarse, fine)]
    assert np.allclose(outputs[0], outputs[1], atol=1e-12)


def test_demagnetised_relays_lie_below_the_antidiagonal() -> None:
    """S+ of the ideal state is alpha + beta < 2 * middle; ties may fall either way."""
    relays = relay_grid(refined(np.tril(np.ones((N - 1, N - 1)))), LO, STEP / 2)
    on = relay_start(relays, "demagnetised", demagnetising(LO, STEP, N))
    beyond = relays.up + relays.down - (LO + HI)
    assert np.all(on[beyond < -0.25 * STEP])
    assert not np.any(on[beyond > 0.25 * STEP])


@pytest.mark.parametrize("n", [40, 41])
def test_a_symmetric_density_demagnetises_to_mid_output(n: int) -> None:
    rng = np.random.default_rng(8)
    half = np.tril(rng.random((n - 1, n - 1)))
    weights = half + half[::-1, ::-1].T  # mu(alpha, beta) = mu(-beta, -alpha)
    model = Preisach(FodTable.from_everett(from_density(weights, -1.0, 2.0 / (n - 1), n), -5, 5))
    model.reset("demagnetised")
    assert model.u == pytest.approx(0.0, abs=1e-12)
    assert model.f == pytest.approx(0.0, abs=1e-12)


def test_starts_and_saturations() -> None:
    model = Preisach(TABLE)
    assert (model.u, model.f) == (LO, LOW)
    model.reset("positive")
    assert (model.u, model.f) == (HI, pytest.approx(HIGH, abs=1e-14))
    assert model.step(-math.inf) == pytest.approx(LOW, abs=1e-14)
    assert model.step(math.inf) == pytest.approx(HIGH, abs=1e-14)


@given(tables, st.lists(st.lists(inputs, max_size=6), max_size=8))
@settings(max_examples=60, deadline=None)
def test_first_order_curves_are_those_of_the_table(
    table: FodTable, turns: list[list[float]]
) -> None:
    """f_{M,m} from (2.11) is what was put in (Figure 2.19), both kinds."""
    for top, *lower in (sorted(turn, reverse=True) for turn in turns if turn):
        model = after([top], table)
        expected = table.curve(top, lower, "descending")
        assert np.allclose(model.run(lower), expected, rtol=0.0, atol=1e-12)
        model.reset("positive")
        rise = [top, *[2 * top - u for u in lower]]
        expected = table.curve(top, rise, "ascending")
        assert np.allclose(model.run(rise), expected, rtol=0.0, atol=1e-12)


@given(tables, histories, st.floats(-0.2, 1.2))
@settings(max_examples=200, deadline=None)
def test_inverse_then_step_lands_on_the_target(
    table: FodTable, history: list[float], share: float
) -> None:
    model = after(history, table)
    low, high = sorted((table.f_low, table.f_low + table.span))
    target = low + share * (high - low)
    before = model.state
    found = model.inverse(target)
    assert model.state == before
    assert model.step(found.u) == found.f
    assert found.error == found.f - target
    if 0.0 <= share <= 1.0:
        assert abs(found.error) < 1e-9 * (high - low)
    elif table is not MIXED:  # whose output may leave the saturations
        assert found.u == pytest.approx(HI if (share > 0.5) == (table.span > 0) else LO)


@given(histories, inputs)
@settings(max_examples=100, deadline=None)
def test_inverse_of_a_monotone_table_is_the_nearest_input(history: list[float], u: float) -> None:
    """No input nearer than the one found would have reached the target."""
    model = after(history)
    target = model.peek(u)
    found = model.inverse(target)
    assert found.f == pytest.approx(target, abs=1e-12)
    reached = min(max(u, LO), HI)
    assert abs(found.u - model.u) <= abs(reached - model.u) + 1e-9


def test_inverse_across_corners_by_hand() -> None:
    """One relay weight per diagonal cell: the output is the input, wherever the past."""
    table = FodTable.from_everett(from_density(np.eye(4), 0.0, 1.0, 5), 0.0, 4.0)
    model = after([3.5, 0.5, 3.0, 1.25], table)
    assert model.f == pytest.approx(1.25)
    for target in (0.1, 1.2, 1.3, 3.7):
        assert model.inverse(target).u == pytest.approx(target)
    beyond = model.inverse(4.5)
    assert (beyond.u, beyond.f) == (4.0, pytest.approx(4.0))
    assert beyond.error == pytest.approx(-0.5)


@given(histories, st.lists(st.floats(LOW, HIGH), min_size=1, max_size=30))
@settings(max_examples=50, deadline=None)
def test_a_path_of_targets_is_followed(history: list[float], targets: list[float]) -> None:
    one, other = after(history), after(history)
    path, reached = one.run_inverse(targets)
    assert np.max(np.abs(reached - targets)) < 1e-9 * 4.0
    assert np.array_equal(other.run(path), reached)
    assert one.state == other.state


def test_long_paths_of_targets_are_compiled_to_the_same() -> None:
    targets = np.random.default_rng(2).uniform(LOW, HIGH, 2500)
    one, other = Preisach(TABLE), Preisach(TABLE)
    path, reached = one.run_inverse(targets)
    parts = [other.run_inverse(part) for part in np.split(targets, 5)]
    assert np.array_equal(path, np.concatenate([u for u, _ in parts]))
    assert np.max(np.abs(reached - targets)) < 1e-9 * 4.0


@given(tables, histories, histories)
@settings(max_examples=60, deadline=None)
def test_a_saved_state_goes_on_as_the_original(
    table: FodTable, history: list[float], later: list[float]
) -> None:
    model = after(history, table)
    saved = json.loads(json.dumps(model.state))
    other = Preisach(table)
    other.step(31.0)
    other.state = saved
    assert (other.u, other.f, other.state) == (model.u, model.f, model.state)
    assert [other.step(u) for u in later] == [model.step(u) for u in later]
    twin = model.copy()
    twin.step(LO + 3.3)
    assert model.state == after([*history, *later], table).state


@given(st.floats(LO, HI), st.floats(0.0, 1.0))
@settings(max_examples=100, deadline=None)
def test_initialise_at_gives_that_input_and_output(u: float, share: float) -> None:
    grid, rising, falling = TABLE.major_loop
    low, high = (float(np.interp(u, grid, side)) for side in (rising, falling))
    model = after([33.0, 21.0, 30.0])
    model.initialise_at(u, low + share * (high - low))
    assert model.u == u
    assert model.f == pytest.approx(low + share * (high - low), abs=1e-11)


@pytest.mark.parametrize(("u", "f"), [(30.0, 5.0), (30.0, -1.0), (30.0, math.nan), (12.0, 0.0)])
def test_initialise_at_refuses_what_no_past_leads_to(u: float, f: float) -> None:
    model = after([33.0, 25.0])
    before = model.state
    with pytest.raises(InputError, match="to"):
        model.initialise_at(u, f)
    assert model.state == before


def test_run_is_step_bit_for_bit_compiled_and_interpreted() -> None:
    rng = np.random.default_rng(4)
    path = LO - 1.0 + rng.random(4000) * 22.0
    for table in (TABLE, MIXED, FALLING):
        fast, slow, parts = Preisach(table), Preisach(table), Preisach(table)
        outputs = fast.run(path)
        assert outputs.tolist() == [slow.step(u) for u in path.tolist()]
        assert (
            outputs.tolist()
            == np.concatenate([parts.run(p) for p in path.reshape(4, 1000)]).tolist()
        )
        assert fast.state == slow.state == parts.state


@pytest.mark.parametrize("compiled", [True, False])
def test_the_stack_grows_with_the_reversals(compiled: bool) -> None:
    """A decaying swing of thousands of turns is remembered whole."""
    turns = np.array([30.0 + (-1) ** k * 9.0 * 0.999**k for k in range(3000)])
    model = Preisach(TABLE)
    down = model.run(turns) if compiled else np.array([model.step(u) for u in turns.tolist()])
    assert len(model.state["maxima"]) == 1500
    wide = fresh(model._arrays, LO, 4000)
    expected = []
    for u in turns.tolist():
        wide, f = advance(model._arrays, wide, u)
        expected.append(LOW + 4.0 * f)
    assert np.allclose(down, expected, rtol=0.0, atol=1e-13)
    model.step(turns[2])
    assert len(model.state["maxima"]) == 2


def test_outputs_of_mixed_weights_may_leave_the_saturations() -> None:
    """With negative relays the output is not clipped: it is the sum, whatever it is."""
    weights = np.zeros((4, 4))
    weights[0, 0], weights[3, 3], weights[3, 0] = 1.5, -0.5, 1.0
    values = np.zeros((5, 5))
    values[1:, :-1] = np.cumsum(np.cumsum(weights, axis=0)[:, ::-1], axis=1)[:, ::-1]
    model = Preisach(FodTable(0.0, 1.0, np.tril(values, -1), 10.0))
    assert model.run([1.0, 4.0, 3.0, 0.0]).tolist() == pytest.approx([11.5, 12.0, 12.5, 10.0])


BAD: list[tuple[Any, str]] = [
    ({"maxima": [30.0]}, "saved"),
    ({"maxima": [30.0], "minima": [31.0]}, "order"),
    ({"maxima": [30.0, 31.0], "minima": [25.0, 26.0]}, "order"),
    ({"maxima": [30.0, 29.0], "minima": [25.0, 24.0]}, "order"),
    ({"maxima": [50.0], "minima": [25.0]}, "order"),
    ({"maxima": [], "minima": []}, "order"),
    ({"maxima": [math.nan], "minima": [25.0]}, "NaN"),
    (None, "saved"),
]


@pytest.mark.parametrize(("state", "named"), BAD)
def test_impossible_states_are_refused(state: Any, named: str) -> None:
    with pytest.raises(InputError, match=named):
        Preisach(TABLE).state = state


def test_nan_and_other_nonsense_are_refused_and_change_nothing() -> None:
    model = after([33.0, 25.0])
    before = model.state
    for call in (model.step, model.peek, model.inverse):
        with pytest.raises(InputError, match="number"):
            call(math.nan)
    for values in ([30.0, math.nan], [[30.0]], ["warm"], 30.0):
        for walk in (model.run, model.run_inverse):
            with pytest.raises(InputError):
                walk(values)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="demagnetised"):
        model.reset("neutral")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="FodTable"):
        Preisach([[0.0, 1.0]])  # type: ignore[arg-type]
    assert model.state == before
    assert model.run([]).size == 0


@pytest.mark.parametrize("table", [TABLE, MIXED, FALLING])
def test_inputs_beyond_the_table_count_as_its_ends(table: FodTable) -> None:
    model = after([30.0], table)
    model.step(HI + 1e3)
    assert model.u == HI and model.f == pytest.approx(table.f_low + table.span)
    model.step(LO - 1e3)
    assert model.u == LO and model.f == pytest.approx(table.f_low)
