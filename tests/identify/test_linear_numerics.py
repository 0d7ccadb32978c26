"""Numerics of the linear methods: plain sums, and the equations that each method settles at."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify import _linear, output_error
from macromicro.identify._linear import (
    MAX_ITERATIONS,
    Solution,
    Task,
    free_runs,
    is_settled,
    prepare_task,
    regressors,
    solve,
    stable,
)
from macromicro.identify.linear import gls, least_squares, mls, sriv
from macromicro.identify.notices import ConvergenceWarning
from macromicro.identify.records import Signals

RNG = np.random.default_rng(3)
U, Y = RNG.normal(size=60), RNG.normal(size=60)
Y[[0, -1]] = 0.0  # both records below start at rest


def task(na: int = 2, nb: int = 2, delay: int = 1, start: Any = "rest", n: int = 60) -> Task:
    return prepare_task([U[:n], U[::-1][:n]], [Y[:n], Y[::-1][:n]], na, nb, 0.1, delay, start=start)


@pytest.mark.parametrize(
    ("orders", "start", "terms"),
    [((2, 2, 1), "free", 2), ((1, 2, 1), "free", 2), ((1, 2, 3), "free", 4), ((3, 1, 0), "free", 3),
     ((2, 2, 1), "rest", 0)],
)  # fmt: skip
def test_a_free_start_has_as_many_terms_as_the_model_remembers(
    orders: tuple[int, int, int], start: str, terms: int
) -> None:
    """Outputs na samples back, inputs nb + delay - 1."""
    assert task(*orders, start).starts == terms
    assert task(*orders, start).size == orders[0] + orders[1]


@pytest.mark.parametrize(
    ("name", "orders"),
    [("na", (-1, 1, 1)), ("na", (51, 1, 1)), ("nb", (1, 0, 1)), ("nb", (1, 51, 1)),
     ("delay", (1, 1, -1)), ("delay", (1, 1, 51)), ("na", (1.0, 1, 1))],
)  # fmt: skip
def test_orders_out_of_range_are_refused(name: str, orders: Any) -> None:
    with pytest.raises(InputError, match=f"{name}.*a whole number from .* to 50"):
        prepare_task(U, Y, orders[0], orders[1], 0.1, orders[2])


def test_the_smallest_and_largest_orders_are_accepted() -> None:
    long = np.random.default_rng(0).normal(size=400)
    assert prepare_task(long, long, 0, 1, 0.1, 0, start="rest").size == 1
    assert prepare_task(long, long, 50, 50, 0.1, 50, start="rest").size == 100


@pytest.mark.parametrize(("na", "nb", "delay"), [(1, 1, 1), (2, 3, 4)])
def test_a_record_has_two_samples_a_parameter_and_ten_to_spare(
    na: int, nb: int, delay: int
) -> None:
    least = 2 * (na + nb) + delay + 10
    assert len(task(na, nb, delay, n=least).data[0].u) == least
    with pytest.raises(InputError, match=f"{least} or more"):
        task(na, nb, delay, n=least - 1)


@pytest.mark.parametrize("dt", [0.0, -1.0, np.inf, np.nan])
def test_a_sample_time_is_finite_and_above_zero(dt: float) -> None:
    with pytest.raises(InputError, match="dt"):
        prepare_task(U, Y, 1, 1, dt, 1, start="rest")


def test_a_free_start_needs_an_input_that_changes() -> None:
    ones = np.ones(60)
    with pytest.raises(InputError, match="constant"):
        prepare_task(ones, Y, 1, 1, 0.1, 1, start="free")
    assert prepare_task(ones, Y, 1, 1, 0.1, 1, start="rest").starts == 0
    with pytest.raises(InputError, match="start"):
        prepare_task(U, Y, 1, 1, 0.1, 1, start="warm")  # type: ignore[arg-type]


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_regressors_are_past_outputs_inputs_and_starts_through_the_filter(delay: int) -> None:
    """Each record has starts of its own."""
    t = task(2, 2, delay, "free")
    a = np.array([-0.5])
    found = regressors(t, t.outputs, a)
    wanted = np.zeros((120, 4 + 2 * t.starts))
    for i, r in enumerate(t.data):
        u, y, d = (lfilter([1.0], [1.0, -0.5], x) for x in (r.u, r.y, np.eye(1, 60)[0]))
        for k in range(60):
            row = 60 * i + k
            for j in (1, 2):
                wanted[row, j - 1] = -y[k - j] if k >= j else 0.0
                late = k - (j - 1) - delay
                wanted[row, 1 + j] = u[late] if late >= 0 else 0.0
            for s in range(t.starts):
                wanted[row, 4 + i * t.starts + s] = d[k - s] if k >= s else 0.0
    np.testing.assert_allclose(found, wanted, atol=1e-12)


def test_free_runs_are_b_and_starts_through_one_over_a() -> None:
    t = task(1, 2, 2, "free")
    theta = np.array([-0.8, 2.0, 3.0, *range(10, 16)], float)
    for i, (run, r) in enumerate(zip(free_runs(t, theta), t.data, strict=True)):
        y = np.zeros(60)
        for k in range(60):
            y[k] = 0.8 * (y[k - 1] if k else 0.0)
            y[k] += 2.0 * (r.u[k - 2] if k >= 2 else 0.0) + 3.0 * (r.u[k - 3] if k >= 3 else 0.0)
            y[k] += theta[3 + 3 * i + k] if k < 3 else 0.0
        np.testing.assert_allclose(run, y, atol=1e-12)


def test_weighted_least_squares_and_instruments() -> None:
    """psi' W (target - phi theta) = 0, whatever the units of a column."""
    phi, psi, target = RNG.normal(size=(40, 3)), RNG.normal(size=(40, 3)), RNG.normal(size=40)
    phi[:, 1] *= 1e9
    roots = np.sqrt(RNG.uniform(0.1, 2.0, 40))
    plain = np.linalg.lstsq(phi * roots[:, None], target * roots, rcond=None)[0]
    np.testing.assert_allclose(solve(phi, phi, target, roots), plain, rtol=1e-9)
    by = solve(psi, phi, target, roots)
    left = psi.T @ (roots**2 * (target - phi @ by))
    np.testing.assert_allclose(left, 0.0, atol=1e-9)


