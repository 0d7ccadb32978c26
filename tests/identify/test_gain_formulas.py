"""Static gain: asymptote, intervals and errors against textbook formulas and curve_fit."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest
from scipy.optimize import curve_fit
from scipy.stats import t as student

from macromicro.errors import InputError
from macromicro.identify.heating import static_gain as nonlinear
from macromicro.identify.notices import ConvergenceWarning
from macromicro.models.weighted_gain import Exponential, Weighted, exponential, weighted
from macromicro.thesis.chapter5.actuator_models import asymptote, linearise, upper

VOLTS = np.array([1.5, 1.525, 1.55, 1.575, 1.6])
RISE = np.array([57.5, 73.6, 79.1, 81.9, 82.4])  # (5.5), off by some tenths


def test_the_asymptote_is_aitkens() -> None:
    """Differences 4 and 2: another 2 in all; only the last three values count."""
    assert asymptote([0.0, 4.0, 6.0]) == 8.0
    assert asymptote([-90.0, 0.0, 4.0, 6.0]) == 8.0
    for bad in ([4.0], [4.0, 6.0], [0.0, 2.0, 4.0], [0.0, 2.0, 2.0], [0.0, -4.0, -6.0]):
        with pytest.raises(InputError, match="differences shrink"):
            asymptote(bad)


def test_the_linearised_route_is_a_line_through_the_origin() -> None:
    """y' = -ln(1 - (y - y0) / B) over x - x0; its interval by the usual formula, Student's t."""
    found = linearise(VOLTS[::-1], RISE[::-1], 83.0)
    x, y = VOLTS[1:] - 1.5, -np.log(1.0 - (RISE[1:] - 57.5) / 25.5)
    a = (x * y).sum() / (x * x).sum()
    spread = np.sqrt(((y - a * x) ** 2).sum() / 3.0 / (x * x).sum())
    assert found.model == (pytest.approx(25.5), pytest.approx(a), 1.5, 57.5)
    reach = student.ppf(0.975, 3) * spread
    np.testing.assert_allclose(found.interval[1], [a - reach, a + reach])
    assert np.isnan(found.interval[[0, 2]]).all() and np.isnan(found.asymptote_interval).all()
    off = [exponential(found.model, v) for v in VOLTS] - RISE
    assert found.rms == pytest.approx(np.sqrt(np.mean(off**2)))
    assert found.asymptote == 83.0


def test_without_an_asymptote_it_is_taken_from_equal_steps() -> None:
    assert linearise(VOLTS, RISE).asymptote == pytest.approx(asymptote(RISE))
    uneven = np.r_[VOLTS[:-1], 1.61]
    with pytest.raises(InputError, match="equal steps"):
        linearise(uneven, RISE)
    for early in (np.r_[1.49, VOLTS[1:]], np.r_[1.5, 1.51, VOLTS[2:]]):  # the last three count
        assert linearise(early, RISE).asymptote == pytest.approx(asymptote(RISE))


@pytest.mark.parametrize("y_inf", [82.4, 80.0, 57.5, 10.0])
def test_an_asymptote_lies_above_all_temperatures(y_inf: float) -> None:
    with pytest.raises(InputError, match=r"more than all temperatures \(82.4\)"):
        linearise(VOLTS, RISE, y_inf)


def test_the_nonlinear_fit_and_its_intervals_are_those_of_curve_fit() -> None:
    """Its covariance, Student's t with two degrees of freedom; the asymptote is b + y0."""

    def curve(x: Any, b: float, a: float, y0: float) -> Any:
        return b * (1.0 - np.exp(-a * (x - 1.5))) + y0

    values, spread = curve_fit(curve, VOLTS, RISE, p0=(25.0, 40.0, 57.0), xtol=1e-12, ftol=1e-12)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = nonlinear(VOLTS[::-1], RISE[::-1])
    b, a, y0 = values
    assert found.model == pytest.approx((b, a, 1.5, y0), rel=1e-6)
    reach = student.ppf(0.975, 2) * np.sqrt(np.diag(spread))
    np.testing.assert_allclose(found.interval[:, 0], values - reach, rtol=1e-4)
    np.testing.assert_allclose(found.interval[:, 1], values + reach, rtol=1e-4)
    both = student.ppf(0.975, 2) * np.sqrt(spread[0, 0] + spread[2, 2] + 2.0 * spread[0, 2])
    assert found.asymptote == pytest.approx(b + y0)
    assert found.asymptote_interval == pytest.approx((b + y0 - both, b + y0 + both), rel=1e-4)
    assert found.rms == pytest.approx(np.sqrt(np.mean((curve(VOLTS, *values) - RISE) ** 2)))


