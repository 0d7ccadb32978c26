"""P, PI and PI with back-calculated anti-windup: Section 5.3."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.control import pi
from macromicro.control.pi import Pi, PiAntiWindup, Proportional
from macromicro.nominal import FULL_SCALE, PERIOD

P = PiAntiWindup()
PLAIN = PiAntiWindup(*Pi())
errors = st.floats(-4e-3, 4e-3)
integrals = st.floats(-10.0, 10.0)


@given(errors, integrals)
def test_back_calculation(error: float, integral: float) -> None:
    """Figure 5.24: dI/dt = Ki e + Kaw (sat(u) - u), u = Kp e + I; Kp 3 V/mm, Ki 30 V/(mm s),
    Kaw 30 1/s."""
    after, given_ = pi.step(P, integral, error, 1e-3)
    u = 3e3 * error + integral
    assert given_ == min(max(u, 1.3), 1.9)
    assert after == pytest.approx(integral + 1e-3 * (3e4 * error + 30.0 * (given_ - u)))


@given(errors, integrals)
def test_effort_stays_within_1_3_and_1_9_volts(error: float, integral: float) -> None:
    """Section 5.3.2: no response below 1.3 V, little change above 1.8 V."""
    assert 1.3 <= pi.step(P, integral, error, 1e-3)[1] <= 1.9


def test_anti_windup_holds_the_integral_at_the_saturation() -> None:
    """Section 5.3.2: the integral effort settles at sat - Kp e + e Ki / Kaw, within 0.2 s."""
    integral = 0.0
    for _ in range(300):
        integral, given_ = pi.step(P, integral, -2e-3, 1e-3)
    assert given_ == 1.3
    assert integral == pytest.approx(1.3 + 6.0 - 2.0, rel=1e-3)
    integral, start = 0.0, 0.0
    for _ in range(33):  # one time constant, 1 / Kaw
        integral, _ = pi.step(P, integral, -2e-3, 1e-3)
    assert (integral - start) / 5.3 == pytest.approx(1.0 - math.exp(-0.99), abs=0.02)


def test_plain_pi_winds_up_while_the_stage_extends() -> None:
    """Section 5.3.1, Figure 5.23: below 0 V the integral effort goes on falling."""
    integral = 0.0
    for _ in range(3000):
        integral, given_ = pi.step(PLAIN, integral, -1e-3, 1e-3)
    assert given_ == 0.0
    assert integral == pytest.approx(-2.25 * 3.0)


@given(errors, integrals)
def test_plain_pi_and_p_use_the_whole_0_to_5_volts(error: float, integral: float) -> None:
    """Section 5.3.1."""
    for law in (PLAIN, PiAntiWindup(*Proportional())):
        after, given_ = pi.step(law, integral, error, 1e-3)
        assert given_ == min(max(law.kp * error + integral, 0.0), 5.0)
        assert after == pytest.approx(integral + 1e-3 * law.ki * error)


def test_proportional_has_no_memory() -> None:
    """Section 5.3.1, Figure 5.19: Kp 3 V/mm."""
    law = PiAntiWindup(*Proportional())
    integral = 0.0
    for _ in range(100):
        integral, given_ = pi.step(law, integral, 0.5e-3, 1e-3)
    assert (integral, given_) == (0.0, 1.5)


def test_the_steepest_gain_that_may_be_set_and_what_follows_from_it() -> None:
    """The whole D/A range of 5 V at 5 um, half the band of 10 um; the integral gain adds as much
    in one period; back-calculation takes the whole excess away in one."""
    assert pytest.approx(FULL_SCALE / 5e-6) == pi.STEEPEST
    assert pytest.approx(pi.STEEPEST) == pi.QUICKEST * PERIOD
    swift = PiAntiWindup(kp=0.0, ki=0.0, kaw=pi.SWIFTEST)
    assert pi.step(swift, 4.0, 0.0, PERIOD) == (pytest.approx(1.9), 1.9)
