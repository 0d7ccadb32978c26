"""Encoder, its 24-bit counter and the A/D converter: Sections 3.1, 3.2.3, 3.3."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.plant import encoder
from macromicro.plant.encoder import Converter, Encoder

P = Encoder()
AD = Converter()
places = st.floats(-100.0, 100.0)


@given(places, places)
def test_count_is_monotone_in_position(a: float, b: float) -> None:
    """Chapter 4 (M16), within the counter's range."""
    low, high = sorted((a, b))
    assert encoder.count(P, low) <= encoder.count(P, high)


@given(st.integers(-100000, 100000))
def test_every_pitch_is_one_count_and_the_edge_belongs_to_the_upper(n: int) -> None:
    """2800 counts are 200 mm; whole numbers, with a sign."""
    assert encoder.count(P, n * P.pitch) == n
    assert encoder.count(P, (n + 0.5) * P.pitch) == n
    assert encoder.count(P, (n - 0.01) * P.pitch) == n - 1


def test_full_travel_is_2800_counts() -> None:
    """M16."""
    assert encoder.count(P, 0.2) == 2800.0
    assert encoder.count(P, -0.2) == -2800.0


@given(st.integers(-(2**26), 2**26))
def test_counter_wraps_at_24_bits_with_a_sign(n: int) -> None:
    """Section 3.3: 24 bits, two's complement."""
    unit = P._replace(pitch=1.0)
    shown = encoder.count(unit, n + 0.5)
    assert -(2**23) <= shown < 2**23
    assert (n - shown) % 2**24 == 0


@given(st.floats(-8.0, 8.0))
def test_converter_rounds_to_1_22_mv_and_clips(volts: float) -> None:
    """Section 3.2.3: 12 bits and a sign over 0-5 V."""
    lsb = 5.0 / 4096.0
    assert lsb == pytest.approx(1.22e-3, rel=0.005)
    shown = encoder.sample(AD, volts)
    assert shown / lsb == round(shown / lsb)
    assert -5.0 <= shown <= 5.0 - lsb
    if -5.0 <= volts <= 5.0 - lsb:
        assert abs(shown - volts) <= lsb / 2 + 1e-15


@given(st.floats(-8.0, 8.0), st.floats(-8.0, 8.0))
def test_converter_is_monotone(a: float, b: float) -> None:
    """Section 3.2.3."""
    low, high = sorted((a, b))
    assert encoder.sample(AD, low) <= encoder.sample(AD, high)
