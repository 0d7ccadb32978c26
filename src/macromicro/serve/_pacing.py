"""Absolute deadlines, lateness and missed periods."""

from __future__ import annotations

import ctypes
import math
import os
import time
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from macromicro.serve.settings import OFF, ServeSettings
from macromicro.serve.shared import BIN_S, BINS

Counts = NDArray[np.int64]

_PR_SET_TIMERSLACK = 29
_MCL_CURRENT, _MCL_FUTURE, _MCL_ONFAULT = 1, 2, 4
_NEAR = 1e-3  # of a period: how exactly a machine's time is told


class Histogram:
    """Times in bins of 1 us; the last bin is open."""

    def __init__(self, counts: Counts | None = None) -> None:
        self.counts: Counts = np.zeros(BINS, np.int64) if counts is None else counts
        self.largest = 0.0

    def add(self, seconds: float) -> None:
        """Count a time; a negative one as 0."""
        k = int(seconds * 1e6)
        self.counts[k if 0 <= k < BINS else (BINS - 1 if k > 0 else 0)] += 1
        self.largest = max(self.largest, seconds)

    def quantile(self, share: float) -> float:
        """The time that `share` (0..1) of the values do not exceed; NaN if there are none."""
        reached = np.cumsum(self.counts)
        total = int(reached[-1])
        if not total:
            return math.nan
        k = int(np.searchsorted(reached, max(math.ceil(share * total), 1)))
        return self.largest if k == BINS - 1 else min((k + 1) * BIN_S, self.largest)


class Pacer:
    """Absolute deadlines `dt` apart; a missed one is skipped."""

    def __init__(self, dt: float, window: int, counts: Counts | None = None) -> None:
        self.dt = dt
        self.periods = 0
        self.missed = 0
        self.lateness = Histogram(None if counts is None else counts[0])
        self.work = Histogram(None if counts is None else counts[1])
        self.late = 0.0
        self.worked = 0.0
        self._recent = bytearray(max(window, 1))
        self._place = 0
        self._in_window = 0
        self._deadline = self._woke = time.monotonic()

    def start(self) -> None:
        self._deadline = self._woke = time.monotonic()

    @property
    def share(self) -> float:
        """Share of missed periods in the last window."""
        return self._in_window / len(self._recent)

    def wait(self) -> int:
        """Sleep until the next period; the number of missed ones."""
        now = time.monotonic()
        self._end_work(now)
        self._deadline += self.dt
        left = self._deadline - now
        if left > 0.0:
            time.sleep(left)
        return self._begin(time.monotonic())

    def begun(self, began: float, passed: float = math.nan) -> int:
        """Begin a period after the rig's own clock has waited; the number of missed periods."""
        self._end_work(began)
        self._deadline = self._woke + self.dt
        if not math.isfinite(passed):
            return self._begin(time.monotonic())
        return self._begin(time.monotonic(), max(int(passed / self.dt + _NEAR) - 1, 0))

    def _end_work(self, now: float) -> None:
        self.worked = now - self._woke
        self.work.add(self.worked)

    def _begin(self, now: float, missed: int = -1) -> int:
        self._woke = now
        self.late = now - self._deadline
        self.lateness.add(self.late)
        if missed < 0:
            missed = int(self.late / self.dt) if self.late >= self.dt else 0
        self._deadline += missed * self.dt
        for _ in range(min(missed, len(self._recent))):
            self._note(1)
        self._note(0)
        self.missed += missed
        self.periods += missed + 1
        return missed

    def _note(self, missed: int) -> None:
        place = self._place
        self._in_window += missed - self._recent[place]
        self._recent[place] = missed
        self._place = (place + 1) % len(self._recent)

    def forget(self) -> None:
        """Empty the window."""
        self._recent = bytearray(len(self._recent))
        self._in_window = 0


class Privileges(NamedTuple):
    """What the system granted: policy, core (-1: any), timer slack [us], in words."""

    realtime: bool
    core: int
    words: str


def prepare(settings: ServeSettings) -> Privileges:
    """Request timely wake-ups (real-time priority, a core, locked memory); reports refusals."""
    words = []
    try:
        ctypes.CDLL(None).prctl(_PR_SET_TIMERSLACK, 1, 0, 0, 0)
    except (OSError, AttributeError, TypeError):  # other systems have no such call
        words.append("timer slack unchanged")
    realtime = False
    if settings.realtime != OFF and not hasattr(os, "sched_setscheduler"):
        words.append("soft timing: this system grants no real-time priority")
    elif settings.realtime != OFF:
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(settings.priority))
            realtime = True
            words.append(f"SCHED_FIFO priority {settings.priority}")
        except (OSError, AttributeError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            words.append(f"no real-time priority ({reason}; `macromicro doctor` says how)")
    else:
        words.append("real-time priority switched off")
    core = -1
    if settings.core >= 0:
        try:
            os.sched_setaffinity(0, {settings.core})
            core = settings.core
            words.append(f"bound to core {core}")
        except (OSError, AttributeError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            words.append(f"not bound to core {settings.core} ({reason})")
    words += _lock_memory() if realtime else []
    return Privileges(realtime, core, ", ".join(words))


def _lock_memory() -> list[str]:
    """Keep what the process has touched in memory: a page fetched from disk costs a period."""
    try:
        libc = ctypes.CDLL(None, use_errno=True)
        refused = libc.mlockall(_MCL_CURRENT | _MCL_FUTURE | _MCL_ONFAULT) != 0
    except (OSError, AttributeError, TypeError):  # other systems have no such call
        return ["memory not locked"]
    if not refused:
        return ["memory locked"]
    reason = os.strerror(ctypes.get_errno())
    return [f"memory not locked ({reason}; `ulimit -l`)"]
