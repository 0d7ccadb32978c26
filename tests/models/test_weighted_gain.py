"""Static gain: (5.5) and (5.7)-(5.8) as printed."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.kernel import compiled
from macromicro.models.weighted_gain import Exponential, Weighted, exponential, weighted


@pytest.mark.parametrize(
    ("volts", "rise"), [(1.5, 57.67), (1.6, 82.72), (1.7, 93.45), (1.8, 139.1)]
)
def test_printed_gain(volts: float, rise: float) -> None:
    """Claim S9, (5.7)-(5.8)."""
    assert weighted(Weighted(), volts) == pytest.approx(rise, abs=0.1)


def test_runaway_and_silence_of_the_printed_gain() -> None:
    """(5.8) gives 239 K at 1.9 V, and nothing below 1.469 V but the upper curve's rest."""
    assert weighted(Weighted(), 1.9) == pytest.approx(239.0, abs=0.5)
    assert weighted(Weighted(), 1.46) < 0.01


@given(st.floats(0.0, 5.0))
def test_gain_stays_at_or_above_zero(volts: float) -> None:
    """Claim S9: at or above 0; interpreted and compiled agree."""
    value = weighted(Weighted(), volts)
    assert value >= 0.0
    assert math.isclose(value, compiled(weighted)(Weighted(), volts), rel_tol=1e-12)


def test_asymptote() -> None:
    """(5.3): b + y0."""
    assert exponential(Exponential(), 3.0) == pytest.approx(25.5 + 57.66)
