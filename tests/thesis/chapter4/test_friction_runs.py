"""Dead zone of the twin by the laboratory procedure (Section 4.2.3, Figure 4.8)."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.identify.deadzone import DeadZone
from macromicro.lab import drive
from macromicro.plant import bench
from macromicro.plant.bench import Bench, Plant, Sensors
from macromicro.thesis.chapter4 import friction


@pytest.fixture(scope="module")
def plant() -> Plant:
    return bench.prepare(Bench(), Sensors())


@pytest.fixture(scope="module")
def zone(plant: Plant) -> DeadZone:
    return friction.measure(plant)


def test_dead_zone(zone: DeadZone) -> None:
    """M1: the lowest voltage with uninterrupted motion over the whole travel is 3 V."""
    assert zone.width == pytest.approx(3.0, abs=0.15)
    assert zone.positive == pytest.approx(zone.negative, abs=0.1)


def test_threshold_depends_on_position(zone: DeadZone) -> None:
    """Figure 4.8: below 3 V the carriage moves from some places and not from others."""
    for direction in (1, -1):
        starts, lowest = zone.thresholds(direction)
        assert len(starts) == 14
        assert np.ptp(lowest) >= 0.1
        assert np.nanmax(lowest) <= zone.width
    below = [t.uninterrupted for t in zone.trials if abs(t.volts) == 2.9]
    assert any(below)
    assert not all(below)
    row = zone.speeds[np.searchsorted(zone.volts, 3.1)]
    assert np.nanmin(row[2:-2]) < 0.9 * np.nanmax(row[2:-2])


def test_a_run_shows_what_a_rig_shows(plant: Plant) -> None:
    """Whole counts, volts as sent, one period of latency, no column of the bench's truth."""
    run = drive.open_loop(plant, np.full(300, 4.0), 100.5)
    assert [c.name for c in run.columns] == ["t", "macro_position", "motor"]
    x = run["macro_position"]
    np.testing.assert_array_equal(x, np.round(x))
    assert x[0] == x[1] == 100.0
    assert x[-1] > 800.0
