"""Hall calibration in use: Section 3.2.3, Figure 3.9."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.control import calibration
from macromicro.control.calibration import Calibration
from macromicro.errors import InputError
from macromicro.plant import hall
from macromicro.plant.hall import Hall

SHIPPED = calibration.default_calibration()
GRID = SHIPPED.low + SHIPPED.step * np.arange(len(SHIPPED.position))
tables = st.lists(st.floats(-1e-3, 5e-3), min_size=2, max_size=30)


@given(tables, st.floats(-2.0, 2.0), st.floats(0.01, 1.0), st.floats(-10.0, 40.0))
def test_lookup_is_linear_interpolation(
    positions: list[float], low: float, step: float, volts: float
) -> None:
    """Held at the table's ends, as np.interp does."""
    table = Calibration(low, step, np.array(positions))
    grid = low + step * np.arange(len(positions))
    expected = np.interp(volts, grid, positions)
    assert calibration.position(table, volts) == pytest.approx(expected, abs=1e-12)


def test_a_reading_that_is_no_number_is_no_index() -> None:
    """NaN must not run off the table; the guard sees to the rest."""
    assert calibration.position(SHIPPED, float("nan")) == SHIPPED.position[0]


@given(st.floats(0.0, 5.0), st.floats(0.0, 5.0))
def test_shipped_table_is_monotone(a: float, b: float) -> None:
    low, high = sorted((a, b))
    assert calibration.position(SHIPPED, low) <= calibration.position(SHIPPED, high)


def test_shipped_table_covers_the_sensor_and_is_right_within_two_micrometres() -> None:
    """Section 3.2.3: against the bench's own sensor curve, from 0.1 to 3.9 mm."""
    assert GRID[0] <= 0.1 and GRID[-1] >= 4.9
    for x in np.linspace(0.1e-3, 3.9e-3, 77):
        shown = calibration.position(SHIPPED, hall.volts(Hall(), float(x), 0.0))
        assert shown == pytest.approx(x, abs=2e-6)


TABLE = "# Hall calibration\nhall_V,position_mm\n\n0.5,0.1\n0.75,0.4\n1.0,0.8\n1.25,1.5\n"


def test_a_table_is_read_with_its_first_voltage_and_equal_steps() -> None:
    """Remarks, the heading and empty lines aside."""
    found = calibration.parse(TABLE)
    assert (found.low, found.step) == (0.5, 0.25)
    assert found.position.tolist() == [0.1e-3, 0.4e-3, 0.8e-3, 1.5e-3]
    assert calibration.position(found, 0.9) == pytest.approx(0.64e-3)


@pytest.mark.parametrize("text", [
    "", "hall_V,position_mm\n", "0.5,0.1\n", "0.5\n0.6\n", "0.5,a\n0.6,1\n",
    "1.0,0.1\n0.5,0.4\n", "0.5,0.1\n0.5,0.4\n", "0.5,0.1\n0.6,nan\n", "nan,0.1\n0.6,0.2\n",
])  # fmt: skip
def test_what_is_no_table_is_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"Hall calibration.*Use a hall_cal"):
        calibration.parse(text)
