"""A rig that blocks, a loop process that is killed: seen at once, the rig stopped by another
process, and nothing told that nobody knows."""

from __future__ import annotations

import math
import os
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from serve_parts import BAD_STOP, DEAF, HANGS, LEFT, MOTOR, PID, STOPS, begun, outcome

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Refused
from macromicro.recording import Recording
from macromicro.serve import _safing, faults, persist
from macromicro.serve._loop_connection import Pulse
from macromicro.serve.station import Station
from tests.systems import posix
from tests.waiting import until

Make = Callable[..., Station]


@pytest.fixture
def hung(
    station: Make, log: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., tuple[Station, int]]:
    """A machine that moved with 1 V on its motor, and was recorded, until its readings hung."""

    def make(**env: str) -> tuple[Station, int]:
        hangs = tmp_path / "hangs"
        monkeypatch.setenv(HANGS, str(hangs))
        for name, value in env.items():
            monkeypatch.setenv(name, value)
        machine = station(loop_timeout=0.5)
        machine.start()
        machine.acquire("test")
        machine.request("test", m.Home())  # trusted
        motion = begun(machine)
        until(lambda: log[MOTOR] == 1.0)
        machine.record(tmp_path / "run.h5")
        hangs.touch()
        return machine, motion

    return make


def test_a_rig_that_blocks_is_ended_and_stopped(
    hung: Callable[..., tuple[Station, int]], log: Any, tmp_path: Path
) -> None:
    machine, motion = hung()
    assert outcome(machine, motion) == "fault"
    now = machine.snapshot()
    assert (now.running, now.mode, now.trusted, now.uncertainty_m) == (
        False,
        "off",
        False,
        math.inf,
    )
    assert now.fault is not None and now.fault.code == faults.LOOP_SILENT
    assert "motor 1.00 V" in now.fault.evidence and "serve.loop_timeout" in now.fault.remedy
    until(lambda: not machine.snapshot().recording.active)
    assert (log[MOTOR], log[LEFT]) == (0.0, 1.0)
    now = machine.snapshot()
    assert now.fault is not None
    assert "ended by SIGTERM; the rig's stop returned" in now.fault.evidence
    assert "nothing read the outputs back" in now.fault.evidence
    assert now.motor_v == 0.0
    assert isinstance(machine.request("test", m.Enable()), Refused)
    ended = Recording.load(tmp_path / "run.h5").attributes["ended"]
    assert "no period for" in str(ended) and "motor 1.00 V" in str(ended)


def test_silence_is_seen_within_half_a_second(
    hung: Callable[..., tuple[Station, int]], log: Any
) -> None:
    machine, motion = hung()
    shared = machine._connection.shared
    assert shared is not None
    until(lambda: machine.snapshot().fault)
    assert 0.5 < machine.snapshot().age_s < 1.5
    assert outcome(machine, motion) == "fault"


@posix
def test_a_rig_that_cannot_be_interrupted_is_stopped_by_another_process(
    hung: Callable[..., tuple[Station, int]], log: Any, tmp_path: Path
) -> None:
    machine, motion = hung(**{DEAF: "1"})
    pid = int(log[PID])
    assert outcome(machine, motion) == "fault"
    assert log[MOTOR] == 1.0 or machine.snapshot().motor_v == 0.0  # nobody has told it yet
    until(lambda: log[STOPS] and log[LEFT])
    assert log[MOTOR] == 0.0 and int(log[PID]) not in (pid, os.getpid())
    until(lambda: "a fresh process opened the rig" in machine.snapshot().fault.evidence)  # type: ignore[union-attr]
    fault = machine.snapshot().fault
    assert fault is not None
    assert "SIGKILL" in fault.evidence and "nothing read the outputs back" in fault.evidence


@pytest.mark.parametrize(("how", "why"), [("raises", "no board answers"), ("hangs", "in 2 s")])
def test_what_cannot_be_stopped_is_said_and_shown_as_unknown(
    how: str,
    why: str,
    hung: Callable[..., tuple[Station, int]],
    log: Any,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if how == "hangs":
        monkeypatch.setattr(_safing, "LIMIT_S", 2.0)
        limited = f"from macromicro.serve import _safing\n_safing.LIMIT_S = 2.0\n{_safing._CODE}"
        monkeypatch.setattr(_safing, "_CODE", limited)
    machine, motion = hung(**{DEAF: "1", BAD_STOP: how})
    assert outcome(machine, motion) == "fault"
    until(lambda: "may still be as last written" in machine.snapshot().fault.evidence, 30.0)  # type: ignore[union-attr]
    now = machine.snapshot()
    assert now.fault is not None
    assert why in now.fault.evidence and "motor 1.00 V" in now.fault.evidence
    assert "switch its supply off" in now.fault.remedy
    assert math.isnan(now.motor_v) and math.isnan(now.ctrl_v)
    assert log[MOTOR] == 1.0


@posix
def test_a_killed_loop_leaves_a_rig_that_another_process_stops(
    station: Make, log: Any, tmp_path: Path
) -> None:
    machine = station()
    machine.start()
    machine.acquire("test")
    machine.request("test", m.Home())
    until(lambda: machine.snapshot().trusted)
    motion = begun(machine)
    until(lambda: log[MOTOR] == 1.0)
    os.kill(int(log[PID]), signal.SIGKILL)
    assert outcome(machine, motion) == "lost"
    now = machine.snapshot()
    assert not now.trusted and math.isinf(now.uncertainty_m)
    until(lambda: log[LEFT])
    assert log[MOTOR] == 0.0
    until(lambda: machine.snapshot().motor_v == 0.0)
    fault = machine.snapshot().fault
    assert fault is not None
    assert "motor 1.00 V" in fault.evidence and "signal 9" in fault.evidence


@posix
def test_a_loop_killed_at_rest_leaves_no_trust_behind(
    station: Make, log: Any, tmp_path: Path
) -> None:
    machine = station()
    machine.start()
    machine.acquire("test")
    machine.request("test", m.Home())
    path = tmp_path / "position.json"
    until(lambda: getattr(persist.load(path), "trusted", False))
    os.kill(int(log[PID]), signal.SIGKILL)
    until(lambda: not getattr(persist.load(path), "trusted", True))
    until(lambda: "fresh process opened" in str(machine.snapshot().fault))
    kept = persist.load(path)
    assert isinstance(kept, persist.Kept) and "without closing" in kept.why


def test_silence_counts_only_what_was_looked_at() -> None:
    pulse = Pulse(0.5, 7, 0.0)
    assert pulse.look(7, 0.05) == pytest.approx(0.05)
    assert pulse.look(7, 60.0) == pytest.approx(0.15)  # we were halted, not the loop
    assert pulse.look(8, 60.05) == 0.0
    for k in range(1, 12):
        silent = pulse.look(8, 60.05 + 0.05 * k)
    assert silent == pytest.approx(0.55)


def test_a_loop_that_keeps_its_time_is_left_alone(station: Make, log: Any) -> None:
    machine = station(loop_timeout=0.5)
    machine.start()
    motion = begun(machine)
    time.sleep(1.5)
    assert machine.snapshot().motion == motion and machine.snapshot().running
