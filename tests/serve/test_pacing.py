"""Deadlines stay on their grid; what was late and what was missed is counted."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from typing import Any

import pytest

from macromicro.serve import _pacing
from macromicro.serve._pacing import Pacer
from macromicro.serve.settings import ServeSettings
from tests.systems import linux


class Time:
    """A clock that only moves by being told, or slept through; `over` is added to each sleep."""

    def __init__(self) -> None:
        self.now, self.over, self.slept = 100.0, 0.0, [0.0]

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.slept.append(seconds)
        self.now += seconds + self.over


@pytest.fixture
def time(monkeypatch: pytest.MonkeyPatch) -> Time:
    fake = Time()
    monkeypatch.setattr(_pacing, "time", fake)
    return fake


def test_deadlines_are_absolute(time: Time) -> None:
    pacer = Pacer(1e-3, 100)
    time.over = 0.2e-3
    for k in range(1, 51):
        time.now += 0.3e-3  # work
        assert pacer.wait() == 0
        assert time.now == pytest.approx(100.0 + k * 1e-3 + 0.2e-3)
    assert (pacer.periods, pacer.missed, pacer.share) == (50, 0, 0.0)
    assert pacer.late == pytest.approx(0.2e-3)
    assert pacer.latest == pytest.approx(0.2e-3)
    assert pacer.longest == pytest.approx(0.3e-3)


def test_missed_periods_are_counted_and_the_grid_stays(time: Time) -> None:
    pacer = Pacer(1e-3, 10)
    time.now += 3.4e-3
    assert pacer.wait() == 2  # periods 1 and 2 passed by; 3 begins 0.4 ms late
    assert (pacer.periods, pacer.missed) == (3, 2)
    assert pacer.share == 0.2
    assert pacer.wait() == 0
    assert time.now == pytest.approx(100.0 + 4e-3)
    for _ in range(10):
        pacer.wait()
    assert (pacer.share, pacer.missed) == (0.0, 2)


def test_a_long_halt_fills_the_window(time: Time) -> None:
    pacer = Pacer(1e-3, 10)
    time.now += 1.0005
    assert pacer.wait() == 999
    assert 0.8 < pacer.share < 1.0
    pacer.forget()
    assert pacer.share == 0.0


def test_a_rig_that_waits_by_its_own_clock_is_judged_by_its_beginnings(time: Time) -> None:
    pacer = Pacer(1e-3, 100)
    for _ in range(100):  # a clock that is 1 % slow drifts nowhere
        done = time.now = time.now + 0.2e-3
        time.now += 0.81e-3
        assert pacer.begun(done) == 0
    assert pacer.latest == pytest.approx(0.01e-3, abs=1e-9)
    done = time.now
    time.now += 5.5e-3
    assert pacer.begun(done) == 4


def test_the_machines_time_says_what_was_missed_where_it_is_told(time: Time) -> None:
    pacer = Pacer(1e-3, 100)
    found = []
    for periods in (1.0, 1.0 - 1e-9, 2.0 - 1e-9, 1.6, 4.0, -3.0, 0.0):
        time.now += 9e-3  # whatever the computer's clock says
        found.append(pacer.begun(time.now, periods * 1e-3))
    assert found == [0, 0, 1, 0, 3, 0, 0]
    assert (pacer.missed, pacer.periods, pacer.share) == (4, 11, 0.04)
    assert pacer.latest == pytest.approx(8e-3)
    time.now += 9.5e-3
    assert pacer.begun(time.now, math.nan) == 8  # a clock that gave nothing


def test_work_and_lateness_count_from_its_start(time: Time) -> None:
    pacer = Pacer(1e-3, 0)
    assert pacer.late == pacer.worked == 0.0
    time.now += 5e-3  # before it starts
    pacer.start()
    done = time.now = time.now + 20.5e-6
    time.now += 1e-3
    assert pacer.begun(done) == 0
    assert pacer.latest == pytest.approx(20.5e-6) and pacer.longest == pytest.approx(20.5e-6)
    time.now += 3.5e-3
    assert pacer.begun(time.now) == 2
    assert pacer.share == 0.0  # of a window of one period, the last


def test_what_is_forgotten_is_not_taken_off_again(time: Time) -> None:
    pacer = Pacer(1e-3, 10)
    time.now += 5.5e-3
    assert pacer.begun(time.now) == 4
    pacer.forget()
    for _ in range(12):
        time.now += 1e-3
        pacer.begun(time.now)
        assert pacer.share == 0.0


def test_what_is_permitted_is_asked_for_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []

    class Library:
        def __init__(self, name: None, *, use_errno: bool = False) -> None: ...

        def prctl(self, *values: int) -> None:
            asked.append(values)

        def mlockall(self, flags: int) -> int:
            asked.append(flags)
            return 0

    monkeypatch.setattr(_pacing.ctypes, "CDLL", Library)
    for name in ("sched_setscheduler", "sched_setaffinity"):
        monkeypatch.setattr(_pacing.os, name, lambda *values: asked.append(values))
    got = _pacing.prepare(ServeSettings(core=0, priority=7))
    timer, (process, policy, wanted), affinity, locked = asked
    assert timer == (29, 1, 0, 0, 0)  # PR_SET_TIMERSLACK of linux/prctl.h
    assert (process, policy, wanted.sched_priority) == (0, os.SCHED_FIFO, 7)
    assert affinity == (0, {0})
    assert locked == 1 | 2 | 4  # MCL_CURRENT, MCL_FUTURE, MCL_ONFAULT of sys/mman.h
    assert got.endswith("memory locked")


@linux
def test_memory_that_may_not_be_locked(monkeypatch: pytest.MonkeyPatch) -> None:
    """In a process of its own, with a limit below what Python takes."""
    text = (
        "import os, resource\n"
        "from macromicro.serve import _pacing\n"
        "os.sched_setscheduler = lambda *_: None\n"
        "resource.setrlimit(resource.RLIMIT_MEMLOCK, (4096, 4096))\n"
        "os.setegid(65534); os.seteuid(65534)\n"
        "print(_pacing.prepare(_pacing.ServeSettings()))\n"
    )
    if os.geteuid() != 0:
        text = text.replace("os.setegid(65534); os.seteuid(65534)\n", "")
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    assert "memory not locked (" in done.stdout and "ulimit -l" in done.stdout


@pytest.mark.parametrize("error", [OSError("odd"), AttributeError("odd")])
def test_a_refusal_without_the_system_s_words(
    error: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: Any) -> None:
        raise error

    for name in ("sched_setscheduler", "sched_setaffinity"):
        monkeypatch.setattr(_pacing.os, name, refuse)
    words = _pacing.prepare(ServeSettings(core=0))
    assert "no real-time priority (odd;" in words and "not bound to core 0 (odd)" in words


@pytest.mark.parametrize("realtime", ["auto", "off"])
def test_what_is_not_permitted_is_said(realtime: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any) -> None:
        raise PermissionError(1, "Operation not permitted")

    for name in ("sched_setscheduler", "sched_setaffinity"):
        monkeypatch.setattr(_pacing.os, name, refuse)
    got = _pacing.prepare(ServeSettings(realtime=realtime, core=0))
    assert "not bound to core 0 (Operation not permitted)" in got
    assert "Errno" not in got
    wanted = "macromicro doctor" if realtime == "auto" else "switched off"
    assert wanted in got
