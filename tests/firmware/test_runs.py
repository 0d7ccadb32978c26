"""The thesis' programme on the simulated board, with the loop on either side."""

from __future__ import annotations

import pytest

from macromicro import programme
from macromicro.control import calibration
from macromicro.programme import travel
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
    outcome = programmed.record(what, settings, on=_fixture(loop))
    moves = programmed.moves_of(outcome.recording, what, settings)
    macro = [move for move in moves if move.stage == "macro"]
    micro = [move for move in moves if move.stage == "micro"]
    assert len(macro) == 8
    assert len(micro) == 32
    for move in macro:
        assert move.settling_s is not None
        assert move.settling_s < 0.8
        assert abs(move.final_error_counts) <= 1.0
    for move in micro:
        assert abs(move.hall_error) < 10.0
