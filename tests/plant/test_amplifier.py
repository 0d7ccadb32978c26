"""D/A board and PWM amplifier: Sections 3.1 and 3.2.1."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.plant import amplifier
from macromicro.plant.amplifier import Amplifier

P = Amplifier()
LSB = 10.0 / 4096.0
volts = st.floats(-8.0, 8.0)


@given(volts)
def test_output_is_a_code_within_half_a_code_of_the_saturated_command(u: float) -> None:
    """Sections 3.1, 3.3: 12 bits over +-5 V."""
    out = amplifier.convert(P, u)
    assert -5.0 <= out <= 5.0
    assert (out / LSB) == round(out / LSB)
    assert abs(out - min(max(u, -5.0), 5.0)) <= LSB / 2


@given(volts, volts)
def test_conversion_is_monotone(a: float, b: float) -> None:
    """Section 3.1."""
    low, high = sorted((a, b))
    assert amplifier.convert(P, low) <= amplifier.convert(P, high)


@given(volts)
def test_conversion_is_odd_within_one_code(u: float) -> None:
    """Section 3.1: the motor sees the same voltage in both directions."""
    assert abs(amplifier.convert(P, u) + amplifier.convert(P, -u)) <= LSB


def test_all_codes_occur_and_the_ends_are_reached() -> None:
    """12 bits: 4096 steps over both signs, the upper end included as full scale."""
    codes = {amplifier.convert(P, -5.0 + k * LSB) for k in range(4097)}
    assert len(codes) == 4097
    assert amplifier.convert(P, 5.0) == 5.0
    assert amplifier.convert(P, -5.0) == -5.0
    assert amplifier.convert(P, 0.0) == 0.0


@pytest.mark.parametrize(("u", "share"), [(0.0, 0.0), (2.5, 0.5), (5.0, 1.0), (-5.0, -1.0)])
def test_motor_map_is_0_to_100_percent_of_20_volts(u: float, share: float) -> None:
    """Section 3.1: 20 V at a duty of 0-100 % for 0-5 V."""
    assert amplifier.duty(P, u, P.motor_duty) == pytest.approx(share)
    assert amplifier.motor_volts(P, u, 0.7) == pytest.approx(20.0 * share)


@given(st.floats(0.0, 5.0))
def test_ctrl_map_is_0_to_20_percent_and_reads_as_the_thesis_d_a_volts(u: float) -> None:
    """Section 3.2.1: 20 V at a duty of 0-20 % for 0-5 V, a mean of 0-4 V."""
    assert amplifier.duty(P, u, P.ctrl_duty) == pytest.approx(0.04 * u)
    assert 20.0 * amplifier.duty(P, u, P.ctrl_duty) <= 4.0 + 1e-12
    assert amplifier.ctrl_level(P, u) == pytest.approx(u)


def test_a_wider_ctrl_map_reaches_the_driver_as_more_volts() -> None:
    """Section 3.2.1: the driver sees the mean PWM voltage, not the number at the D/A."""
    wide = P._replace(ctrl_duty=0.4)
    assert amplifier.ctrl_level(wide, 1.5) == pytest.approx(3.0)
