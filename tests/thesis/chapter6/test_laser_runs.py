"""The laser's noise, at rest and in the loop (Section 6.4.1, Chapter 7)."""

from __future__ import annotations

import numpy as np
import pytest
from tests.thesis.ended import collected

from macromicro.plant import bench
from macromicro.plant.bench import Bench, Sensors
from macromicro.thesis.chapter6 import laser_noise
from macromicro.thesis.chapter6.laser_noise import LaserRuns
from macromicro.thesis.claims import DIFFERS, REPRODUCED, Claim


@pytest.fixture(scope="module")
def runs() -> LaserRuns:
    made: LaserRuns = collected("laser-noise")
    return made


@pytest.fixture(scope="module")
def claims(runs: LaserRuns) -> dict[str, Claim]:
    return {c.id: c for c in laser_noise.claims(runs)}


@pytest.mark.parametrize(("name", "low", "high"), [("I5", 1.5, 2.5), ("I7", 1.0, 2.5)])
def test_claim_is_reproduced(claims: dict[str, Claim], name: str, low: float, high: float) -> None:
    claim = claims[name]
    assert claim.verdict == REPRODUCED
    assert isinstance(claim.measured, float)
    assert low <= claim.measured <= high


def test_the_stage_is_where_it_should_be(runs: LaserRuns) -> None:
    """Chapter 7: the loop holds the true position better than the laser can show."""
    for r in runs.calmer:
        late = r["true_micro"][-10_000:] - r["micro_reference"][-1]
        assert np.abs(late).max() < 2e-3


def test_printed_gains_answer_the_noise(runs: LaserRuns) -> None:
    calm = max(laser_noise.last_window(r) for r in runs.calmer)
    assert max(laser_noise.last_window(r) for r in runs.printed) > 1.2 * calm


def test_a_noisier_laser_fails_both() -> None:
    sensors = Sensors()._replace(laser=Sensors().laser._replace(noise=1e-6))
    found = laser_noise.claims(laser_noise.record(bench.prepare(Bench(), sensors)))
    assert [c.verdict for c in found] == [DIFFERS, DIFFERS]
