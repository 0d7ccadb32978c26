"""Breakaway along the travel: what both directions say together, and each of them."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.commission.axes import PLAIN, Virtual, session

from macromicro.commission._probing import (
    Direction,
    Ends,
    FrictionMap,
    find_breakaway,
    map_friction,
)
from macromicro.commission.stand import Caution, Stand

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


def test_what_the_speed_takes_is_not_taken_for_friction() -> None:
    """Of an axis with a large back-EMF: that it slides is seen at some speed only."""
    rig = Virtual(PLAIN._replace(mass=0.05, viscous=60.0, stribeck=0.0))
    on = Stand(session(rig), rig.dt, rig.pitch)
    known = Direction(1.0, 1.0, 1.0, 0.0, 0.0)
    caution = Caution(10.0, 0.02)
    one = find_breakaway(on, 1.0, caution, 0.0, 0.8)
    count = 60.0 * rig.pitch / 0.02  # V; one more or less in the hold's second half
    assert one.effort - 1.0 == pytest.approx(60.0 * one.speed, abs=count)
    found = map_friction(
        on, known, Ends(on.position() - 0.02, on.position() + 0.02, False), caution
    )
    assert len(found.places) == 7
    assert found.mean > 1.03
    assert found.breakaway(60.0) == pytest.approx(1.0, abs=0.02)
    assert found.breakaway(0.0) == found.mean
    assert found.breakaway(1e9) == 0.5 * found.mean
