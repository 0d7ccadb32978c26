"""Temperatures of a step by the table (Section 5.2.2, Figure 5.10b)."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.columns import Column
from macromicro.hysteresis import from_density
from macromicro.hysteresis.table import FodTable
from macromicro.identify.heating import inferred_step, on_heating
from macromicro.recording import Recording

COLUMNS = (Column("t", "s", ""), Column("laser", "um", ""))
TABLE = FodTable.from_everett(
    from_density(lambda up, down: np.where(up - down < 5.0, 1.0, 0.0), 20.0, 0.5, 161), 0.0, 4.0
)


def test_rise_is_over_ambient_and_its_error_a_quarter_of_the_band() -> None:
    """The band is two standard errors to either side."""
    x = np.linspace(0.5, 3.5, 7)
    t = np.arange(7) * 0.1
    trial = Recording.from_arrays(COLUMNS, [t, 1e3 * x], 0.1, {})
    found = inferred_step(TABLE, [trial, trial], 23.0)
    seen = on_heating(TABLE, x)
    np.testing.assert_allclose(found.position, x)
    np.testing.assert_allclose(found.rise, seen.temperature - 23.0)
    np.testing.assert_allclose(found.error, 0.25 * (seen.high - seen.low))
    assert found.rise[0] > 0.0


def test_where_the_position_tells_nothing_the_error_is_infinite() -> None:
    x = np.array([0.0, 2.0, 4.2])
    trial = Recording.from_arrays(COLUMNS, [np.arange(3) * 0.1, 1e3 * x], 0.1, {})
    found = inferred_step(TABLE, [trial], 25.0)
    assert np.isinf(found.error[[0, 2]]).all()
    assert found.error[1] == pytest.approx(0.3, abs=0.3)
