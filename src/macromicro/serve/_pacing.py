"""Absolute deadlines, lateness and missed periods."""

from __future__ import annotations

import ctypes
import math
import os
import time

from macromicro.serve.settings import OFF, ServeSettings

_PR_SET_TIMERSLACK = 29
_MCL_CURRENT, _MCL_FUTURE, _MCL_ONFAULT = 1, 2, 4
_NEAR = 1e-3  # of a period: how exactly a machine's time is told


class Pacer:
    """Absolute deadlines `dt` apart; a missed one is skipped."""

    def __init__(self, dt: float, window: int) -> None:
        self.dt = dt
        self.periods = 0
        self.missed = 0
        self.late = self.latest = 0.0  # how late the last period began, and the latest one
        self.worked = self.longest = 0.0  # how long the last one computed, and the longest one
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
        self.longest = max(self.longest, self.worked)

    def _begin(self, now: float, missed: int = -1) -> int:
        self._woke = now
        self.late = now - self._deadline
        self.latest = max(self.latest, self.late)
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


def prepare(settings: ServeSettings) -> str:
    """Request timely wake-ups (real-time priority, a core, locked memory); what was granted."""
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
    if settings.core >= 0:
        try:
            os.sched_setaffinity(0, {settings.core})
            words.append(f"bound to core {settings.core}")
        except (OSError, AttributeError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            words.append(f"not bound to core {settings.core} ({reason})")
    words += _lock_memory() if realtime else []
    return ", ".join(words)


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
