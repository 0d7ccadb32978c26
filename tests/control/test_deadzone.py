"""Dead-zone inverse: Section 4.2.3, Figure 4.9."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from macromicro.control import deadzone

efforts = st.floats(-10.0, 10.0)
widths = st.floats(0.0, 5.0)


@given(widths, efforts)
def test_undoes_a_dead_zone(width: float, effort: float) -> None:
    """Figure 4.9: dead zone after inverse gives the effort back."""
    lifted = deadzone.inverse(width, effort)
    through = lifted - width if lifted > width else lifted + width if lifted < -width else 0.0
    assert abs(through - effort) <= 1e-14


@given(widths, efforts)
def test_is_odd_and_leaves_zero_alone(width: float, effort: float) -> None:
    assert deadzone.inverse(width, -effort) == -deadzone.inverse(width, effort)
    assert deadzone.inverse(width, 0.0) == 0.0


@given(widths, efforts, efforts)
def test_is_monotone(width: float, a: float, b: float) -> None:
    low, high = sorted((a, b))
    assert deadzone.inverse(width, low) <= deadzone.inverse(width, high)
