"""Static gain by the thesis' route and by non-linear least squares: (5.2)-(5.5)."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.errors import InputError
from macromicro.identify.heating import static_gain as nonlinear
from macromicro.models.weighted_gain import Exponential, Weighted, exponential, weighted
from macromicro.thesis.chapter5.actuator_models import asymptote, linearise, upper

VOLTS = (1.5, 1.525, 1.55, 1.575, 1.6)


def rises(p: Exponential) -> list[float]:
    return [exponential(p, v) for v in VOLTS]


@given(st.floats(10.0, 60.0), st.floats(15.0, 60.0), st.floats(20.0, 80.0))
def test_exact_points_give_the_curve_back(b: float, a: float, y0: float) -> None:
    p = Exponential(b, a, 1.5, y0)
    y = rises(p)
    for fit in (linearise(VOLTS, y), linearise(VOLTS, y, b + y0), nonlinear(VOLTS, y)):
        assert fit.model == pytest.approx(p, rel=1e-4)
        assert fit.asymptote == pytest.approx(b + y0, rel=1e-5)


def test_linearised_route_is_ill_conditioned() -> None:
    """(5.4): a logarithm near its asymptote. A kelvin of y_inf moves A by more than 10 %."""
    y = rises(Exponential())
    near, far = linearise(VOLTS, y, 83.0), linearise(VOLTS, y, 84.0)
    assert abs(near.model.a / far.model.a - 1.0) > 0.1


def test_intervals_cover_the_truth() -> None:
    """95 % intervals of the three parameters over noise of 0.2 K."""
    random = np.random.default_rng(0)
    truth = np.array([25.5, 37.86, 57.66])
    inside = np.zeros(3)
    for _ in range(100):
        fit = nonlinear(VOLTS, rises(Exponential()) + 0.2 * random.standard_normal(5))
        inside += (fit.interval[:, 0] < truth) & (truth < fit.interval[:, 1])
    assert np.all(inside >= 85)


def test_asymptote_by_shrinking_differences() -> None:
    """(5.3) for (5.5): 83.16 K."""
    assert asymptote(rises(Exponential())) == pytest.approx(83.16, abs=1e-6)
    with pytest.raises(InputError, match="shrink"):
        asymptote([1.0, 2.0, 3.0])


def test_printed_upper_gain_comes_back() -> None:
    """(5.7)-(5.8) from goals that the printed gain has."""
    low = Exponential(a=37.8631)
    goals = {v: weighted(Weighted(), v) for v in (1.65, 1.7, 1.8)}
    steady = {v: exponential(low, v) for v in VOLTS}
    made = upper(low, steady, goals)
    for v, goal in goals.items():
        assert weighted(made, v) == pytest.approx(goal, rel=0.02)
    for v, rise in steady.items():
        assert weighted(made, v) == pytest.approx(rise, abs=0.3)


def test_bad_points_are_refused() -> None:
    with pytest.raises(InputError, match="3 or more"):
        linearise((1.5, 1.6), (57.0, 82.0))
    with pytest.raises(InputError, match="all different"):
        nonlinear((1.5, 1.5, 1.6, 1.7), (1.0, 2.0, 3.0, 4.0))
    with pytest.raises(InputError, match="rise with CTRL"):
        nonlinear(VOLTS, (60.0, 50.0, 70.0, 80.0, 90.0))
    with pytest.raises(InputError, match="more than all temperatures"):
        linearise(VOLTS, rises(Exponential()), 80.0)
    with pytest.raises(InputError, match="equal steps"):
        linearise((1.5, 1.52, 1.6), (57.0, 70.0, 82.0))
    with pytest.raises(InputError, match="2 voltages"):
        upper(Exponential(), {}, {1.7: 93.0})
