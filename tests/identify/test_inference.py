"""Temperature from position: the table read backwards (Section 5.2.2)."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.errors import InputError
from macromicro.hysteresis import from_density
from macromicro.hysteresis.preisach import Preisach
from macromicro.hysteresis.table import FodTable
from macromicro.identify.heating import on_cooling, on_heating
from macromicro.thesis.chapter5.actuator_models import full_contraction

TABLE = FodTable.from_everett(
    from_density(
        lambda up, down: np.where(
            (up < 110.0) & (up > 45.0) & (up - down > 15.0) & (up - down < 50.0) & (down > 30.0),
            np.exp(up / 10.0),
            0.0,
        ),
        20.0,
        0.5,
        191,
    ),
    0.0,
    4.0,
)


@given(st.floats(60.0, 109.0))
def test_heating_then_reading_back(warm: float) -> None:
    x = Preisach(TABLE).run([25.0, warm])[-1]
    found = on_heating(TABLE, [x])
    assert found.temperature[0] == pytest.approx(warm, abs=1e-6)
    assert found.low[0] < warm < found.high[0]


@given(st.floats(85.0, 109.0), st.floats(0.1, 0.8))
def test_cooling_then_reading_back(peak: float, share: float) -> None:
    grid = np.linspace(peak, 30.0, 400)
    x = Preisach(TABLE).run(np.r_[25.0, grid])[1:]
    k = int(np.argmax(x < share * x[0]))
    found = on_cooling(TABLE, [x[k]], peak)
    assert found.temperature[0] == pytest.approx(grid[k], abs=1e-6)


def test_band_is_wide_where_the_branch_is_flat_and_sensitivity_where_it_is_steep() -> None:
    """Section 5.2.3: at high temperatures a minor temperature error is a large position error."""
    found = on_heating(TABLE, [0.1, 3.5])
    width = found.high - found.low
    assert width[0] > 2.0 * width[1]
    assert found.slope[1] > 10.0 * found.slope[0]
    # On the steep part it is all the thermometer's doubt.
    assert width[1] == pytest.approx(4.0 * 0.3, rel=0.15)


def test_saturation_tells_no_temperature() -> None:
    found = on_heating(TABLE, [-0.01, 4.01])
    assert found.low[0] == TABLE.lo
    assert found.high[1] == TABLE.hi
    assert list(found.slope) == [0.0, 0.0]


def test_full_contraction() -> None:
    """The branch ends at 110 degC; with an e-fold of 10 K, 5 % below it is 0.5 K short."""
    for within in (0.02, 0.05):
        short = 110.0 + 10.0 * np.log(1.0 - within)
        assert full_contraction(TABLE, within) == pytest.approx(short, abs=0.35)


def test_what_cannot_be_read() -> None:
    with pytest.raises(InputError, match="peak"):
        on_cooling(TABLE, [1.0], 10.0)
    with pytest.raises(InputError, match="not finite"):
        on_heating(TABLE, [np.nan])


def test_band_is_two_standard_errors_of_either_kind() -> None:
    """On a line of known slope: 2 sigma of position over the slope, and 2 of temperature."""
    straight = FodTable.from_everett(
        from_density(lambda up, down: np.where(up - down < 2.0, 1.0, 0.0), 20.0, 0.5, 161), 0.0, 4.0
    )
    x = 0.5 * (straight.f_low + straight.span)
    found = on_heating(straight, [x])
    half = 0.012 / float(found.slope[0]) + 0.6
    assert found.high[0] - found.temperature[0] == pytest.approx(half, rel=1e-3)
    assert found.temperature[0] - found.low[0] == pytest.approx(half, rel=1e-3)