LOW = Exponential(a=37.8631)


def test_the_upper_gain_begins_at_the_lower_ones_value_at_1_6_volts() -> None:
    """It meets its goals to a percent and leaves the lower ones alone, without a warning."""
    truth = Weighted(LOW, 8.0, 9.0, 1.625, exponential(LOW, 1.6), 45.0, 1.69)
    goals = {v: weighted(truth, v) for v in (1.65, 1.7, 1.75, 1.8, 1.9)}
    steady = {v: exponential(LOW, v) for v in VOLTS[:-1].tolist()}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = upper(LOW, steady, goals)
    assert (found.low, found.start) == (LOW, 1.625)
    assert found.offset == pytest.approx(exponential(LOW, 1.6))
    for v, goal in goals.items():
        assert weighted(found, v) == pytest.approx(goal, rel=0.01)
    for v, rise in steady.items():
        assert weighted(found, v) == pytest.approx(rise, abs=0.1)
    assert found.rate == pytest.approx(9.0, rel=0.05)
    assert upper(LOW, steady, goals, start=1.6).start == 1.6


def test_what_the_data_do_not_tell_is_held_at_what_is_printed() -> None:
    """Goals of the printed gain, and nothing below, give the printed numbers back."""
    goals = {v: weighted(Weighted(), v) for v in (1.8, 1.9)}
    found = upper(Weighted().low, {}, goals)
    assert found[1:] == pytest.approx(Weighted()[1:], rel=1e-4)
    found = upper(LOW, {v: exponential(LOW, v) for v in (1.5, 1.525)}, goals)
    assert found.rate == pytest.approx(10.0, rel=0.05)
    with pytest.raises(InputError, match="2 voltages above"):
        upper(LOW, {}, {1.8: 100.0})


def hurried(monkeypatch: pytest.MonkeyPatch) -> None:
    """Least squares that may look only once."""
    from scipy import optimize

    real = optimize.least_squares
    monkeypatch.setattr(optimize, "least_squares", lambda *a, **k: real(*a, **{**k, "max_nfev": 1}))


def test_a_search_that_does_not_settle_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    hurried(monkeypatch)
    with pytest.warns(ConvergenceWarning, match="static gain"):
        nonlinear(VOLTS, RISE)
    with pytest.warns(ConvergenceWarning, match="upper gain"):
        upper(LOW, {1.5: 57.0}, {1.7: 95.0, 1.8: 180.0})


def test_as_many_points_as_a_fit_needs_are_enough() -> None:
    """Three for the line, whose interval has one degree of freedom, and four for the curve."""
    found = linearise(VOLTS[:3], RISE[:3], 83.0)
    x, y = VOLTS[1:3] - 1.5, -np.log(1.0 - (RISE[1:3] - 57.5) / 25.5)
    a = (x * y).sum() / (x * x).sum()
    spread = np.sqrt(((y - a * x) ** 2).sum() / (x * x).sum())
    reach = student.ppf(0.975, 1) * spread
    np.testing.assert_allclose(found.interval[1], [a - reach, a + reach])
    truth = Exponential(25.5, 37.86, 1.5, 57.66)
    assert nonlinear(VOLTS[:4], [exponential(truth, v) for v in VOLTS[:4]]).model == pytest.approx(
        truth, rel=1e-4
    )
    for fit, count in ((linearise, 2), (nonlinear, 3)):
        with pytest.raises(InputError, match=f"number {count} and.*{count + 1} or more"):
            fit(VOLTS[:count], RISE[:count])


def test_one_temperature_a_voltage() -> None:
    for fit in (linearise, nonlinear):
        with pytest.raises(InputError, match=r"number 5 and 4\. Give .* pairs"):
            fit(VOLTS, RISE[:4])
