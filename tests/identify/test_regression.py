"""What the linear methods share, against plain sums over a few samples."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from macromicro.errors import InputError
from macromicro.identify.notices import ConvergenceWarning, RestWarning, UnstableWarning
from macromicro.identify.records import Record
from macromicro.identify.regression import (
    MAX_ITERATIONS,
    Solution,
    Task,
    delayed,
    filtered,
    finished,
    free_runs,
    impulse,
    per_record,
    prepared,
    regressors,
    settled,
    solved,
    stable,
)

RNG = np.random.default_rng(3)
U, Y = RNG.normal(size=60), RNG.normal(size=60)
Y[[0, -1]] = 0.0  # both records below start at rest


def task(na: int = 2, nb: int = 2, delay: int = 1, start: Any = "rest", n: int = 60) -> Task:
    return prepared([U[:n], U[::-1][:n]], [Y[:n], Y[::-1][:n]], (na, nb, delay), 0.1, None, start)


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
        prepared(U, Y, orders, 0.1, None, "rest")


def test_the_smallest_and_largest_orders_are_accepted() -> None:
    long = np.random.default_rng(0).normal(size=400)
    assert prepared(long, long, (0, 1, 0), 0.1, None, "rest").size == 1
    assert prepared(long, long, (50, 50, 50), 0.1, None, "rest").size == 100


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
        prepared(U, Y, (1, 1, 1), dt, None, "rest")


def test_a_free_start_needs_an_input_that_changes() -> None:
    ones = np.ones(60)
    with pytest.raises(InputError, match="constant"):
        prepared(ones, Y, (1, 1, 1), 0.1, None, "free")
    assert prepared(ones, Y, (1, 1, 1), 0.1, None, "rest").starts == 0
    with pytest.raises(InputError, match="start"):
        prepared(U, Y, (1, 1, 1), 0.1, None, "warm")  # type: ignore[arg-type]


def test_delays_and_impulses() -> None:
    x = np.array([1.0, 2.0, 3.0])
    assert [delayed(x, k).tolist() for k in (0, 1, 3)] == [[1, 2, 3], [0, 1, 2], [0, 0, 0]]
    assert len(delayed(x, 5)) == 3
    assert impulse(3).tolist() == [1.0, 0.0, 0.0]
    np.testing.assert_allclose(filtered(np.array([-0.5]), impulse(4)), [1.0, 0.5, 0.25, 0.125])


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_regressors_are_past_outputs_inputs_and_starts_through_the_filter(delay: int) -> None:
    """Each record has starts of its own."""
    t = task(2, 2, delay, "free")
    a = np.array([-0.5])
    found = regressors(t, [r.u for r in t.data], [r.y for r in t.data], a)
    wanted = np.zeros((120, 4 + 2 * t.starts))
    for i, r in enumerate(t.data):
        u, y, d = (lfilter([1.0], [1.0, -0.5], x) for x in (r.u, r.y, impulse(60)))
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
    np.testing.assert_allclose(solved(phi, phi, target, roots), plain, rtol=1e-9)
    by = solved(psi, phi, target, roots)
    left = psi.T @ (roots**2 * (target - phi @ by))
    np.testing.assert_allclose(left, 0.0, atol=1e-9)


@pytest.mark.parametrize("same", [True, False])
def test_columns_that_depend_on_each_other_or_are_zero_are_refused(same: bool) -> None:
    phi = RNG.normal(size=(40, 3))
    phi[:, 2] = phi[:, 0] + phi[:, 1]
    psi = phi if same else phi.copy()
    with pytest.raises(InputError, match="do not determine"):
        solved(psi, phi, Y[:40], np.ones(40))
    phi = phi.copy()
    phi[:, 1] = 0.0
    with pytest.raises(InputError, match="zero throughout"):
        solved(phi, phi, Y[:40], np.ones(40))


def test_roots_outside_the_circle_are_reflected_into_it() -> None:
    """0.5 stays, 2 becomes 0.5, -1.25 becomes -0.8; a stable polynomial is left alone."""
    a = np.poly([0.5, 2.0, -1.25])[1:]
    np.testing.assert_allclose(stable(a), np.poly([0.5, 0.5, -0.8])[1:])
    calm = np.poly([0.5, -0.9])[1:]
    assert stable(calm) is calm
    assert stable(np.zeros(0)).size == 0
    np.testing.assert_allclose(stable(np.poly([1.0 + 1.0j, 1.0 - 1.0j])[1:].real), [-1.0, 0.5])


def test_stacked_values_are_parted_by_record() -> None:
    data = [Record(U[:n], Y[:n], np.ones(n)) for n in (3, 5, 2)]
    parts = per_record(Task(data, 1, 1, 0.1, 1, 0), np.arange(10.0))
    assert [p.tolist() for p in parts] == [[0, 1, 2], [3, 4, 5, 6, 7], [8, 9]]


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
        assert settled(t, new, old, Solution(new, psi, residual)) == done


def fit(theta: Any, residual: np.ndarray, t: Task, **options: Any) -> Any:
    psi = regressors(t, [r.u for r in t.data], [r.y for r in t.data], np.zeros(0))
    return finished("own", t, Solution(np.array(theta), psi, residual), **options)


def test_a_finished_fit_has_the_free_run_and_what_was_solved() -> None:
    t = task(1, 1)
    residual = RNG.normal(size=120)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = fit([-0.5, 2.0], residual, t, iterations=7, noise=np.array([0.1]))
    assert (found.method, found.a.tolist(), found.b.tolist()) == ("own", [-0.5], [2.0])
    assert (found.iterations, found.converged, found.noise.tolist()) == (7, True, [0.1])
    np.testing.assert_array_equal(np.concatenate(found.residuals), residual)
    np.testing.assert_allclose(found.free_run[1], free_runs(t, found_theta(found))[1])
    assert found.covariance.shape == (2, 2)
    y, run = np.concatenate([r.y for r in t.data]), np.concatenate(found.free_run)
    about = np.concatenate([r.y - r.y.mean() for r in t.data])
    wanted = 100.0 * (1.0 - np.linalg.norm(y - run) / np.linalg.norm(about))
    assert found.fit == pytest.approx(wanted)


def found_theta(found: Any) -> np.ndarray:
    return np.r_[found.a, found.b]


def test_what_is_not_settled_or_not_stable_is_said() -> None:
    t, residual = task(1, 1), RNG.normal(size=120)
    assert MAX_ITERATIONS == 100
    with pytest.warns(ConvergenceWarning, match="own: not settled after 9 iterations"):
        assert not fit([-0.5, 2.0], residual, t, iterations=9, converged=False).converged
    with pytest.warns(UnstableWarning, match="own: the model is unstable"):
        fit([-1.001, 2.0], residual, t)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fit([-1.0, 2.0], residual, t)  # an integrator is none of that


@pytest.mark.parametrize(
    ("first", "delay", "start", "said"),
    [(3.0, 1, "rest", True), (0.65, 1, "rest", True), (0.55, 1, "rest", False),
     (3.0, 0, "rest", False), (3.0, 1, "free", False)],
)  # fmt: skip
def test_a_record_that_does_not_start_at_rest_is_pointed_out(
    first: float, delay: int, start: Any, said: bool
) -> None:
    """Beyond six times the usual residual, or half of the greatest output."""
    y = np.r_[first, 0.1 * Y[1:]]
    y[30] = 5.0
    t = prepared(U, y, (1, 1, delay), 0.1, None, start)
    residual = np.full(60, 0.1)
    theta = [-0.5, 2.0, *[0.0] * t.starts]
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        fit(theta, residual, t)
    assert any(issubclass(w.category, RestWarning) for w in told) == said
