"""The PI with anti-windup as a stage's law."""

import math

import pytest

from macromicro.control import pi
from macromicro.control.pi import PiAntiWindup
from macromicro.control.stage_law import Sample, Target
from macromicro.control.stage_pi import LAW, Memory

P = PiAntiWindup(kp=2000.0, ki=500.0, kaw=10.0, low=0.5, high=8.0)
GOAL = Target(2e-3, 1.0, 3.0)


def test_it_is_the_pi_of_figure_5_24():
    s = LAW.start(P, Sample(0.0, 1e-3))
    assert s == Memory(0.5)
    for k in range(5):
        s, effort = LAW.step(P, s, GOAL, Sample(0.01 * k, 1e-3), 0.01)
    integral = 0.5
    for _ in range(5):
        integral, expected = pi.step(P, integral, 1e-3, 0.01)
    assert (s.integral, effort) == (integral, expected)
    assert 2.5 < effort < 3.0


def test_it_stays_within_its_limits():
    _, high = LAW.step(P, Memory(20.0), GOAL, Sample(0.0, 0.0), 0.01)
    _, low = LAW.step(P, Memory(0.0), GOAL, Sample(0.0, 5e-3), 0.01)
    assert (low, high) == (0.5, 8.0)


def test_without_a_reading_the_integral_drives_alone():
    s, effort = LAW.step(P, Memory(3.0), GOAL, Sample(0.0, math.nan), 0.01)
    assert effort == 3.0
    assert s.integral == pytest.approx(3.0)
