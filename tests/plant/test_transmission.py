"""Belt, screw, slack and waves along the way."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.plant import transmission
from macromicro.plant.transmission import Transmission


def test_the_motor_s_turn_per_way():
    assert Transmission(kind="belt", radius=0.01, gear=3.0).ratio == pytest.approx(300)
    screw = Transmission(kind="screw", lead=0.005, gear=2.0)
    assert screw.ratio == pytest.approx(2.0 * 2.0 * math.pi / 0.005)
    assert Transmission(kind="linear", gear=5.0).ratio == 1.0


@given(st.floats(-1.0, 1.0), st.floats(0.0, 1.0))
def test_slack_takes_half_of_itself_from_either_side(apart, slack):
    found = transmission.stretch(slack, apart)
    assert found == pytest.approx(math.copysign(max(abs(apart) - 0.5 * slack, 0.0), apart))


def test_a_wave_along_the_way():
    assert transmission.wave(3.0, 0.2, 0.05) == pytest.approx(3.0)
    assert transmission.wave(3.0, 0.2, 0.1) == pytest.approx(0.0, abs=1e-12)
    assert transmission.wave(3.0, 0.2, -0.05) == pytest.approx(-3.0)
