"""A position sensor's reading."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.plant import gauge
from macromicro.plant.gauge import Gauge

LSB = 2e-9
P = Gauge(noise=1e-9, low=-10e-6, high=110e-6, pitch=LSB)


@given(st.floats(-50e-6, 150e-6), st.floats(-4.0, 4.0))
def test_reading_is_the_position_with_noise_to_a_step_within_the_range(
    x: float, draw: float
) -> None:
    shown = gauge.reading(P, x, draw)
    assert -10e-6 <= shown <= 110e-6
    assert abs(shown - min(max(x + draw * 1e-9, -10e-6), 110e-6)) <= 0.5 * LSB + 1e-15
    assert shown / LSB == pytest.approx(round(shown / LSB), abs=1e-6)


def test_steps_are_counted_from_zero() -> None:
    assert gauge.reading(P, 0.49 * LSB, 0.0) == 0.0
    assert gauge.reading(P, 0.51 * LSB, 0.0) == LSB
    assert gauge.reading(P, 0.0, 5.0) == pytest.approx(5e-9, abs=LSB)
