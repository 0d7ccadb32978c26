"""The PI of a stage: feed-forward, limits at which the integral waits."""

import math

import pytest

from macromicro.control.stage_law import Sample, Target
from macromicro.control.stage_pi import LAW, Memory, StagePi

P = StagePi(kp=2000.0, ki=500.0, ahead_velocity=0.5, low=0.5, high=8.0)
GOAL = Target(2e-3, 1.0, 3.0)


def test_it_adds_error_integral_and_speed():
    """2 V of 1 mm, 0.5 V of 1 m/s, and an integral that grows by 0.5 V/s from its lower limit."""
    s = LAW.start(P, Sample(0.0, 1e-3))
    assert s == Memory(0.5)
    for k in range(5):
        s, effort = LAW.step(P, s, GOAL, Sample(0.01 * k, 1e-3), 0.01)
    assert s.integral == pytest.approx(0.5 + 5 * 0.01 * 500.0 * 1e-3)
    assert effort == pytest.approx(2.0 + 0.5 + 0.5 + 4 * 0.005)


def test_it_stays_within_its_limits():
    _, high = LAW.step(P, Memory(20.0), GOAL, Sample(0.0, 0.0), 0.01)
    _, low = LAW.step(P, Memory(0.0), GOAL, Sample(0.0, 5e-3), 0.01)
    assert (low, high) == (0.5, 8.0)


@pytest.mark.parametrize("place", [-5e-3, 9e-3])
def test_behind_a_limit_the_integral_waits(place):
    s, _ = LAW.step(P, Memory(3.0), GOAL, Sample(0.0, place), 0.01)
    assert s.integral == 3.0


@pytest.mark.parametrize(("speed", "place", "limit"), [(20.0, 2.1e-3, 8.0), (-20.0, 1.9e-3, 0.5)])
def test_an_error_that_leads_off_a_limit_counts(speed, place, limit):
    s, effort = LAW.step(P, Memory(3.0), Target(2e-3, speed, 0.0), Sample(0.0, place), 0.01)
    assert effort == limit
    assert s.integral == pytest.approx(3.0 + 0.01 * 500.0 * (2e-3 - place))


def test_the_integral_stays_within_the_limits():
    s, _ = LAW.step(P, Memory(8.0), Target(0.0, 0.0, 0.0), Sample(0.0, -1e-6), 1e3)
    assert s.integral == 8.0
    s, _ = LAW.step(P, Memory(0.5), Target(0.0, 0.0, 0.0), Sample(0.0, 1e-6), 1e3)
    assert s.integral == 0.5


def test_without_a_reading_integral_and_speed_drive_alone():
    s, effort = LAW.step(P, Memory(3.0), GOAL, Sample(0.0, math.nan), 0.01)
    assert effort == 3.5
    assert s.integral == pytest.approx(3.0)
