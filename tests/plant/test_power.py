"""Amplifier and motor: both modes against the circuit's own laws."""

import math

import pytest

from macromicro.plant import power
from macromicro.plant.power import Amplifier, Motor

MOTOR = Motor(resistance=2.0, inductance=4e-3)
VOLTAGE = power.prepare(
    Amplifier(supply=24.0, current=5.0, full_scale=10.0, bits=24, gain=2.0), MOTOR, 3.0, 0.8
)
CURRENT = power.prepare(
    Amplifier(
        mode="current",
        supply=24.0,
        current=5.0,
        full_scale=10.0,
        bits=24,
        transconductance=0.5,
        bandwidth=200.0,
    ),
    MOTOR,
    3.0,
    0.8,
)


def course(p, effort, v, t, h=1e-6):
    i = 0.0
    for _ in range(round(t / h)):
        a, b = power.current_terms(p, i, effort, v, h)
        i = a - b * v
    return i


def test_a_voltage_drives_the_current_through_winding_and_back_emf():
    # V = 2 * 3 = 6 V, back-EMF 3 * 0.5 = 1.5 V, 2 ohm, 4 mH: 2.25 A with 2 ms.
    for t in (1e-3, 2e-3, 2e-2):
        truth = 2.25 * (1.0 - math.exp(-t / 2e-3))
        assert course(VOLTAGE, 3.0, 0.5, t) == pytest.approx(truth, rel=2e-3)
    assert VOLTAGE.push == pytest.approx(2.4) and VOLTAGE.emf == 3.0


def test_the_new_speed_counts_within_the_step():
    a, b = power.current_terms(VOLTAGE, 0.7, 3.0, 0.0, 1e-4)
    whole = 1.0 + 1e-4 * 2.0 / 4e-3
    assert a == pytest.approx((0.7 + 1e-4 * 6.0 / 4e-3) / whole, rel=1e-6)
    assert b == pytest.approx(1e-4 * 3.0 / 4e-3 / whole)


def test_a_current_follows_its_set_point_by_a_lag_of_its_bandwidth():
    pole = 2.0 * math.pi * 200.0
    for t in (5e-4, 2e-3, 2e-2):
        truth = 2.0 * (1.0 - math.exp(-pole * t))
        assert course(CURRENT, 4.0, 0.5, t) == pytest.approx(truth, rel=2e-3)
        assert course(CURRENT, -4.0, 0.5, t) == pytest.approx(-truth, rel=2e-3)


def test_the_supply_bounds_the_voltage_in_both_modes():
    # At 7 m/s the back-EMF is 21 V: 3 V are left, 1.5 A at most.
    assert course(CURRENT, 8.0, 7.0, 0.05) == pytest.approx(1.5, rel=1e-3)
    high = VOLTAGE._replace(gain=9.0)
    assert course(high, 10.0, 7.0, 0.05) == pytest.approx(1.5, rel=1e-3)
    assert course(high, -10.0, -7.0, 0.05) == pytest.approx(-1.5, rel=1e-3)


def test_the_amplifier_bounds_the_current_in_both_modes():
    assert course(CURRENT._replace(gain=1.0), 9.0, 0.0, 0.05) == pytest.approx(5.0, rel=1e-6)
    assert course(CURRENT._replace(gain=1.0), -9.0, 0.0, 0.05) == pytest.approx(-5.0, rel=1e-6)
    for effort in (10.0, -10.0):
        assert course(VOLTAGE, effort, 0.0, 0.05) == math.copysign(5.0, effort)


def test_the_d_a_rounds_to_its_codes():
    coarse = VOLTAGE._replace(dac=VOLTAGE.dac._replace(bits=6.0))  # 0.3125 V a code
    for effort, code in ((0.1, 0.0), (0.2, 0.3125), (-0.2, -0.3125)):
        a, _ = power.current_terms(coarse, 0.0, effort, 0.0, 1.0)
        assert a == pytest.approx(code * 2.0 / (2.0 + 4e-3), rel=1e-9)
