"""The notch: its gain where it should be, at any period."""

import cmath
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.control import notch
from macromicro.control.notch import Delays, Notch


def gain(p, frequency, dt):
    """Complex gain of the difference equation at a frequency, from its impulse response."""
    s, out = Delays(0.0, 0.0), []
    for k in range(20000):
        s, y = notch.step(p, s, 1.0 if k == 0 else 0.0, dt)
        out.append(y)
        if k > 200 and max(map(abs, out[-50:])) < 1e-14:
            break
    z = cmath.exp(-2j * math.pi * frequency * dt)
    return complex(np.polyval(out[::-1], z))


@given(
    st.floats(20.0, 300.0), st.floats(0.0, 1.0), st.floats(0.1, 1.0), st.sampled_from([1e-3, 2e-4])
)
def test_at_its_middle_the_depth_passes_and_all_at_rest(frequency, depth, width, dt):
    p = Notch(frequency, depth, width)
    assert abs(gain(p, frequency, dt)) == pytest.approx(depth, abs=1e-6)
    assert gain(p, 0.0, dt) == pytest.approx(1.0, abs=1e-6)


def test_its_width_is_that_of_the_continuous_filter():
    p, dt = Notch(50.0, 0.2, 0.4), 1e-5
    for frequency in (30.0, 45.0, 80.0):
        s, w = 2j * math.pi * frequency, 2.0 * math.pi * p.frequency
        wide = 2.0 * p.width * w * s
        law = (s * s + p.depth * wide + w * w) / (s * s + wide + w * w)
        assert gain(p, frequency, dt) == pytest.approx(law, abs=2e-3)


@pytest.mark.parametrize("frequency", [0.0, 500.0, 900.0])
def test_without_a_notch_all_passes(frequency):
    s, out = notch.step(Notch(frequency), Delays(3.0, 4.0), 1.5, 1e-3)
    assert out == 1.5 and s == Delays(0.0, 0.0)
