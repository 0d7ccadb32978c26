"""The thesis' programme on the simulated board, with the loop on either side."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from importlib import resources
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

CLAIMS = tomllib.loads(
    resources.files("macromicro.thesis").joinpath("claims.toml").read_text("utf-8")
)["claim"]
pytestmark = [needs_avr, pytest.mark.slow]


def _fixture(loop: str) -> Fixture:
    def make(seed: int) -> BoardRig:
        wire = Wire(Bench(elf(), seed))
        return BoardRig(
            "simulated", loop, calibration.default_calibration(), open_port=lambda _: wire
        )

    channels = make(0).channels
    return Fixture(
        "board:simulated", BENCH, make, channels, 1e-3, table=calibration.default_calibration()
    )


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
    found = settled(done.recording, what.stage)
    bench = settled(programmed.record(what, settings).recording, what.stage)
    assert np.abs(np.subtract(found, bench)).max() < 0.06  # s
    # The longest macro move is 2660 of 2800 counts: the band of M14; contractions: that of S13a.
    assert _within("M14", max(t for t, s in zip(found, what.stage, strict=True) if s == MACRO))
    steps = zip(found, what.stage, micro_steps(done.recording, what.stage), strict=True)
    assert _within("S13a", float(np.mean([t for t, s, up in steps if s == MICRO and up > 0.0])))
    assert _within("S13c", 1e3 * worst_mean(done.recording, what.stage))


def _within(claim: str, value: float) -> bool:
    """Whether a value is in the band of a claim."""
    (bands,) = (c["accept"] for c in CLAIMS if c["id"] == claim)
    return any(low <= value <= high for low, high in bands)


def _moves(recording: Any, stages: Any) -> Iterator[tuple[int, Any, Any]]:
    """Of each move its stage, places and set points."""
    columns = {
        MACRO: ("macro_position", "macro_reference"),
        MICRO: ("hall_position", "micro_reference"),
    }
    for move, stage in enumerate(stages):
        rows = np.flatnonzero(np.asarray(recording["move"]) == move)
        place, target = (np.asarray(recording[name])[rows] for name in columns[int(stage)])
        yield int(stage), place, target


def settled(recording: Any, stages: Any) -> list[float]:
    """Until when each move is off by more than 2 % of its way, a micro move by 10 um, s."""
    found = []
    for stage, place, target in _moves(recording, stages):
        band = 0.01 if stage == MICRO else 0.02 * abs(target[-1] - place[0])
        off = np.flatnonzero(np.abs(place - target[-1]) > band)
        found.append(1e-3 * (off[-1] + 1) if len(off) else 0.0)
    return found


def micro_steps(recording: Any, stages: Any) -> list[float]:
    """How far each move goes."""
    return [float(target[-1] - place[0]) for _, place, target in _moves(recording, stages)]


def worst_mean(recording: Any, stages: Any) -> float:
    """Largest mean error of a micro move in its last half second, mm."""
    moves = _moves(recording, stages)
    return max(abs(float(np.mean((p - t)[-500:]))) for s, p, t in moves if s == MICRO)


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
