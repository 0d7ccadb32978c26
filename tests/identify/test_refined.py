"""What Steiglitz-McBride and the refined instruments settle at: the equations of each."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from macromicro import identify
from macromicro.identify._refined import steiglitz_mcbride
from macromicro.identify.iterated import mls, sriv
from macromicro.identify.notices import ConvergenceWarning
from macromicro.identify.records import Signals
from macromicro.identify.regression import MAX_ITERATIONS, prepared

A = np.array([-1.6, 0.68])
B = np.array([0.3, 0.15])
DT = 1e-2
RNG = np.random.default_rng(7)
U = [np.repeat(RNG.choice([-1.0, 1.0], 150), 4), RNG.normal(size=400)]


def answered(noise: float, delay: int = 1) -> list[np.ndarray]:
    """Outputs of the model with white noise on them."""
    b = np.r_[np.zeros(delay), B]
    return [lfilter(b, np.r_[1.0, A], u) + noise * np.random.default_rng(k).normal(size=len(u))
            for k, u in enumerate(U)]  # fmt: skip


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
    found = method(U, answered(0.0), 2, 2, DT)
    np.testing.assert_allclose(found.a, A, rtol=1e-8)
    np.testing.assert_allclose(found.b, B, rtol=1e-8)
    assert found.converged and 1 <= found.iterations < MAX_ITERATIONS
    late = method(U, answered(0.0, 3), 2, 2, DT, 3)
    np.testing.assert_allclose(late.b, B, rtol=1e-8)


@pytest.mark.parametrize("weighted", [False, True])
def test_steiglitz_mcbride_settles_where_the_prefiltered_equation_is_least_squares(
    weighted: bool,
) -> None:
    """Input and output through 1 / A of the very model that comes out; weights count squared
    residuals."""
    y = answered(0.05)
    w = [np.linspace(0.1, 3.0, len(u)) for u in U] if weighted else None
    found = mls(U, y, 2, 2, DT, weights=w)
    phi = columns(found.a, U, y)
    target = np.concatenate([lfilter([1.0], np.r_[1.0, found.a], s) for s in y])
    load = np.sqrt(np.concatenate(w)) if w else np.ones(len(target))
    again = np.linalg.lstsq(phi * load[:, None], target * load, rcond=None)[0]
    np.testing.assert_allclose(np.r_[found.a, found.b], again, atol=2e-5)
    np.testing.assert_allclose(np.concatenate(found.residuals), target - phi @ again, atol=2e-4)
    assert found.converged


def test_refined_instruments_are_orthogonal_to_what_is_left() -> None:
    """Those are the regressors of the model's own free run; so its bias is gone."""
    y = answered(0.3)
    found = sriv(U, y, 2, 2, DT)
    own = [lfilter(np.r_[0.0, found.b], np.r_[1.0, found.a], u) for u in U]
    psi, phi = columns(found.a, U, own), columns(found.a, U, y)
    target = np.concatenate([lfilter([1.0], np.r_[1.0, found.a], s) for s in y])
    again = np.linalg.solve(psi.T @ phi, psi.T @ target)
    np.testing.assert_allclose(np.r_[found.a, found.b], again, atol=5e-5)
    assert found.converged
    np.testing.assert_allclose(found.free_run[1], own[1], rtol=1e-9)


def test_the_solution_and_its_residuals_belong_together() -> None:
    task = prepared(U, answered(0.05), (2, 2, 1), DT, None, "rest")
    solution, count, done = steiglitz_mcbride(task)
    target = solution.residual + solution.psi @ solution.theta
    a = solution.theta[:2]
    filtered = np.concatenate([lfilter([1.0], np.r_[1.0, a], r.y) for r in task.data])
    np.testing.assert_allclose(target, filtered, atol=1e-3)
    assert done and count < MAX_ITERATIONS


@pytest.mark.parametrize("method", [mls, sriv])
def test_what_does_not_settle_is_said_after_a_hundred_iterations(
    method: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    from macromicro.identify import _refined

    monkeypatch.setattr(_refined, "settled", lambda *_: False)
    with pytest.warns(ConvergenceWarning, match="not settled after 100 iterations"):
        found = method(U, answered(0.05), 2, 2, DT)
    assert not found.converged and found.iterations == 100 == MAX_ITERATIONS


def test_both_are_as_good_as_each_other_under_white_noise() -> None:
    y = answered(0.05)
    one, two = mls(U, y, 2, 2, DT), sriv(U, y, 2, 2, DT)
    assert (one.method, two.method) == ("mls", "sriv")
    for found in (one, two):
        np.testing.assert_allclose(found.a, A, atol=0.02)
    assert identify.mls is mls and identify.sriv is sriv
