"""Breakaway along the travel: what both directions say together, and each of them."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.commission.friction import FrictionMap

EFFORTS = st.lists(st.floats(0.1, 5.0), min_size=2, max_size=7)


@given(EFFORTS, st.floats(-0.09, 0.09))
def test_a_constant_force_changes_neither_mean_nor_ripple(
    efforts: list[float], force: float
) -> None:
    places = tuple(range(len(efforts)))
    level = FrictionMap(places, tuple(efforts), tuple(efforts))
    pulled = level._replace(
        forward=tuple(e + force for e in efforts), backward=tuple(e - force for e in efforts)
    )
    assert pulled.mean == pytest.approx(level.mean)
    assert pulled.ripple == pytest.approx(level.ripple, abs=1e-12)
    assert pulled.spread == pytest.approx(level.spread)


def test_a_place_that_could_not_be_tried_is_left_out() -> None:
    found = FrictionMap((0.1, 0.2, 0.3), (1.0, math.nan, 1.4), (0.8, 0.6, math.nan))
    assert found.mean == pytest.approx(0.5 * (1.2 + 0.7))
    assert found.ripple == pytest.approx(0.2)
    assert found.spread == pytest.approx(math.sqrt(0.08))
    nothing = FrictionMap((0.1, 0.2), (1.0, 1.2), (math.nan, math.nan))
    assert nothing.mean == pytest.approx(1.1)
