"""A rig whose cable is pulled and plugged in again: the server opens it by itself, nothing moves,
and the position has to be found anew."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from serve_parts import FAIL_AT, MOTOR, PID, STEPS, UNPLUGGED, begun, causes, outcome

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Refused
from macromicro.serve import faults, persist
from macromicro.serve.station import Station
from tests.systems import posix
from tests.waiting import until

Make = Callable[..., Station]
FIRST_S = 0.1  # between two tries


@pytest.fixture(autouse=True)
def soon(monkeypatch: pytest.MonkeyPatch) -> None:
    """A rig is tried again after a moment."""
    monkeypatch.setattr("macromicro.serve.station.REOPEN_S", FIRST_S)


@pytest.fixture
def cable(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A file; the rig is unplugged while it exists."""
    path = tmp_path / "unplugged"
    monkeypatch.setenv(UNPLUGGED, str(path))
    return path


def test_a_rig_that_is_plugged_in_again_is_opened_again(
    station: Make, log: Any, cable: Path, tmp_path: Path
) -> None:
    machine = station()
    machine.start()
    machine.acquire("test")
    machine.request("test", m.Home())
    until(lambda: machine.snapshot().trusted)
    motion = begun(machine)
    until(lambda: log[MOTOR] == 1.0)
    last, _, _ = machine.telemetry()
    cable.touch()
    assert outcome(machine, motion) == "fault"
    until(lambda: machine.snapshot().fault is not None)
    until(lambda: "could not stop the rig" in machine.snapshot().fault.evidence)  # type: ignore[union-attr]
    now = machine.snapshot()
    assert now.fault is not None and now.fault.code == faults.RIG_FAILED
    assert "no such device" in now.fault.evidence and "opens the rig again" in now.fault.remedy
    assert (now.running, now.mode, now.trusted) == (False, "off", False)
    assert isinstance(machine.request("test", m.Enable()), Refused)
    time.sleep(10.0 * FIRST_S)  # tries that fail leave all this as it is
    assert not machine.snapshot().running and machine.snapshot().fault == now.fault
    log[MOTOR] = 7.0  # as last written, for all that anybody knows
    cable.unlink()
    until(lambda: machine.snapshot().running)
    until(lambda: machine.snapshot().pace.periods)
    now = machine.snapshot()
    assert (now.fault, now.mode, now.trusted, now.motion) == (None, "disabled", False, 0)
    assert log[MOTOR] == 0.0
    row, block, _ = machine.telemetry(last + 1_000_000)
    assert row >= 0 and block.shape[1] == 0  # rows begin at 0 again, before those of old
    assert machine.telemetry(-1)[1].shape[1] > 0
    until(lambda: causes(machine, "loop")[-2:] == ["started", "rig back"])
    assert outcome(machine, begun(machine, 0.05)) == "done"


def test_no_place_is_kept_behind_a_rig_that_failed(
    station: Make, log: Any, cable: Path, tmp_path: Path
) -> None:
    """It rested and was trusted: what was moved by hand meanwhile nobody counted."""
    machine = station()
    machine.start()
    machine.acquire("test")
    machine.request("test", m.Home())
    path = tmp_path / "position.json"
    until(lambda: isinstance(kept := persist.load(path), persist.Kept) and kept.trusted)
    cable.touch()
    until(lambda: not machine.snapshot().running)
    until(lambda: isinstance(kept := persist.load(path), persist.Kept) and not kept.trusted)
    cable.unlink()
    until(lambda: machine.snapshot().running)
    until(lambda: machine.snapshot().pace.periods)
    assert not machine.snapshot().trusted


@pytest.mark.slow
def test_a_rig_that_fails_each_time_is_tried_less_often(
    station: Make, log: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(FAIL_AT, "50")
    machine = station()
    machine.start()
    until(lambda: causes(machine, "loop").count("rig back") >= 2)
    machine.stop()  # also in the middle of a try
    count = causes(machine, "loop").count("rig back")
    time.sleep(10.0 * FIRST_S)
    assert causes(machine, "loop").count("rig back") == count
    assert not machine.snapshot().running


@posix
def test_a_loop_that_was_killed_is_not_started_by_itself(station: Make, log: Any) -> None:
    """Nobody knows why it died; a rig that answers is no reason to go on."""
    machine = station()
    machine.start()
    until(lambda: log[STEPS] > 10)
    os.kill(int(log[PID]), signal.SIGKILL)
    until(lambda: not machine.snapshot().running)
    time.sleep(10.0 * FIRST_S)
    assert not machine.snapshot().running
    machine.start()
    assert isinstance(machine.acquire("test"), Accepted)
