"""What a linear fit is judged by, against textbook formulas."""

from __future__ import annotations

import inspect
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import dlsim
from scipy.stats import chi2, t

from macromicro.identify.linear import (
    LinearFit,
    Whiteness,
    box_jenkins,
    gls,
    least_squares,
    mls,
    output_error,
    sriv,
    whiteness,
)
from macromicro.identify.records import fit_percent as percent

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
    count = len(a) + len(b)
    return LinearFit(
        "sriv", np.array(a), np.array(b), 0.5, 1, covariance[:count, :count], (), (), 99.0, white
    )


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


def test_coverage_factors_are_students_by_the_stretches_that_tell() -> None:
    """Six stretches that tell alike have six degrees of freedom, one of them has one."""
    found = made([-0.75], [3.0])
    np.testing.assert_array_equal(found.factors, [[1.0, 1.0], [1.96, 1.96]])
    shares = np.zeros((6, 2, 2))
    shares[:, 0, 0] = 2.0
    shares[0, 1, 1] = 5.0
    known = replace(found, covariance=np.eye(2), shares=shares)
    np.testing.assert_allclose(known.factors[1], t.ppf(0.975, [6.0, 1.0]))
    slopes = np.array([[-12.0, 1.0]]) / 0.25  # of the gain by a and b
    weights = np.einsum("i,kij,j->k", slopes[0], shares, slopes[0]) ** 2
    degrees = weights.sum() ** 2 / (weights**2).sum()
    assert known.gain_factors[1] == pytest.approx(t.ppf(0.975, degrees))


def test_it_simulates_predicts_and_is_handed_to_other_packages() -> None:
    """A model with a delay of 2 against SciPy's own simulation of what it hands over."""
    found = replace(made([-0.75, 0.125], [3.0, 1.0]), delay=2)
    u = RNG.normal(size=50)
    system = found.to_scipy()
    assert system.dt == 0.5
    y = dlsim(system, u)[1][:, 0]
    np.testing.assert_allclose(found.simulate(u), y, atol=1e-12)
    np.testing.assert_allclose(found.predict(u, y), y, atol=1e-12)
    off = y + np.eye(1, 50, 10)[0]
    np.testing.assert_allclose((found.predict(u, off) - y)[10:13], [0.0, 0.75, -0.125], atol=1e-12)
    assert found.score(u, y) == pytest.approx(100.0) and found.score(u, -y) < 0.0


def test_it_is_handed_to_python_control() -> None:
    control = pytest.importorskip("control")
    found = replace(made([-0.75, 0.125], [3.0]), delay=0)
    system = found.to_control()
    assert system.dt == 0.5 and control.dcgain(system) == pytest.approx(found.gain)


def test_methods_share_their_parameters() -> None:
    """Those that a decorator documents once."""
    plain = inspect.signature(gls).parameters
    names = [name for name in plain if name != "noise_order"]
    for method in (least_squares, mls, sriv, output_error, box_jenkins):
        own = inspect.signature(method)
        assert list(own.parameters) == names and own.return_annotation == "LinearFit"
        said = inspect.getdoc(method) or ""
        heads = [said.index(f"{title}\n---") for title in ("Parameters", "Returns", "Raises")]
        assert heads == sorted(heads) and said.index("Examples\n---") > heads[-1]
        described = re.findall(r"^([a-z, ]+) : ", said, re.MULTILINE)
        assert [name for row in described for name in row.split(", ")] == names
