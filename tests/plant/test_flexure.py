"""Flexure guide: Section 3.2.2, (3.1)."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.plant.flexure import GRAM_FORCE, Bias, Flexure, stiffness

P = Flexure()


def test_chosen_beams_are_as_stiff_as_3_1_says() -> None:
    """(3.1): half the load over half the way, so F / dx = 12 E I / L^3; D1: 31 gf at 4 mm."""
    inertia = 2e-3 * 0.45e-3**3 / 12.0
    half_way = 0.5 * 1.0 * P.length**3 / (12.0 * 70e9 * inertia)  # under 1 N in all
    assert stiffness(P) == pytest.approx(1.0 / (2.0 * half_way))
    assert stiffness(P) == pytest.approx(76.7, rel=0.01)
    assert stiffness(P) * 4e-3 / GRAM_FORCE == pytest.approx(31.0, rel=0.02)


@given(st.floats(0.1, 3.0))
def test_stiffness_goes_with_thickness_cubed_and_length_to_minus_three(factor: float) -> None:
    """(3.1)."""
    base = stiffness(P)
    assert stiffness(P._replace(thickness=factor * P.thickness)) == pytest.approx(factor**3 * base)
    assert stiffness(P._replace(length=factor * P.length)) == pytest.approx(base / factor**3)
    assert stiffness(P._replace(width=factor * P.width)) == pytest.approx(factor * base)


def test_the_actuator_can_carry_guide_and_spring() -> None:
    """Section 3.2.2: 70 gf at most over 4 mm of stroke; the thesis allots 35 gf to the guide."""
    bias = Bias()
    most = bias.preload + (bias.rate + stiffness(P)) * 3.98e-3
    assert 33.0 <= bias.preload / GRAM_FORCE <= most / GRAM_FORCE <= 80.0
