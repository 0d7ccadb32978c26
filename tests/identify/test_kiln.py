"""First-order curves cut out of a kiln's profile (Section 5.2.1)."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.identify.kiln import LEAST_LEG, Profile, first_order_curves


def profile(*turns: float) -> Profile:
    """Straight lines between temperatures, a position that follows them."""
    parts = [np.linspace(a, b, 400, endpoint=False) for a, b in pairwise(turns)]
    u = np.concatenate([*parts, [turns[-1]]])
    return Profile(np.arange(len(u)) * 0.1, u, 0.01 * u)


def maxima(*turns: float) -> list[float]:
    return [round(float(u[0]), 6) for u, _ in first_order_curves(profile(*turns), 35.0)]


def test_falls_after_a_rise_from_cold_count() -> None:
    assert maxima(25.0, 60.0, 25.0, 80.0, 30.0, 100.0, 25.0) == [60.0, 80.0, 100.0]


def test_minor_loops_do_not() -> None:
    """A rise from 50 degC follows no first-order curve's start."""
    assert maxima(25.0, 60.0, 25.0, 80.0, 50.0, 90.0, 25.0, 70.0, 25.0) == [60.0, 80.0, 70.0]
    assert maxima(25.0, 60.0, 34.9, 80.0, 35.1, 90.0, 25.0) == [60.0, 80.0]


def test_a_leg_must_be_long_on_both_sides() -> None:
    """The record's last fall may be cut: shorter than the least leg, it is no curve."""
    short, long = 0.5 * LEAST_LEG, 1.5 * LEAST_LEG
    whole = (25.0, 60.0, 25.0, 80.0, 25.0)
    assert maxima(*whole, 70.0, 70.0 - short) == [60.0, 80.0]
    assert maxima(*whole, 70.0, 70.0 - long) == [60.0, 80.0, 70.0]
    assert maxima(34.0, 34.0 + short, 25.0, 60.0, 25.0, 80.0, 25.0) == [60.0, 80.0]


def test_one_fall_makes_no_table() -> None:
    with pytest.raises(InputError, match="1 of at least two falls"):
        first_order_curves(profile(25.0, 60.0, 25.0), 35.0)
