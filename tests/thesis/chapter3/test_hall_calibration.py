"""Claim D6 and the slopes it rests on (Section 3.2.3)."""

from __future__ import annotations

import pytest
from tests.thesis.ended import collected

from macromicro.plant import bench
from macromicro.plant.bench import Bench, Sensors
from macromicro.thesis.chapter3 import hall_calibration
from macromicro.thesis.claims import CALIBRATED, REPRODUCED


@pytest.mark.slow
def test_slopes_follow_the_sensor_of_the_bench() -> None:
    """D6 is measured: a coarser converter and a weaker magnet are seen by the procedure."""
    sensors = Sensors()
    weak = sensors._replace(
        hall=sensors.hall._replace(gain=0.8 * sensors.hall.gain),
        converter=sensors.converter._replace(bits=11.0),
    )
    data = collected("hall-calibration")
    first = data.slopes
    other = hall_calibration.calibrated_by(bench.prepare(Bench(), weak)).slopes
    assert other.mean == pytest.approx(first.mean / 0.8, rel=0.01)
    assert other.step == pytest.approx(2.0 * first.step)
    assert first.extended > first.mean and first.contracted > first.mean
    (claim,) = hall_calibration.claims(data)
    assert isinstance(claim.measured, float)
    assert 0.75 * 1.2207 <= claim.measured <= 0.85 * 1.2207
    assert (claim.verdict, claim.kind) == (REPRODUCED, CALIBRATED)
