"""The firmware's core on a Cortex-M4F in QEMU: nothing in it clings to AVR."""

from __future__ import annotations

from contextlib import AbstractContextManager

import numpy as np
import pytest

from macromicro.rig.board import protocol
from macromicro.rig.board._link import BoardError
from macromicro.rig.board.protocol import SPEC
from macromicro.rig.board.rig import BoardRig
from macromicro.types import SAFE, Command, Outputs
from tests.firmware.built import Wire, arm, board, needs_arm, needs_avr

pytestmark = needs_arm
PUSH = Outputs(4.0, 1.0, 0.0, 0.0)


def _drive(rig: BoardRig, outputs: Outputs, periods: int) -> None:
    for _ in range(periods):
        rig.read()
        rig.write(outputs)
        rig.wait(1e-3)


def test_it_says_which_board_it_is_and_takes_all_parameters() -> None:
    with arm() as (rig, _):
        assert protocol.BOARDS[rig.identity["board"]] == "mps2"
        _drive(rig, PUSH, 3)
        told = rig.status()
        assert told["fault"] == 0 and 100 < told["cycles"] < 25_000
        assert 100 < told["stack"] < 2_000 < told["free"]


@pytest.mark.slow
def test_the_count_is_that_of_the_bench_after_moves_both_ways() -> None:
    with arm() as (rig, wire):
        for volts in (5.0, -5.0, 4.0, -4.5):
            _drive(rig, Outputs(volts, 0.0, 0.0, 0.0), 150)
        _drive(rig, SAFE, 400)
        assert abs(rig.read().encoder) > 5
        assert rig.read().encoder == wire.bench._place
        assert rig.status()["skipped"] == 0


@pytest.mark.slow
def test_silence_decelerates_and_then_stops() -> None:
    with arm() as (rig, wire):
        _drive(rig, PUSH, 100)
        began = len(wire.trace)
        wire.alone(SPEC["silence"] + SPEC["decelerate"] + 100)
        motor, ctrl, enabled = np.array(wire.trace[began:]).T
        assert motor[SPEC["silence"] - 10] == pytest.approx(4.0, abs=0.02)
        assert np.all(ctrl[SPEC["silence"] + 5 :] == 0.0)
        assert not np.any(motor[-50:]) and not np.any(enabled[-50:])
        with pytest.raises(BoardError, match="the host was silent"):
            _drive(rig, PUSH, 2)


@pytest.mark.slow
def test_a_reset_in_motion_stops_and_the_estimated_heat_stays() -> None:
    with arm() as (rig, wire):
        _drive(rig, Outputs(4.0, 1.9, 0.0, 0.0), 300)
        hot = rig.status()["temperature"]
        wire.bench.avr.reset()
        began = len(wire.trace)
        for _ in range(50):
            wire.write(protocol.encode("outputs", 0, sample=0, motor=4.0, ctrl=1.0))
        assert not np.any(np.array(wire.trace[began:]))
        assert hot > 60.0 and rig.status()["temperature"] > 0.7 * hot
        with pytest.raises(BoardError, match="parameters"):
            rig.link.ask("begin", "done", parameters=1)


@pytest.mark.slow
def test_a_cut_line_of_the_encoder_is_found_by_the_boards_guard() -> None:
    with arm() as (rig, wire):
        _drive(rig, PUSH, 50)
        wire.bench.cut = "encoder_b"
        with pytest.raises(BoardError, match="the board stopped"):
            _drive(rig, PUSH, 1000)


def _moved(made: AbstractContextManager[tuple[BoardRig, Wire]]) -> tuple[list[float], list[float]]:
    """Places by the encoder, and contractions by the Hall sensor, of both stages under control."""
    with made as (rig, _):
        places, volts = [], []
        for k in range(900):
            seen = rig.read()
            places.append(seen.encoder)
            volts.append(seen.hall)
            rig.aim(Command(1000.0, 1.0, 1e-3, float(k > 100), 0.0))
            rig.write(SAFE)
            rig.wait(1e-3)
        assert rig.status()["fault"] == 0
    return places, volts


@needs_avr
def test_both_processors_make_the_same_move() -> None:
    (theirs, hall), (ours, volts) = _moved(arm("board")), _moved(board("board"))
    assert ours[-1] == theirs[-1] == pytest.approx(1000.0, abs=1.0)
    # Edges of a period come to the one within it, to the other behind it.
    assert np.abs(np.subtract(theirs, ours)).max() <= np.abs(np.diff(ours)).max()
    assert np.mean(hall[-20:]) == pytest.approx(np.mean(volts[-20:]), abs=2e-3)  # V