@pytest.mark.parametrize("same", [True, False])
def test_columns_that_depend_on_each_other_or_are_zero_are_refused(same: bool) -> None:
    phi = RNG.normal(size=(40, 3))
    phi[:, 2] = phi[:, 0] + phi[:, 1]
    psi = phi if same else phi.copy()
    with pytest.raises(InputError, match="do not determine"):
        solve(psi, phi, Y[:40], np.ones(40))
    phi = phi.copy()
    phi[:, 1] = 0.0
    with pytest.raises(InputError, match="zero throughout"):
        solve(phi, phi, Y[:40], np.ones(40))


def test_roots_outside_the_circle_are_reflected_into_it() -> None:
    """0.5 stays, 2 becomes 0.5, -1.25 becomes -0.8; a stable polynomial is left alone."""
    a = np.poly([0.5, 2.0, -1.25])[1:]
    np.testing.assert_allclose(stable(a), np.poly([0.5, 0.5, -0.8])[1:])
    calm = np.poly([0.5, -0.9])[1:]
    assert stable(calm) is calm
    assert stable(np.zeros(0)).size == 0
    np.testing.assert_allclose(stable(np.poly([1.0 + 1.0j, 1.0 - 1.0j])[1:].real), [-1.0, 0.5])


@pytest.mark.parametrize("noise", [0.3, 0.0])
@pytest.mark.parametrize(("share", "done"), [(0.9, True), (1.1, False)])
def test_settled_means_less_than_a_ten_thousandth_of_the_error(
    noise: float, share: float, done: bool
) -> None:
    """Of one parameter alone; without noise, less than 1e-9 of the output matters."""
    t = task(1, 1)
    psi = np.tile([[2.0, 0.1]], (120, 1))
    residual = np.full(120, noise)
    output = np.sqrt(sum(float(r.y @ r.y) for r in t.data))
    for k, column in enumerate((2.0, 0.1)):
        least = (1e-4 * noise + 1e-9 * output) / (column * np.sqrt(120.0))
        new = np.array([1.0, 5.0])
        old = new.copy()
        old[k] -= share * least
        assert is_settled(t, new, old, Solution(new, psi, residual)) == done


