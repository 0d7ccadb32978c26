"""What a linear fit is judged by, against textbook formulas."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import chi2

from macromicro.identify.linear_fit import LinearFit, Whiteness, percent, whiteness, withheld

RNG = np.random.default_rng(3)


def ljung_box(residuals: list[np.ndarray], lags: int) -> tuple[np.ndarray, float]:
    """r_k and Q = n (n + 2) sum r_k^2 / (n - k), each record's own products."""
    n, power = sum(map(len, residuals)), sum(float((e**2).sum()) for e in residuals)
    r = np.array([
        sum(float(np.sum(e[k:] * e[: len(e) - k])) for e in residuals) / power
        for k in range(1, lags + 1)
    ])  # fmt: skip
    return r, n * (n + 2) * sum(r[k - 1] ** 2 / (n - k) for k in range(1, lags + 1))


@pytest.mark.parametrize(
    ("lengths", "parameters", "lags", "freedom"),
    [
        ((300, 250), 2, 20, 18),
        ((300, 62), 2, 15, 13),  # a quarter of the shortest record
        ((19,), 2, 4, 2),
        ((19,), 3, 4, 1),
        ((19,), 6, 4, 1),  # one degree of freedom at least
        ((3,), 0, 1, 1),  # and one lag
    ],
)
@pytest.mark.parametrize("size", [1e-4, 1.0])
def test_whiteness_is_the_ljung_box_test(
    lengths: tuple[int, ...], parameters: int, lags: int, freedom: int, size: float
) -> None:
    residuals = [size * RNG.normal(size=n) for n in lengths]
    found = whiteness(tuple(residuals), parameters)
    r, q = ljung_box(residuals, lags)
    np.testing.assert_allclose(found.autocorrelation, r)
    assert found.statistic == pytest.approx(q)
    assert found.p_value == pytest.approx(chi2.sf(q, freedom))
    assert found.white == (found.p_value >= 0.01)


def test_the_number_of_lags_can_be_told() -> None:
    residuals = (RNG.normal(size=300),)
    assert len(whiteness(residuals, 1).autocorrelation) == 20
    found = whiteness(residuals, 1, lags=7)
    assert found.statistic == pytest.approx(ljung_box(list(residuals), 7)[1])


def test_no_residuals_at_all_are_white() -> None:
    found = whiteness((np.zeros(12), np.zeros(40)), 2)
    assert (found.statistic, found.p_value, found.white) == (0.0, 1.0, True)
    assert found.autocorrelation.tolist() == [0.0, 0.0, 0.0]


def test_the_fit_in_percent_is_the_share_of_the_spread_that_is_met() -> None:
    """Each record about its own mean, whatever the unit; nothing to meet is no number."""
    y = [1e-3 * np.array([1.0, -1.0, 1.0, -1.0]), 5.0 + 1e-3 * np.array([2.0, -2.0])]
    runs = (0.75 * y[0], 5.0 + 0.75 * (y[1] - 5.0))
    assert percent(y, runs) == pytest.approx(75.0)
    assert percent(y, tuple(y)) == 100.0
    assert math.isnan(percent([np.full(4, 3.0)], (np.zeros(4),)))


def made(a: list[float], b: list[float]) -> LinearFit:
    white = Whiteness(np.zeros(1), 0.0, 1.0, True)
    covariance = np.array([[4.0, 1.0, 0.5], [1.0, 9.0, -1.0], [0.5, -1.0, 16.0]])
    return LinearFit("sriv", np.array(a), np.array(b), 0.5, 1, covariance, (), (), 99.0, white)


def test_a_fit_of_one_pass_has_no_noise_model() -> None:
    found = made([-0.5, 0.5], [3.0])
    assert found.iterations == 1 and found.converged and len(found.noise) == 0


def test_static_gain_and_its_error() -> None:
    """sum(b) / (1 + sum(a)), (4.6); its error by its slopes: -gain, -gain and 1 over 1 + sum(a)."""
    assert made([-0.5, 0.5], [3.0]).gain == 3.0  # the a may add up to nothing
    found = made([-0.75, 0.25], [3.0])
    assert found.gain == pytest.approx(6.0)
    slope = np.array([-6.0, -6.0, 1.0]) / 0.5
    assert found.gain_std == pytest.approx(np.sqrt(slope @ found.covariance @ slope))
    assert made([-1.25, 0.25], [3.0]).gain == math.inf
    np.testing.assert_array_equal(found.std, [2.0, 3.0, 4.0])


def test_poles_in_z_and_in_s() -> None:
    """z^2 - 0.75 z + 0.125 = (z - 0.5) (z - 0.25), held for half a second."""
    found = made([-0.75, 0.125], [3.0])
    assert sorted(found.poles.real) == pytest.approx([0.25, 0.5])
    assert sorted(found.continuous_poles.real) == pytest.approx(
        [math.log(0.25) / 0.5, math.log(0.5) / 0.5]
    )


def test_it_says_its_numbers_with_their_errors() -> None:
    assert str(made([-0.75, 0.125], [3.0])) == (
        "sriv: a1 -0.75 +- 2, a2 0.125 +- 3, b1 3 +- 4; fit 99.00 %, residuals white"
    )


def test_coverage_factors_are_those_of_the_draws() -> None:
    """Errors of a and b that go with the phase of one harmonic: 95 % within 1.41 standard errors,
    and of the gain's, to which a and b add up, too; without draws they are normal."""
    phase = 2.0 * np.pi * (np.arange(400) + 0.5) / 400
    draws = np.column_stack([0.01 * np.sin(phase), np.cos(phase)])
    one = np.zeros(1)
    fit = LinearFit(
        "sriv", np.array([-0.9]), np.array([2.0]), 1.0, 1, draws.T @ draws / 400, (one,), (one,),
        99.0, Whiteness(one, 0.0, 1.0, True), draws=draws,
    )  # fmt: skip
    low, high = np.sqrt(2.0) * np.sin(0.5 * np.pi * np.array([0.6827, 0.95]))
    np.testing.assert_allclose(fit.factors, [[low, low], [high, high]], rtol=0.01)
    np.testing.assert_allclose(fit.gain_factors, [low, high], rtol=0.01)
    assert fit.gain_std == pytest.approx(math.hypot(20.0 * 0.01, 1.0) / 0.1 / math.sqrt(2.0))
    without = withheld(fit, "of no use")
    assert without.draws is None and np.isnan(without.gain_std)
    np.testing.assert_array_equal(without.factors[1], [1.96, 1.96])
