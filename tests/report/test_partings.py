"""Where two recordings part: by hand, and laws that hold for any."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.columns import Column
from macromicro.recording import Recording
from macromicro.report._partings import parting

COLUMNS = (Column("t", "s", ""), Column("x", "mm", ""), Column("n", "1", "", "i2"))


def made(x: list[float], dt: float = 1.0, start: float = 0.0, columns=COLUMNS) -> Recording:
    t = start + dt * np.arange(len(x))
    return Recording.from_arrays(columns, [t, x, np.arange(len(x))], dt, {})


def test_rms_largest_and_when() -> None:
    one, other = made([0.0, 1.0, 2.0, 3.0]), made([0.0, 1.0, 5.0, -1.0], start=7.0)
    found = parting(one, other, ["x", "n"])
    assert (found.rows, found.t, found.columns, found.differing) == (4, 2.0, ("x",), ("x",))
    assert found.rms["x"] == 2.5 and found.largest["x"] == 4.0 and found.at["x"] == 3.0
    assert found.rms["n"] == 0.0 and math.isnan(found.at["n"])


def test_another_period_is_compared_at_the_instants_of_the_slower() -> None:
    """Floats on a line between rows, whole numbers as they stood; to the end that both have."""
    slow, quick = made([0.0, 1.0, 2.0, 9.0], dt=3.0), made([0.0, 2.0, 4.0, 6.0], dt=2.0, start=50.0)
    for first, other, t in ((slow, quick, 3.0), (quick, slow, 53.0)):
        found = parting(first, other, ["x", "n"])
        assert (found.rows, found.period) == (3, 3.0)  # 0, 3 and 6 s
        assert found.largest == {"x": 4.0, "n": 1.0}  # 6 - 2 and 3 - 2, at 6 s
        assert found.rms["x"] == pytest.approx(math.sqrt((2.0**2 + 4.0**2) / 3.0))
        assert (found.t, found.differing) == (t, ("x", "n"))


def test_no_number_is_equal_to_none() -> None:
    nan = math.nan
    found = parting(made([nan, nan]), made([nan, nan]), ["x"])
    assert found.t is None and found.differing == () and math.isnan(found.rms["x"])
    found = parting(made([1.0, nan]), made([1.0, 2.0]), ["x"])
    assert (found.t, found.differing, found.largest["x"]) == (1.0, ("x",), 0.0)


def test_columns_and_units_that_only_one_has() -> None:
    other = (COLUMNS[0], COLUMNS[1]._replace(unit="um"), COLUMNS[2]._replace(name="m"))
    found = parting(made([1.0]), made([1.0], columns=other), [])
    assert (found.lacking, found.added) == (("n",), ("m",))
    assert found.units == {"x": ("mm", "um")}


@given(st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=20), st.integers(1, 7))
@settings(max_examples=25)
def test_every_kth_row_is_no_difference(x: list[float], k: int) -> None:
    """A recording thinned to every k-th row is equal where both are; the order does not matter."""
    quick, slow = made(x, dt=1e-3), made(x[::k], dt=k * 1e-3)
    for pair in ((quick, slow), (slow, quick)):
        found = parting(*pair, ["x"])
        assert found.t is None and found.rows == len(x[::k])
