"""(5.7)-(5.8) made whole at both ends, and (5.6), as kernels for the guard."""

from __future__ import annotations

import math

import numpy as np
import pytest

from macromicro.models import electrothermal
from macromicro.models.electrothermal import FIRST_RESPONSE, gain
from macromicro.models.weighted_gain import weighted


def test_foot_is_a_straight_line_from_the_first_response_to_1_5_volts() -> None:
    """Section 5.3.2 tells of a response from 1.3 V on, where (5.8) is still zero."""
    for ctrl, share in ((1.3, 0.0), (1.35, 0.25), (1.4, 0.5), (1.45, 0.75)):
        assert gain(ctrl, 1e6) == pytest.approx(57.66 * share), ctrl
    assert gain(FIRST_RESPONSE - 0.2, 1e6) == 0.0
    near = 1.4999
    foot = 57.66 * (near - 1.3) / 0.2
    assert gain(near, 1e6) == pytest.approx(max(weighted(electrothermal.PRINTED, near), foot))


def test_printed_above_the_foot_up_to_the_ceiling() -> None:
    for ctrl, printed in ((1.5, 57.67), (1.6, 82.72), (1.7, 93.45), (1.8, 139.1)):
        assert gain(ctrl, 1e6) == pytest.approx(printed, abs=0.1)
    assert gain(1.8, 100.0) == 100.0
    assert gain(1.45, 30.0) == 30.0
    assert gain(3.0, 1e6) == 1e6
    assert gain(3.0, 250.0) == 250.0


def test_heating_is_the_printed_transfer_function() -> None:
    """(5.6): from cold to its DC gain, and at first by its highest coefficient."""
    s = electrothermal.Heating(0.0, 0.0, 0.0)
    s = electrothermal.step(s, 10.0, 1e-4)
    assert electrothermal.temperature(s) == pytest.approx(1.001 * 10.0 * 1e-4, rel=1e-3)
    for _ in range(200_000):
        s = electrothermal.step(s, 10.0, 5e-3)
    assert electrothermal.temperature(s) == pytest.approx(10.0 * 0.001552 / 0.001537, rel=1e-4)
    assert math.isfinite(s.s2)


def test_the_step_response_is_that_of_the_printed_coefficients() -> None:
    """(5.6) by its partial fractions, from the first tenths of a second to the slow rise."""
    poles = np.roots([1.0, 1.491, 0.1604, 0.001537])
    s, t = electrothermal.Heating(0.0, 0.0, 0.0), 0.0
    for until in (0.3, 3.0, 30.0, 100.0):
        while t < until - 1e-9:
            s, t = electrothermal.step(s, 10.0, 1e-3), t + 1e-3
        wanted = 10.0 * 0.001552 / 0.001537
        for r in poles:
            others = np.prod([r - o for o in poles if o != r])
            numerator = 1.001 * r * r + 0.1483 * r + 0.001552
            wanted += 10.0 * float(numerator / (r * others) * np.exp(r * until))
        assert electrothermal.temperature(s) == pytest.approx(wanted, rel=2e-3)


def test_a_step_leaves_the_equation_of_the_canonical_form() -> None:
    """s2' + D2 s2 + D1 s1 + D0 s0 = T_d; s1' = s2 and s0' = s1 with the new values."""
    s, dt = electrothermal.Heating(300.0, 20.0, 3.0), 0.01
    new = electrothermal.step(s, 50.0, dt)
    assert (new.s2 - 3.0) / dt + 1.491 * 3.0 + 0.1604 * 20.0 + 0.001537 * 300.0 == pytest.approx(50)
    assert (new.s1 - 20.0) / dt == pytest.approx(new.s2)
    assert (new.s0 - 300.0) / dt == pytest.approx(new.s1)
    assert electrothermal.temperature(s) == pytest.approx(1.001 * 3 + 0.1483 * 20 + 0.001552 * 300)


@pytest.mark.parametrize("ctrl", [2.19, 2.2, 2.21])
def test_from_2_2_volts_on_the_ceiling_holds(ctrl: float) -> None:
    """Wherever (5.8) runs away to, up or down."""
    high = 1e9
    found = gain(ctrl, high)
    assert found == (high if ctrl >= 2.2 else weighted(electrothermal.PRINTED, ctrl))
