"""What a recording tells of its settings is what its moves are judged by."""

from __future__ import annotations

import pytest

from macromicro import Settings, api
from macromicro.recording import Recording
from macromicro.runs import judging

FINER = Settings().with_(
    {"sensors.encoder.pitch": "35.7 um", "controller.sequence.tolerance": "3 counts"}
)


@pytest.fixture(scope="module")
def run() -> Recording:
    return api.run("staircase", settings=FINER)


def test_settings_are_read_back(run: Recording) -> None:
    assert judging.settings_of(run) == FINER


def test_moves_need_no_settings(run: Recording) -> None:
    """With an encoder of half the pitch the targets in mm are halves of what the nominal says."""
    assert api.moves(run) == api.moves(run, FINER) != api.moves(run, Settings())
    macro = next(m for m in api.moves(run) if m.stage == "macro")
    assert macro.band == pytest.approx(3 * 35.7e-3)


@pytest.mark.parametrize(
    "text", ["", "[[", "[gone]\nx = 1", "[bench.friction]\ncoulomb = '3 V'", 7]
)
def test_what_is_told_otherwise_is_the_default(text: object) -> None:
    """As by another version, or by nobody."""
    assert judging.settings_of(Recording((), 0, 1e-3, {"settings": text}, {})) == Settings()
