"""Choice of the magnet, Table 3.1."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.design.magnets import INCH, TABLE_3_1, Magnet, largest_change, ranking
from macromicro.errors import InputError

MM = 1e-3


@pytest.mark.parametrize(
    ("row", "travel", "change"),
    [
        (0, 0.04 * INCH, 460.0),
        (1, 0.04 * INCH, 305.0),
        (2, MM, 144.0),
        (3, MM, 146.0),
        (4, MM, 167.0),
        (5, MM, 184.0),  # 122 is printed
        (6, MM, 213.0),
    ],
)
def test_last_row_of_the_table(row: int, travel: float, change: float) -> None:
    """Claim D7: the first two columns per 0.04 in, the rest per 1 mm."""
    assert largest_change(TABLE_3_1[row], travel).flux == pytest.approx(change, abs=0.5)


def test_steepest_magnet_is_the_one_chosen() -> None:
    names = [c.name for c in ranking(TABLE_3_1, MM)]
    assert names[:2] == ["103MG5", "101MG2L1"]
    assert largest_change(TABLE_3_1[0], 0.04 * INCH).start == pytest.approx(0.02 * INCH)


@settings(max_examples=50)
@given(st.data())
def test_no_window_of_a_fine_search_changes_more(data: st.DataObject) -> None:
    steps = data.draw(st.lists(st.floats(0.1, 2.0), min_size=2, max_size=6))
    flux = data.draw(
        st.lists(st.floats(-800, 800), min_size=len(steps) + 1, max_size=len(steps) + 1)
    )
    place = np.concatenate(([0.0], np.cumsum(steps)))
    travel = data.draw(st.floats(0.05, 0.99)) * float(place[-1])
    found = largest_change(Magnet("x", tuple(map(float, place)), tuple(flux)), travel)
    start = np.linspace(0.0, place[-1] - travel, 500)
    change = np.abs(np.interp(start + travel, place, flux) - np.interp(start, place, flux))
    assert found.flux >= change.max() - 1e-6
    there = np.interp([found.start, found.start + travel], place, flux)
    assert found.flux == pytest.approx(abs(there[1] - there[0]), abs=1e-6)


@pytest.mark.parametrize(
    ("magnet", "travel", "word"),
    [
        (TABLE_3_1[0], 0.0, "travel.*above 0 m"),
        (TABLE_3_1[0], float("nan"), "travel"),
        (TABLE_3_1[0], 0.01, "103MG5, travel.*0.003048 m"),
        (Magnet("x", (0.0, 1.0), (1.0,)), 0.5, "number 2 and 1"),
        (Magnet("x", (0.0,), (1.0,)), 0.5, "two or more"),
        (Magnet("x", (0.0, 0.0), (1.0, 2.0)), 0.5, "increase"),
        (Magnet("x", (0.0, 1.0), (1.0, float("inf"))), 0.5, "not a finite number"),
    ],
)
def test_bad_sheets_are_refused(magnet: Magnet, travel: float, word: str) -> None:
    with pytest.raises(InputError, match=word):
        largest_change(magnet, travel)


def test_no_magnets() -> None:
    with pytest.raises(InputError, match="one magnet or more"):
        ranking([], MM)


def test_the_first_reading_of_table_3_1_stands_at_its_distance() -> None:
    """Distances of the table are inches, in steps of 0.01 or more; nothing lies beyond the last."""
    for magnet in TABLE_3_1:
        assert magnet.distance == tuple(sorted(set(magnet.distance)))
        assert 0.1 * INCH <= magnet.distance[-1] - magnet.distance[0] <= INCH
        whole = largest_change(magnet, magnet.distance[-1] - magnet.distance[0])
        assert whole.flux == pytest.approx(abs(magnet.flux[-1] - magnet.flux[0]))


def test_distances_that_fall_anywhere_are_refused() -> None:
    with pytest.raises(InputError, match="increase"):
        largest_change(Magnet("x", (0.0, 2.0, 1.0, 3.0), (1.0, 2.0, 3.0, 4.0)), 0.5)
