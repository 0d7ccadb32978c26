"""The station when something fails: always safe, always in words."""

from __future__ import annotations

import math
import os
import signal
import time
from collections.abc import Callable
from typing import Any

import pytest
from serve_parts import FAIL_AT, LEFT, MOTOR, PID, begun, causes, outcome

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Refused
from macromicro.rig import codes
from macromicro.serve import faults
from macromicro.serve.station import Station
from tests.systems import posix
from tests.waiting import until

Make = Callable[..., Station]


@posix
def test_a_killed_loop_is_told_and_its_motions_are_lost(station: Make, log: Any) -> None:
    machine = station()
    machine.start()
    motion = begun(machine)
    until(lambda: log[MOTOR] == 1.0)
    os.kill(int(log[PID]), signal.SIGKILL)
    assert outcome(machine, motion) == "lost"
    now = machine.snapshot()
    assert (now.running, now.mode) == (False, "off")
    assert now.fault is not None
    assert now.fault.code == faults.LOOP_DIED
    assert "signal 9" in now.fault.evidence
    assert isinstance(machine.request("test", m.Enable()), Refused)
    assert math.isnan(machine.emergency())
    machine.start()  # the remedy
    assert machine.snapshot().fault is None
    until(lambda: "interrupted" in machine.snapshot().trust)
    assert causes(machine, "loop") == ["started", "rig stopped", "died", "started"]


@posix
def test_a_loop_told_to_end_leaves_safe(station: Make, log: Any) -> None:
    machine = station()
    machine.start()
    motion = begun(machine)
    until(lambda: log[MOTOR] == 1.0)
    os.kill(int(log[PID]), signal.SIGINT)  # Ctrl-C is the serving process' business
    time.sleep(0.1)
    assert machine.snapshot().motion == motion
    os.kill(int(log[PID]), signal.SIGTERM)
    assert outcome(machine, motion) == "lost"
    assert (log[MOTOR], log[LEFT]) == (0.0, 1.0)


def test_a_rig_that_fails_is_told_in_words(
    station: Make, log: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(FAIL_AT, "600")
    machine = station()
    machine.start()
    motion = begun(machine)
    assert outcome(machine, motion) == "fault"
    assert (log[MOTOR], log[LEFT]) == (0.0, 1.0)
    fault = machine.snapshot().fault
    assert fault is not None
    assert fault.code == faults.RIG_FAILED
    assert "the A/D board was unplugged" in fault.evidence
    assert fault.remedy


@posix
def test_a_loop_that_gets_no_time_stops_with_a_fault(station: Make, log: Any) -> None:
    machine = station(miss_share=0.1, miss_window=1.0)
    machine.start()
    machine.acquire("test")
    machine.request("test", m.Enable())
    motion = begun(machine)
    until(lambda: log[MOTOR] == 1.0)
    os.kill(int(log[PID]), signal.SIGSTOP)
    time.sleep(0.4)  # no longer than serve.loop_timeout
    os.kill(int(log[PID]), signal.SIGCONT)
    assert outcome(machine, motion) == "fault"
    until(lambda: log[MOTOR] == 0.0)
    until(lambda: machine.snapshot().fault is not None)
    now = machine.snapshot()
    assert now.fault is not None
    assert now.fault.code == faults.LATE
    assert "serve.miss_share" in now.fault.remedy
    assert now.mode == "fault"
    assert now.pace.missed > 100


@posix
def test_a_few_missed_periods_are_counted_and_nothing_stops(station: Make, log: Any) -> None:
    machine = station()  # its share is 1: never
    machine.start()
    motion = begun(machine)
    before = machine.snapshot().pace
    os.kill(int(log[PID]), signal.SIGSTOP)
    time.sleep(0.2)
    os.kill(int(log[PID]), signal.SIGCONT)
    until(lambda: machine.snapshot().pace.missed >= before.missed + 100)
    assert machine.snapshot().motion == motion
    assert machine.snapshot().pace.latest_s > 0.1


def test_the_guards_fault_is_told_in_words_and_cleared(station: Make, log: Any) -> None:
    machine = station()
    machine.start()
    motion = begun(machine)
    machine.request("test", m.SetGains(()))  # the stand-in then asks for 99 V
    assert outcome(machine, motion) == "fault"
    until(lambda: machine.snapshot().fault is not None)
    now = machine.snapshot()
    assert now.fault is not None
    assert (now.fault.code, now.mode, log[MOTOR]) == (codes.ILLEGAL, "fault", 0.0)
    assert "99" in now.fault.evidence
    assert "guard.motor" in now.fault.remedy
    assert isinstance(machine.request("test", m.MoveTo(1.0)), Refused)
    assert isinstance(machine.request("test", m.ClearFault()), Accepted)
    until(lambda: machine.snapshot().fault is None)
    assert outcome(machine, begun(machine, 0.05)) == "done"
