"""The thesis' programme on the simulated board, with the loop on either side."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from macromicro import programme
from macromicro.control import calibration
from macromicro.programme import travel
from macromicro.programme.moves import MACRO, MICRO
from macromicro.rig.board.rig import BoardRig
from macromicro.rig.session import BENCH, Fixture
from macromicro.runs import programmed
from macromicro.settings import Settings
from tests.firmware.built import Bench, Wire, elf, needs_avr

pytestmark = [needs_avr, pytest.mark.slow]


def _fixture(loop: str) -> Fixture:
    def make(seed: int) -> BoardRig:
        wire = Wire(Bench(elf(), seed))
        return BoardRig("simulated", loop, calibration.shipped(), open_port=lambda _: wire)

    channels = make(0).channels
    return Fixture("board:simulated", BENCH, make, channels, 1e-3, table=calibration.shipped())


@pytest.mark.timeout(1800)
@pytest.mark.parametrize("loop", ["board", "host"])
def test_the_thesis_programme_runs_as_on_the_bench(loop: str) -> None:
    settings = Settings()
    limits = travel.limits(settings.travel, settings.sensors.encoder.pitch)
    what = programme.load(programme.find("thesis"), limits)
    done = programmed.record(what, settings, on=_fixture(loop))
    assert done.outcome.finished
    worst = ends(done.recording, what.stage)
    assert worst[MACRO] <= 1.0  # counts
    assert worst[MICRO] <= 0.01  # mm, the band of a micro move, by the Hall sensor


def ends(recording: Any, stages: Any) -> dict[int, float]:
    """Largest error of each stage in the last 0.2 s of its moves."""
    worst = {MACRO: 0.0, MICRO: 0.0}
    columns = {
        MACRO: ("macro_position", "macro_reference"),
        MICRO: ("hall_position", "micro_reference"),
    }
    for move, stage in enumerate(stages):
        rows = np.flatnonzero(np.asarray(recording["move"]) == move)[-200:]
        assert len(rows) == 200
        place, target = (np.asarray(recording[name])[rows] for name in columns[int(stage)])
        worst[int(stage)] = max(worst[int(stage)], float(np.abs(place - target).max()))
    return worst