A = np.array([-1.6, 0.68])
B = np.array([0.3, 0.15])
DT = 1e-2
RECORDS = [
    np.repeat(np.random.default_rng(7).choice([-1.0, 1.0], 150), 4),
    np.random.default_rng(9).normal(size=400),
]


def answered(noise: float, delay: int = 1) -> list[np.ndarray]:
    """Outputs of the model with white noise on them."""
    b = np.r_[np.zeros(delay), B]
    return [lfilter(b, np.r_[1.0, A], u) + noise * np.random.default_rng(k).normal(size=len(u))
            for k, u in enumerate(RECORDS)]  # fmt: skip


def columns(a: np.ndarray, inputs: Signals, outputs: Signals) -> np.ndarray:
    """Regressors -y[k-1], -y[k-2], u[k-1], u[k-2] of both records, through 1 / A."""
    rows = []
    for u, y in zip(inputs, outputs, strict=True):
        uf, yf = (lfilter([1.0], np.r_[1.0, a], s) for s in (u, y))
        late = [np.r_[np.zeros(k), s[:-k]] for s in (yf, uf) for k in (1, 2)]
        rows.append(np.stack([-late[0], -late[1], late[2], late[3]], axis=1))
    return np.concatenate(rows)


@pytest.mark.parametrize("method", [mls, sriv])
def test_without_noise_the_model_is_found_exactly(method: Any) -> None:
    found = method(RECORDS, answered(0.0), 2, 2, DT)
    np.testing.assert_allclose(found.a, A, rtol=1e-8)
    np.testing.assert_allclose(found.b, B, rtol=1e-8)
    assert found.converged and 1 <= found.iterations < MAX_ITERATIONS
    late = method(RECORDS, answered(0.0, 3), 2, 2, DT, 3)
    np.testing.assert_allclose(late.b, B, rtol=1e-8)


@pytest.mark.parametrize("weighted", [False, True])
def test_steiglitz_mcbride_settles_where_the_prefiltered_equation_is_least_squares(
    weighted: bool,
) -> None:
    """Input and output through 1 / A of the very model that comes out; weights count squared
    residuals."""
    y = answered(0.05)
    w = [np.linspace(0.1, 3.0, len(u)) for u in RECORDS] if weighted else None
    found = mls(RECORDS, y, 2, 2, DT, weights=w)
    phi = columns(found.a, RECORDS, y)
    target = np.concatenate([lfilter([1.0], np.r_[1.0, found.a], s) for s in y])
    load = np.sqrt(np.concatenate(w)) if w else np.ones(len(target))
    again = np.linalg.lstsq(phi * load[:, None], target * load, rcond=None)[0]
    np.testing.assert_allclose(np.r_[found.a, found.b], again, atol=2e-5)
    np.testing.assert_allclose(np.concatenate(found.residuals), target - phi @ again, atol=2e-4)
    assert found.converged


def test_refined_instruments_are_orthogonal_to_what_is_left() -> None:
    """Those are the regressors of the model's own free run; so its bias is gone."""
    y = answered(0.3)
    found = sriv(RECORDS, y, 2, 2, DT)
    own = [lfilter(np.r_[0.0, found.b], np.r_[1.0, found.a], u) for u in RECORDS]
    psi, phi = columns(found.a, RECORDS, own), columns(found.a, RECORDS, y)
    target = np.concatenate([lfilter([1.0], np.r_[1.0, found.a], s) for s in y])
    again = np.linalg.solve(psi.T @ phi, psi.T @ target)
    np.testing.assert_allclose(np.r_[found.a, found.b], again, atol=5e-5)
    assert found.converged
    np.testing.assert_allclose(found.free_run[1], own[1], rtol=1e-9)


