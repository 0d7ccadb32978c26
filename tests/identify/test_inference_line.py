"""A table whose branches are known by hand, read backwards."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.hysteresis.table import FodTable
from macromicro.identify.heating import Doubt, on_cooling, on_heating
from macromicro.thesis.chapter5.actuator_models import full_contraction

# Inputs 0 to 60 in steps of 10. The rising branch: flat to 20, 1 a kelvin to 30, 0.2 to 50, flat.
RISING = np.array([0.0, 0.0, 0.0, 10.0, 12.0, 14.0, 14.0])
VALUES = np.zeros((7, 7))
for _i in range(7):
    for _j in range(_i):
        VALUES[_i, _j] = RISING[_i] - RISING[_j]  # relays of no width: no hysteresis
TABLE = FodTable(0.0, 10.0, VALUES, 1.0)
SURE = Doubt(0.0, 0.0)


@pytest.mark.parametrize(
    ("x", "warm", "slope"),
    [(1.0, 20.0, 0.0), (6.0, 25.0, 1.0), (11.0, 30.0, 0.2), (12.0, 35.0, 0.2), (14.0, 45.0, 0.2),
     (15.0, 50.0, 0.0), (0.0, 20.0, 0.0), (99.0, 50.0, 0.0)],
)  # fmt: skip
def test_a_branch_of_straight_pieces_is_read_backwards(x: float, warm: float, slope: float) -> None:
    """Saturation reads as its beginning, where the branch tells no slope."""
    found = on_heating(TABLE, [x], SURE)
    assert found.temperature[0] == pytest.approx(warm)
    assert found.slope[0] == pytest.approx(slope)
    along = on_cooling(TABLE, [x], 60.0, SURE)
    assert along.temperature[0] == pytest.approx(warm)


@pytest.mark.parametrize(
    ("x", "low", "high"),
    [
        (6.0, 25.0 - 0.2 - 0.6, 25.0 + 0.2 + 0.6),
        (10.9, 29.9 - 0.2 - 0.6, 30.0 + 0.5 + 0.6),  # over the bend: 0.1 at 1, 0.1 at 0.2 a kelvin
        (1.1, 0.0, 20.1 + 0.2 + 0.6),  # might be saturation below: down to the table's end
        (14.9, 49.5 - 1.0 - 0.6, 60.0),  # or above
        (0.5, 0.0, 20.0 + 0.6),
        (15.5, 50.0 - 0.6, 60.0),
    ],
)
def test_the_band_is_two_standard_errors_of_position_and_of_temperature(
    x: float, low: float, high: float
) -> None:
    found = on_heating(TABLE, [x], Doubt(position=0.1, temperature=0.3))
    assert found.low[0] == pytest.approx(low)
    assert found.high[0] == pytest.approx(high)
    assert found.low[0] <= found.temperature[0] <= found.high[0]


def test_the_default_doubts_are_six_micrometres_and_0_3_kelvin() -> None:
    found = on_heating(TABLE, [6.0])
    assert found.high[0] - 25.0 == pytest.approx(2.0 * 0.006 + 2.0 * 0.3)


@pytest.mark.parametrize("peak", [25.0, 30.0, 33.0])
def test_a_cooling_curve_begins_at_its_peak(peak: float) -> None:
    top = float(np.interp(peak, TABLE.grid, 1.0 + RISING))
    found = on_cooling(TABLE, [top - 1.0, top + 5.0], peak, SURE)
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
    for doubt in (Doubt(-1e-9, 0.0), Doubt(0.0, -1e-9)):
        with pytest.raises(InputError, match="at least 0"):
            on_heating(TABLE, [2.0], doubt)


def test_doubts_count_on_the_way_down_too() -> None:
    found = on_cooling(TABLE, [6.0], 60.0, Doubt(position=0.1, temperature=0.3))
    assert (found.low[0], found.high[0]) == pytest.approx((25.0 - 0.8, 25.0 + 0.8))


@pytest.mark.parametrize("unit", [1e-10, 1e10])
def test_the_unit_of_the_position_does_not_matter(unit: float) -> None:
    table = FodTable(0.0, 10.0, unit * VALUES, unit)
    for x, warm in ((1.0, 20.0), (6.0, 25.0), (12.0, 35.0), (15.0, 50.0)):
        assert on_heating(table, [unit * x], SURE).temperature[0] == pytest.approx(warm)


def test_full_contraction_of_a_branch_that_rises_to_its_end() -> None:
    """Without its last node the branch rises by 14, at last by 0.2 a kelvin, to 50."""
    table = FodTable(0.0, 10.0, np.ascontiguousarray(VALUES[:6, :6]), 1.0)
    assert full_contraction(table, 0.05) == pytest.approx(50.0 - 0.05 * 14.0 / 0.2)
