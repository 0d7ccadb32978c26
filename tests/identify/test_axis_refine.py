"""Output error for an axis: settled or not, on a free run of known parameters."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from macromicro.identify._axis_refine import begun, free_runs, refined
from macromicro.identify.axis import Axis, simulate
from macromicro.identify.axis_inverse import Estimate, Rows, differences, fitted
from macromicro.identify.notices import ConvergenceWarning
from macromicro.identify.runs import Run

DT = 2e-3
T = np.arange(3000) * DT
TRUTH = Axis(2.0, 3.0, 1.5, 0.4)
FORCE = 9.0 * np.sin(3.0 * T) + 3.0 * np.sin(11.0 * T)


def rows(noise: float = 0.0) -> Rows:
    x = simulate(TRUTH, FORCE, DT) + noise * np.random.default_rng(1).normal(size=3000)
    return differences(Run(T, FORCE, x), FORCE, 40.0, 4)


@pytest.mark.parametrize(("v", "moves"), [(0.021, True), (-0.021, True), (0.019, False)])
def test_a_record_begins_at_rest_below_2_percent_of_its_top_speed(v: float, moves: bool) -> None:
    made = rows()._replace(v=np.array([v, -1.0, 0.5]))
    assert begun(made) == (made.run.x[0], v if moves else 0.0)


def test_free_runs_start_where_the_record_does() -> None:
    made = rows()._replace(v=np.full(3000, 0.7))
    (run,), (error,) = free_runs([made], TRUTH)
    np.testing.assert_array_equal(run, simulate(TRUTH, FORCE, DT, float(made.run.x[0]), 0.7))
    np.testing.assert_array_equal(error, made.run.x - run)


def test_parameters_are_found_again_and_their_errors_told() -> None:
    made = rows(1e-4)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = refined([made], fitted([made], "coulomb"))
    assert isinstance(found, Estimate) and found.names == ("mass", "viscous", "coulomb", "offset")
    np.testing.assert_allclose(found.values, [2.0, 3.0, 1.5, 0.4], rtol=0.01)
    assert found.rms == pytest.approx(1e-4, rel=0.1)
    about = made.run.x - made.run.x.mean()
    assert found.percent == pytest.approx(100.0 * found.rms / np.sqrt(np.mean(about**2)))
    assert np.all(found.std > 0.0) and np.isfinite(found.covariance).all()


def test_a_search_that_is_cut_short_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    from scipy import optimize

    real = optimize.least_squares
    monkeypatch.setattr(optimize, "least_squares", lambda *a, **k: real(*a, **{**k, "max_nfev": 1}))
    made = rows(1e-4)
    with pytest.warns(ConvergenceWarning, match="output error: not settled"):
        refined([made], fitted([made], "coulomb"))
