"""Play operators that widen with the rate, and a lag behind them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.hysteresis import prandtl, prandtl_fit, prandtl_rate
from macromicro.hysteresis.prandtl_rate import widened
from macromicro.kernel import compiled

DT = 1e-3
T = np.arange(10000) * DT
# Full strokes from 0.2 to 6 Hz.
U = 50.0 - 50.0 * np.cos(2.0 * np.pi * (0.2 * T + 0.29 * T**2))
TRUE = prandtl.operator(np.arange(16) * 3.125, np.r_[0.6, np.full(15, 0.03)], 5.0)
WIDE = TRUE._replace(widening=0.002)


def noisy(p: prandtl.Prandtl, lag: float, seed: int = 1) -> Array:
    noise = 0.02 * np.random.default_rng(seed).standard_normal(len(U))
    return prandtl_rate.run(p, lag, U, DT) + noise


def test_without_widening_and_lag_it_is_the_plain_operator() -> None:
    plain = prandtl.run(TRUE, U, prandtl.relaxed(TRUE, float(U[0])))
    np.testing.assert_allclose(prandtl_rate.run(TRUE, 0.0, U, DT), plain, rtol=1e-12)
    y = prandtl_fit.moved(U[:500], TRUE.thresholds)
    out = np.empty_like(y)
    widened(U[:500], TRUE.thresholds, 0.0, 0.0, DT, out)
    np.testing.assert_allclose(out, y, rtol=1e-12)


def test_interpreted_is_compiled_and_widens_as_the_live_operator() -> None:
    u = U[:800]
    out, again = (np.empty((800, 16)) for _ in range(2))
    widened(u, TRUE.thresholds, 0.01, 0.7, DT, out)
    compiled(widened)(u, TRUE.thresholds, 0.01, 0.7, DT, again)
    np.testing.assert_allclose(again, out, rtol=1e-12)
    live = prandtl.run(WIDE, u, prandtl.relaxed(WIDE, float(u[0])), DT)
    np.testing.assert_allclose(prandtl_rate.run(WIDE, 0.0, u, DT), live, rtol=1e-9)


def test_a_lag_is_of_first_order() -> None:
    """Plays of threshold 0 after a step: 63 % after the lag."""
    line = prandtl.operator([0.0, 10.0], [1.0, 0.0], 0.0)
    u = np.r_[0.0, np.full(3000, 1.0)]
    f = prandtl_rate.run(line, 0.5, u, DT)
    assert f[500] == pytest.approx(1.0 - math.exp(-1.0), abs=2e-3)


@pytest.mark.parametrize(("widening", "lag"), [(0.002, 0.0), (0.0, 0.004), (0.002, 0.004)])
def test_both_are_found(widening: float, lag: float) -> None:
    found = prandtl_rate.fit(U, noisy(TRUE._replace(widening=widening), lag), DT)
    assert found.better
    assert found.fit.operator.widening == pytest.approx(widening, abs=1e-4)
    assert found.lag == pytest.approx(lag, abs=3e-4)
    assert found.fit.held_rms < 0.03 < 5.0 * found.fit.held_rms < found.still.held_rms
    again = prandtl_rate.run(found.fit.operator, found.lag, U, DT)
    np.testing.assert_allclose(again, found.fit.outputs, atol=1e-9)


def test_a_loop_without_rate_dependence_is_no_better_with_it() -> None:
    found = prandtl_rate.fit(U, noisy(TRUE, 0.0), DT)
    assert not found.better
    assert found.fit.held_rms == pytest.approx(found.still.held_rms, rel=0.02)


@pytest.mark.parametrize("dt", [0.0, -1.0, math.nan, math.inf])
def test_a_sample_time_is_refused(dt: float) -> None:
    with pytest.raises(InputError, match="sample time"):
        prandtl_rate.fit(U, U, dt)
