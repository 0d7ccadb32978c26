"""A piezo's amplifier: range, codes, bandwidth and the current that charges the stack."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.plant import high_voltage
from macromicro.plant.high_voltage import HighVoltage

P = HighVoltage(bits=12, bandwidth=3000.0, current=0.06, capacitance=3e-6)
volts = st.floats(-20.0, 30.0)


@given(volts)
def test_converter_limits_and_rounds(v: float) -> None:
    lsb = 140.0 / 4096.0
    asked = high_voltage.convert(P, v)
    assert -20.0 <= asked <= 120.0
    assert abs(asked - min(max(10.0 * v, -20.0), 120.0)) <= 0.5 * lsb + 1e-12
    assert (asked + 20.0) / lsb == pytest.approx(round((asked + 20.0) / lsb), abs=1e-9)


@given(volts, volts)
def test_converter_is_monotone(a: float, b: float) -> None:
    low, high = sorted((a, b))
    assert high_voltage.convert(P, low) <= high_voltage.convert(P, high)


def test_small_steps_follow_with_the_bandwidth() -> None:
    """63 % after 1 / (2 pi 3 kHz), for one step or ten."""
    time = 1.0 / (2.0 * math.pi * 3000.0)
    goal = 1.0 - math.exp(-1.0)
    assert high_voltage.driven(P, 5.0, 5.5, time) == pytest.approx(5.0 + 0.5 * goal)
    v = 5.0
    for _ in range(10):
        v = high_voltage.driven(P, v, 5.5, 0.1 * time)
    assert v == pytest.approx(5.0 + 0.5 * goal)


@given(st.floats(-20.0, 120.0), st.floats(-20.0, 120.0), st.floats(1e-6, 1e-2))
def test_no_faster_than_the_current_charges_the_stack(v: float, asked: float, dt: float) -> None:
    """60 mA into 3 uF: 20 V/ms, both ways; never beyond what is asked."""
    after = high_voltage.driven(P, v, asked, dt)
    assert abs(after - v) <= 20e3 * dt * (1.0 + 1e-9) + 1e-12
    assert min(v, asked) - 1e-12 <= after <= max(v, asked) + 1e-12


def test_large_steps_are_ramps() -> None:
    assert high_voltage.driven(P, 0.0, 100.0, 1e-3) == pytest.approx(20.0)
    assert high_voltage.driven(P, 100.0, 0.0, 1e-3) == pytest.approx(80.0)
