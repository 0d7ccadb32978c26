"""DC motor with inductance: (4.1) with the state and the back-EMF's sign corrected."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.plant import motor
from macromicro.plant.motor import Motor

P = Motor()
volts = st.floats(-20.0, 20.0)
speeds = st.floats(-1.0, 1.0)


def settle(u: float, v: float, steps: int, h: float) -> float:
    """Current after some steps from 0 A, at a fixed speed."""
    i = 0.0
    for _ in range(steps):
        a, b = motor.current_terms(P, i, u, h)
        i = a - b * v
    return i


@given(volts, speeds)
def test_steady_current_is_voltage_less_back_emf_over_resistance(u: float, v: float) -> None:
    """(4.1): R i = V - K_b omega."""
    omega = v / P.pulley
    expected = (u - P.constant * omega) / P.resistance
    assert settle(u, v, 400, 1e-3) == pytest.approx(expected, abs=1e-9)


def test_back_emf_opposes_the_motion() -> None:
    """(4.1), erratum 1: -K_b/L. Turning forwards lowers the current, backwards raises it."""
    _, b = motor.current_terms(P, 0.0, 10.0, 5e-5)
    assert b > 0.0
    still, forwards, backwards = (settle(10.0, v, 200, 1e-3) for v in (0.0, 0.2, -0.2))
    assert forwards < still < backwards


def test_current_rises_with_the_time_constant_l_over_r() -> None:
    """(4.1) at standstill: i = V/R (1 - exp(-t R/L)); backward Euler converges to it."""
    tau = P.inductance / P.resistance
    assert tau == pytest.approx(0.5e-3)
    for share in (0.5, 1.0, 3.0):
        exact = 12.0 / P.resistance * (1.0 - math.exp(-share))
        errors = [abs(settle(12.0, 0.0, n, share * tau / n) - exact) for n in (200, 400)]
        assert errors[0] < 0.005 * 12.0 / P.resistance
        assert errors[1] == pytest.approx(errors[0] / 2.0, rel=0.02)


@given(st.floats(1e-7, 1.0), st.floats(-3.0, 3.0), volts)
def test_current_never_overshoots_whatever_the_step(h: float, i: float, u: float) -> None:
    """Backward Euler: between the present and the steady current for any step."""
    a, _ = motor.current_terms(P, i, u, h)
    low, high = sorted((i, u / P.resistance))
    assert low - 1e-12 <= a <= high + 1e-12


@given(speeds, st.floats(-1.5, 1.5))
def test_mechanical_power_is_what_the_back_emf_takes(v: float, i: float) -> None:
    """One constant for torque and back-EMF: K_b omega i = force v, no energy from nothing."""
    assert motor.force(P, i) * v == pytest.approx(P.constant * v / P.pulley * i, abs=1e-12)
