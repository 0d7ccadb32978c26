"""A table whose branches are known by hand, read backwards."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.hysteresis.table import FodTable
from macromicro.identify.heating import on_cooling, on_heating
from macromicro.thesis.chapter5.actuator_models import full_contraction

# Inputs 0 to 60 in steps of 10. The rising branch: flat to 20, 1 a kelvin to 30, 0.2 to 50, flat.
RISING = np.array([0.0, 0.0, 0.0, 10.0, 12.0, 14.0, 14.0])
VALUES = np.zeros((7, 7))
for _i in range(7):
    for _j in range(_i):
        VALUES[_i, _j] = RISING[_i] - RISING[_j]  # relays of no width: no hysteresis
TABLE = FodTable(0.0, 10.0, VALUES, 1.0)


@pytest.mark.parametrize(
    ("x", "warm", "slope"),
    [(1.0, 20.0, 0.0), (6.0, 25.0, 1.0), (11.0, 30.0, 0.2), (12.0, 35.0, 0.2), (14.0, 45.0, 0.2),
     (15.0, 50.0, 0.0), (0.0, 20.0, 0.0), (99.0, 50.0, 0.0)],
)  # fmt: skip
def test_a_branch_of_straight_pieces_is_read_backwards(x: float, warm: float, slope: float) -> None:
    """Saturation reads as its beginning, where the branch tells no slope."""
    found = on_heating(TABLE, [x])
    assert found.temperature[0] == pytest.approx(warm)
    assert found.slope[0] == pytest.approx(slope)
    along = on_cooling(TABLE, [x], 60.0)
    assert along.temperature[0] == pytest.approx(warm)


@pytest.mark.parametrize(
    ("x", "low", "high"),
    [
        (6.0, 25.0 - 0.012 - 0.6, 25.0 + 0.012 + 0.6),
        (10.994, 29.982 - 0.6, 30.03 + 0.6),  # over the bend: 6 um at 1, 6 um at 0.2 mm a kelvin
        (1.01, 0.0, 20.022 + 0.6),  # might be saturation below: down to the table's end
        (14.99, 49.89 - 0.6, 60.0),  # or above
        (0.95, 0.0, 20.0 + 0.6),
        (15.05, 50.0 - 0.6, 60.0),
    ],
)
def test_the_band_is_two_standard_errors_of_position_and_of_temperature(
    x: float, low: float, high: float
) -> None:
    """6 um and 0.3 K."""
    found = on_heating(TABLE, [x])
    assert found.low[0] == pytest.approx(low)
    assert found.high[0] == pytest.approx(high)
    assert found.low[0] <= found.temperature[0] <= found.high[0]


@pytest.mark.parametrize("peak", [25.0, 30.0, 33.0])
def test_a_cooling_curve_begins_at_its_peak(peak: float) -> None:
    top = float(np.interp(peak, TABLE.grid, 1.0 + RISING))
    found = on_cooling(TABLE, [top - 1.0, top + 5.0], peak)
    back = float(np.interp(top - 1.0, (1.0 + RISING)[2:6], TABLE.grid[2:6]))
    assert found.temperature[0] == pytest.approx(back)
    assert found.temperature[1] == pytest.approx(peak) and found.high[1] == pytest.approx(peak)
    with pytest.raises(InputError, match="peak"):
        on_cooling(TABLE, [2.0], 0.0)


@pytest.mark.parametrize(("within", "warm"), [(0.05, 50.0 - 0.7 / 0.2), (0.0, 50.0), (0.5, 27.0)])
def test_full_contraction_is_a_share_of_the_stroke_below_the_end(
    within: float, warm: float
) -> None:
    assert full_contraction(TABLE, within) == pytest.approx(warm)


def test_what_cannot_be_read_backwards_is_refused() -> None:
    falling = FodTable(0.0, 10.0, -VALUES, 1.0)
    with pytest.raises(InputError, match="Give a rising one"):
        on_heating(falling, [2.0])
    with pytest.raises(InputError, match="flat"):
        on_cooling(TABLE, [2.0], 15.0)


def test_doubts_count_on_the_way_down_too() -> None:
    found = on_cooling(TABLE, [6.0], 60.0)
    assert (found.low[0], found.high[0]) == pytest.approx((25.0 - 0.612, 25.0 + 0.612))


@pytest.mark.parametrize("unit", [1e-10, 1e10])
def test_the_unit_of_the_position_does_not_matter(unit: float) -> None:
    table = FodTable(0.0, 10.0, unit * VALUES, unit)
    for x, warm in ((1.0, 20.0), (6.0, 25.0), (12.0, 35.0), (15.0, 50.0)):
        assert on_heating(table, [unit * x]).temperature[0] == pytest.approx(warm)


def test_full_contraction_of_a_branch_that_rises_to_its_end() -> None:
    """Without its last node the branch rises by 14, at last by 0.2 a kelvin, to 50."""
    table = FodTable(0.0, 10.0, np.ascontiguousarray(VALUES[:6, :6]), 1.0)
    assert full_contraction(table, 0.05) == pytest.approx(50.0 - 0.05 * 14.0 / 0.2)
