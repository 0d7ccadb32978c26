"""Curves between measured ones, along the output."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.hysteresis.curves import Curve
from macromicro.hysteresis.shape import along_output
from macromicro.hysteresis.table import FodTable

NODES = np.linspace(0.0, 10.0, 101)
RISING = np.clip((NODES - 4.0) / 4.0, 0.0, 1.0)  # from 4 to 8


def fall(start: float, at: float, width: float = 0.2) -> Curve:
    """From the rising branch down to 0, all of it within `width` below `at`."""
    top = float(np.interp(start, NODES, RISING))
    u = np.array([start, at, at - width, 0.0])
    return Curve(u, np.array([top, top, 0.0, 0.0]))


def test_a_steep_fall_lies_between_those_of_its_neighbours() -> None:
    """Not half a step at each of theirs."""
    found = along_output([fall(5.0, 2.0), fall(7.0, 3.0)], NODES, RISING)
    assert [curve.u[0] for curve in found] == pytest.approx([5.5, 6.0, 6.5])
    middle = found[1]
    assert middle.f[0] == pytest.approx(0.5) and middle.f[-1] == pytest.approx(0.0, abs=1e-9)
    half = float(np.interp(-0.25, -middle.f, middle.u))
    assert half == pytest.approx(2.4, abs=0.01)  # between 1.9 and 2.9
    assert np.all(np.diff(middle.f) < 0.0) and np.all(np.diff(middle.u) <= 0.0)


def test_a_curve_that_hardly_falls_has_no_neighbours() -> None:
    found = along_output([fall(4.05, 3.0), fall(6.0, 2.5), fall(7.0, 3.0)], NODES, RISING)
    assert len(found) == 3 and min(curve.u[0] for curve in found) > 6.0


@given(st.floats(4.5, 6.0), st.floats(6.1, 8.0), st.floats(1.0, 4.0), st.floats(1.0, 4.0))
def test_every_curve_between_stays_between(
    first: float, second: float, one: float, other: float
) -> None:
    pair = [fall(first, one), fall(second, other)]
    for curve in along_output(pair, NODES, RISING):
        level = 0.5 * curve.f[0]
        crossed = float(np.interp(-level, -curve.f, curve.u))
        assert min(one, other) - 0.3 <= crossed <= max(one, other)
        assert first <= curve.u[0] <= second


def test_measured_curves_outweigh_those_between() -> None:
    """A table that goes on along the output still meets its own curves."""
    u = [np.linspace(s, 0.0, 200) for s in np.linspace(4.5, 8.0, 6)]
    starts = np.array([c[0] for c in u])
    pairs = [
        (c, float(np.interp(s, NODES, RISING)) / (1.0 + np.exp(-(c - 0.4 * s) / 0.3)))
        for c, s in zip(u, starts, strict=True)
    ]
    errors = {
        way: FodTable.from_curves(pairs, between=way, nodes=81).misfit().rms
        for way in ("input", "output")
    }
    assert errors["output"] < 0.01 and errors["output"] < 2.0 * errors["input"] + 2e-3
