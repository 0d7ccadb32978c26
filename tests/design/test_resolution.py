"""Resolution budget of Section 3.2.3."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.design import resolution
from macromicro.design.resolution import INCH
from macromicro.errors import InputError


def test_chain_of_the_thesis() -> None:
    """1.22 mV, 0.3904 G, 1.952 um (5.08 instead of 5 um/G) a bit: D2-D5."""
    b = resolution.budget(5.0, 12, 3.125e-3, 5000 / INCH)
    assert b.volts == pytest.approx(1.2207e-3, rel=1e-4)
    assert b.field == pytest.approx(0.390625)
    assert b.position == pytest.approx(0.390625 * 5.08e-6)


def test_calibrated_resolution() -> None:
    """0.8 um/mV and 1.22 mV/bit: 0.976 um/bit (D6)."""
    assert resolution.calibrated(1.22e-3, 0.8e-3) == pytest.approx(0.976e-6)


def test_sensitivity_floor() -> None:
    """4 V over +-650 G (D11)."""
    assert resolution.sensitivity_floor(4.0, 1300.0) == pytest.approx(3.0769e-3, rel=1e-4)


@given(st.floats(0.1, 20.0), st.integers(1, 23), st.floats(1e-4, 0.1), st.floats(1e3, 1e7))
def test_a_bit_more_halves_everything(
    span: float, bits: int, sensitivity: float, slope: float
) -> None:
    coarse = resolution.budget(span, bits, sensitivity, slope)
    fine = resolution.budget(span, bits + 1, sensitivity, slope)
    for a, b in zip(coarse, fine, strict=True):
        assert math.isclose(a, 2.0 * b, rel_tol=1e-12)


@pytest.mark.parametrize("bits", [0, -3, 65, 12.0, True])
def test_bits_are_a_whole_number(bits: int) -> None:
    with pytest.raises(InputError, match=r"resolution, bits.*1 to 64"):
        resolution.converter(5.0, bits)


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf])
def test_bad_numbers_are_refused(bad: float) -> None:
    with pytest.raises(InputError, match="span"):
        resolution.converter(bad, 12)
    with pytest.raises(InputError, match="sensitivity"):
        resolution.field(1e-3, bad)
    with pytest.raises(InputError, match="flux slope"):
        resolution.metres_per_gauss(bad)
    with pytest.raises(InputError, match="field span"):
        resolution.sensitivity_floor(4.0, bad)
    with pytest.raises(InputError, match="slope"):
        resolution.calibrated(1e-3, bad)