@pytest.mark.parametrize("method", [mls, sriv])
def test_what_does_not_settle_is_said_after_a_hundred_iterations(
    method: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(_linear, "is_settled", lambda *_: False)
    with pytest.warns(ConvergenceWarning, match="not settled after 100 iterations"):
        found = method(RECORDS, answered(0.05), 2, 2, DT)
    assert not found.converged and found.iterations == 100 == MAX_ITERATIONS


INPUTS = [
    np.random.default_rng(8).choice([-1.0, 1.0], 800),
    np.random.default_rng(5).normal(size=500),
]
NOISE = np.array([-0.9, 0.4])


def driven(noise: float, coloured: bool) -> list[np.ndarray]:
    """A y = B u + e / D."""
    made = []
    for k, u in enumerate(INPUTS):
        e = noise * np.random.default_rng(k).normal(size=len(u))
        e = lfilter([1.0], np.r_[1.0, NOISE], e) if coloured else e
        made.append(lfilter([1.0], [1.0, -0.8], lfilter([0.0, 0.5], [1.0], u) + e))
    return made


def regressors_of(u: np.ndarray, y: np.ndarray) -> np.ndarray:
    return np.stack([-np.r_[0.0, y[:-1]], np.r_[0.0, u[:-1]]], axis=1)


def test_least_squares_stacks_the_records_and_weighs_their_squares() -> None:
    y = driven(0.1, False)
    w = [np.linspace(0.2, 2.0, len(u)) for u in INPUTS]
    found = least_squares(INPUTS, y, 1, 1, 0.1, weights=w)
    phi, target = (
        np.concatenate([regressors_of(*r) for r in zip(INPUTS, y, strict=True)]),
        np.concatenate(y),
    )
    root = np.sqrt(np.concatenate(w))
    wanted = np.linalg.lstsq(phi * root[:, None], target * root, rcond=None)[0]
    np.testing.assert_allclose(np.r_[found.a, found.b], wanted, rtol=1e-9)
    np.testing.assert_allclose(np.concatenate(found.residuals), target - phi @ wanted, atol=1e-12)
    assert found.a[0] == pytest.approx(-0.8, abs=0.02) and found.iterations == 1


def test_generalised_least_squares_settles_where_residuals_are_white() -> None:
    """Its noise model is the autoregression of what plain residuals would be, and input and
    output are filtered by it."""
    y = driven(0.3, True)
    found = gls(INPUTS, y, 1, 1, 0.1, noise_order=2)
    assert found.converged and 1 < found.iterations < MAX_ITERATIONS
    np.testing.assert_allclose(found.noise, NOISE, atol=0.06)
    theta = np.r_[found.a, found.b]
    left, right = [], []
    for u, out in zip(INPUTS, y, strict=True):
        raw = out - regressors_of(u, out) @ theta
        left.append(-np.stack([raw[1:-1], raw[:-2]], axis=1))
        right.append(raw[2:])
    again = np.linalg.lstsq(np.concatenate(left), np.concatenate(right), rcond=None)[0]
    np.testing.assert_allclose(found.noise, again, atol=1e-3)
    d = np.r_[1.0, found.noise]
    phi = [lfilter(d, [1.0], regressors_of(*r), axis=0) for r in zip(INPUTS, y, strict=True)]
    target = [lfilter(d, [1.0], s) for s in y]
    for rows in (*phi, *target):  # the noise was there before the record: D does not judge these
        rows[:2] = 0.0
    phi, target = np.concatenate(phi), np.concatenate(target)
    wanted = np.linalg.lstsq(phi, target, rcond=None)[0]
    np.testing.assert_allclose(theta, wanted, atol=1e-4)
    np.testing.assert_allclose(np.concatenate(found.residuals), target - phi @ theta, atol=1e-9)
    # Plain least squares is biased by the same noise.
    plain = least_squares(INPUTS, y, 1, 1, 0.1)
    assert abs(plain.a[0] + 0.8) > 3.0 * abs(found.a[0] + 0.8)


@pytest.mark.parametrize("order", [1, 4, 50])
def test_noise_models_of_order_1_to_50_are_accepted(order: int) -> None:
    assert len(gls(INPUTS, driven(0.3, True), 1, 1, 0.1, noise_order=order).noise) == order


@pytest.mark.parametrize("order", [0, 51, -1, 2.0])
def test_other_orders_are_refused(order: Any) -> None:
    with pytest.raises(InputError, match=r"noise_order.*1 to 50"):
        gls(INPUTS, driven(0.3, True), 1, 1, 0.1, noise_order=order)


POLES, ZEROS = np.array([-1.6, 0.8]), np.array([1.0, 0.5])
BITS = np.random.default_rng(4).choice([-1.0, 1.0], 400)
ANSWER = lfilter(np.r_[0.0, ZEROS], np.r_[1.0, POLES], BITS)


def poor(monkeypatch: pytest.MonkeyPatch, theta: list[float]) -> None:
    """The search begins at `theta` alone."""

    def begins(task: Task) -> dict[str, Array]:
        return {"poor": np.array(theta)}

    monkeypatch.setattr(_linear, "begins", begins)


@pytest.mark.parametrize("theta", [[-0.5, 0.1, 3.0, -2.0], [-1.2, 0.5, 1.0, 0.0]])
def test_from_a_poor_start_damping_finds_the_way(
    monkeypatch: pytest.MonkeyPatch, theta: list[float]
) -> None:
    """Full steps lead astray there."""
    poor(monkeypatch, theta)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = output_error(BITS, ANSWER, 2, 2, 1.0)
    np.testing.assert_allclose(np.r_[found.a, found.b], np.r_[POLES, ZEROS], rtol=1e-6)
    assert found.converged and found.iterations < 100


def test_it_ends_at_the_minimum_also_where_rounding_makes_steps_no_better() -> None:
    """Whatever the noise; no direction lowers the sum of squares there."""
    for seed in range(40):
        noise = np.random.default_rng(seed).normal(size=400)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            found = output_error(BITS, ANSWER + noise, 2, 2, 1.0)
        assert found.converged and found.iterations < 20
        theta = np.r_[found.a, found.b]
        least = float(((ANSWER + noise - found.free_run[0]) ** 2).sum())
        for k in range(4):
            for by in (1e-3, -1e-3):
                other = theta.copy()
                other[k] += by
                run = lfilter(np.r_[0.0, other[2:]], np.r_[1.0, other[:2]], BITS)
                assert float(((ANSWER + noise - run) ** 2).sum()) > least


def test_weights_say_what_counts() -> None:
    """POLES spoiled stretch of no weight changes nothing."""
    y: Any = ANSWER.copy()
    y[100:120] += 50.0
    weights = np.ones(400)
    weights[100:120] = 0.0
    found = output_error(BITS, y, 2, 2, 1.0, weights=weights)
    np.testing.assert_allclose(np.r_[found.a, found.b], np.r_[POLES, ZEROS], rtol=1e-6)


def drifting(seed: int) -> tuple[Array, Array]:
    """A machine of second order under a force: `mls` ends at a drift that cancels."""
    random = np.random.default_rng(seed)
    u = np.repeat(random.uniform(-2.0, 2.0, 12), 250)
    a, b = np.array([-1.65833, 0.670831]), np.array([40.0, 9.716])
    return u, lfilter(np.r_[0.0, b], np.r_[1.0, a], u + 0.3 * random.standard_normal(3000))


def test_the_least_of_several_ends_is_taken_and_all_are_told() -> None:
    """From `mls` alone the search ended at a worse fit in these records, next to a pole at 1 with a
    gain of any size."""
    for seed in (2, 6):
        u, y = drifting(seed)
        found = output_error(u, y, 2, 2, 1e-3)
        assert list(found.starts) == ["mls", "sriv", "least_squares", "first order"]
        assert found.fit == pytest.approx(max(found.starts.values()))
        assert found.gain == pytest.approx(3976.0, rel=0.05)
        assert found.starts["mls"] < found.fit - 0.4


def test_beginnings_are_those_of_the_methods_and_of_first_order() -> None:
    task = prepare_task(BITS, ANSWER, 2, 2, 1.0, 1, start="rest")
    found = _linear.begins(task)
    for name in ("mls", "sriv", "least_squares"):
        np.testing.assert_allclose(found[name], np.r_[POLES, ZEROS], rtol=1e-6)
    low = _linear.begins(prepare_task(BITS, ANSWER, 1, 1, 1.0, 1, start="rest"))
    assert "first order" not in low
    np.testing.assert_allclose(found["first order"], [low["mls"][0], 0.0, low["mls"][1], 0.0])
