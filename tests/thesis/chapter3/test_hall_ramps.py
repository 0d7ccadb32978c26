"""Hall calibration by its procedure (Section 3.2.3, Figure 3.9)."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.control import calibration
from macromicro.errors import InputError
from macromicro.identify.hall import calibrate
from macromicro.plant import bench, hall
from macromicro.plant.bench import Bench, Sensors
from macromicro.thesis.chapter3 import hall_calibration

PLANT = bench.prepare(Bench(), Sensors())


def test_shipped_table_is_what_the_procedure_gives() -> None:
    """The controller's table was measured, not copied from the bench."""
    made = calibrate(hall_calibration.ramps(PLANT))
    shipped = calibration.default_calibration()
    assert (shipped.low, shipped.step) == (made.low, pytest.approx(made.step))
    np.testing.assert_allclose(shipped.position, made.position, atol=1e-9)


def test_table_is_within_two_micrometres_of_the_bench() -> None:
    """Two independent calibrations, and the bench's own curve, agree."""
    for table in (calibration.default_calibration(), calibrate(hall_calibration.ramps(PLANT, 7))):
        x = np.linspace(0.05e-3, 3.95e-3, 300)
        volts = [hall.volts(PLANT.hall, v, 0.0) for v in x]
        read = [calibration.position(table, v) for v in volts]
        assert np.max(np.abs(np.array(read) - x)) < 2e-6


def test_mean_slope() -> None:
    """Claim D6: 0.75-0.85 um per mV over the travel."""
    table = calibration.default_calibration()
    grid = table.low + table.step * np.arange(len(table.position))
    inside = (table.position > 0.05e-3) & (table.position < 3.95e-3)
    mean = np.ptp(table.position[inside]) / np.ptp(grid[inside])
    assert 0.75e-3 < mean < 0.85e-3


def test_too_little_range_is_refused() -> None:
    volts = np.linspace(1.0, 1.5, 5000)
    with pytest.raises(InputError, match="half of the sensor's range"):
        calibrate([(volts, volts), (volts[::-1], volts)])
