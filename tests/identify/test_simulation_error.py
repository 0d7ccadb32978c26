"""Output error by damped steps: from a poor start, to the minimum, and that it ends there."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from macromicro.arrays import Array
from macromicro.identify import _descent, output_error
from macromicro.identify import simulation_error as model
from macromicro.identify.regression import Solution, Task, prepared

A, B = np.array([-1.6, 0.8]), np.array([1.0, 0.5])
U = np.random.default_rng(4).choice([-1.0, 1.0], 400)
Y = lfilter(np.r_[0.0, B], np.r_[1.0, A], U)


def poor(monkeypatch: pytest.MonkeyPatch, theta: list[float]) -> None:
    """The search begins at `theta` alone."""

    def begins(task: Task) -> dict[str, Array]:
        return {"poor": np.array(theta)}

    monkeypatch.setattr(model, "begins", begins)


@pytest.mark.parametrize("theta", [[-0.5, 0.1, 3.0, -2.0], [-1.2, 0.5, 1.0, 0.0]])
def test_from_a_poor_start_damping_finds_the_way(
    monkeypatch: pytest.MonkeyPatch, theta: list[float]
) -> None:
    """Full steps lead astray there."""
    poor(monkeypatch, theta)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = output_error(U, Y, 2, 2, 1.0)
    np.testing.assert_allclose(np.r_[found.a, found.b], np.r_[A, B], rtol=1e-6)
    assert found.converged and found.iterations < 100


def test_it_ends_at_the_minimum_also_where_rounding_makes_steps_no_better() -> None:
    """Whatever the noise; no direction lowers the sum of squares there."""
    for seed in range(40):
        noise = np.random.default_rng(seed).normal(size=400)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            found = output_error(U, Y + noise, 2, 2, 1.0)
        assert found.converged and found.iterations < 20
        theta = np.r_[found.a, found.b]
        least = float(((Y + noise - found.free_run[0]) ** 2).sum())
        for k in range(4):
            for by in (1e-3, -1e-3):
                other = theta.copy()
                other[k] += by
                run = lfilter(np.r_[0.0, other[2:]], np.r_[1.0, other[:2]], U)
                assert float(((Y + noise - run) ** 2).sum()) > least


def test_a_step_is_the_damped_least_squares_one_with_columns_of_one_length() -> None:
    """(J'WJ + damping) step = J'W residual, J's columns scaled to length one and back; a
    column of zeros is not moved along."""
    random = np.random.default_rng(5)
    psi, left = random.normal(size=(30, 3)) * [1.0, 1e3, 0.0], random.normal(size=30)
    roots = random.uniform(0.5, 2.0, 30)
    for damping in (1e-6, 1.0):
        found = _descent._step(Solution(np.zeros(3), psi, left), roots, damping)
        heavy = psi[:, :2] * roots[:, None]
        size = np.linalg.norm(heavy, axis=0)
        j = heavy / size
        wanted = np.linalg.solve(j.T @ j + damping * np.eye(2), j.T @ (left * roots)) / size
        np.testing.assert_allclose(found, [*wanted, 0.0], rtol=1e-9)


def test_the_cost_is_weighted_and_infinite_where_the_run_overflowed() -> None:
    made = Solution(np.zeros(1), np.zeros((2, 1)), np.array([1.0, 2.0]))
    assert _descent.cost(made, np.array([3.0, 0.5])) == 9.0 + 1.0
    over = made._replace(residual=np.array([1.0, np.nan]))
    assert _descent.cost(over, np.ones(2)) == np.inf


def test_weights_say_what_counts() -> None:
    """A spoiled stretch of no weight changes nothing."""
    y: Any = Y.copy()
    y[100:120] += 50.0
    weights = np.ones(400)
    weights[100:120] = 0.0
    found = output_error(U, y, 2, 2, 1.0, weights=weights)
    np.testing.assert_allclose(np.r_[found.a, found.b], np.r_[A, B], rtol=1e-6)
    task = prepared(U, y, (2, 2, 1), 1.0, weights, "rest")
    np.testing.assert_allclose(task.roots**2, weights)


def drifting(seed: int) -> tuple[Array, Array]:
    """A machine of second order whose input is disturbed: `mls` ends at a drift that cancels."""
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
    task = prepared(U, Y, (2, 2, 1), 1.0, None, "rest")
    found = _descent.begins(task)
    for name in ("mls", "sriv", "least_squares"):
        np.testing.assert_allclose(found[name], np.r_[A, B], rtol=1e-6)
    low = _descent.begins(prepared(U, Y, (1, 1, 1), 1.0, None, "rest"))
    assert "first order" not in low
    np.testing.assert_allclose(found["first order"], [low["mls"][0], 0.0, low["mls"][1], 0.0])


def test_errors_of_outputs_in_counts_are_those_of_rounding() -> None:
    """A machine of first order under inputs that are held: its rounding is far from white, and no
    other method is asked."""
    off, step, truth, drawn = [], 0.1, np.array([-0.98, 0.02]), 0
    for seed in range(12):
        random = np.random.default_rng(seed)
        u = np.repeat(random.uniform(-8.0, 8.0, 20), 150)
        clean = lfilter([0.0, truth[1]], [1.0, truth[0]], u)
        y = np.floor(clean / step + random.uniform()) * step
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = output_error(u, y, 1, 1, 1.0)
        drawn += found.draws is not None  # else it is taken for more, which is on the safe side
        off.append(np.abs(np.r_[found.a, found.b] - truth) / found.std)
    assert drawn >= 10
    assert (np.nan_to_num(off) < 2.0).mean() >= 0.8
    assert (np.array(off) < 0.5).mean() < 0.6
