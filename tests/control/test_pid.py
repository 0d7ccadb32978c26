"""Benchmark PID: Section 4.3.1."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.control import pid
from macromicro.control.pid import Pid, PidMemory
from macromicro.nominal import FULL_SCALE, PERIOD

P = Pid()
errors = st.floats(-3000.0, 3000.0)


@given(errors, errors, st.floats(-5.0, 5.0))
def test_effort_is_p_plus_i_plus_d(error: float, before: float, integral: float) -> None:
    """Section 4.3.1: 0.02, 0.007, 0.0025 on the error in counts, at 1000 Hz."""
    after, effort = pid.step(P, PidMemory(integral, before), error, 1e-3)
    assert after == pytest.approx((integral + 0.007e-3 * error, error))
    assert effort == pytest.approx(0.02 * error + after.integral + 2.5 * (error - before))


def test_integral_effort_ramps_while_the_carriage_sticks() -> None:
    """Section 4.3.1 (M9): 100 counts of error add 0.7 V a second, without bound."""
    memory = pid.start(100.0)
    assert memory == PidMemory(0.0, 100.0)
    for _ in range(20000):
        memory, effort = pid.step(P, memory, 100.0, 1e-3)
    assert memory.integral == pytest.approx(14.0)
    assert effort == pytest.approx(16.0)


def test_the_steepest_gains_that_may_be_set() -> None:
    """Twenty times what makes the D/A's full scale of one count, or of a count gained in 1 ms;
    of the integral what adds as much in a period."""
    assert pytest.approx(20.0 * FULL_SCALE) == pid.STEEPEST
    assert pytest.approx(20.0 * FULL_SCALE * PERIOD) == pid.SHARPEST
    assert pytest.approx(pid.STEEPEST) == pid.QUICKEST * PERIOD
