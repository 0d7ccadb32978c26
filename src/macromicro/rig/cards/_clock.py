"""A software clock for rigs without one."""

from __future__ import annotations

import math
import time


class Deadlines:
    """A clock of absolute deadlines: late periods shift no later ones, missed ones are skipped."""

    def __init__(self) -> None:
        self._began = self._deadline = time.monotonic()

    def start(self) -> None:
        self._began = self._deadline = time.monotonic()

    def now(self) -> float:
        return time.monotonic() - self._began

    def wait(self, dt: float) -> None:
        self._deadline += dt
        left = self._deadline - time.monotonic()
        if left > 0.0:
            time.sleep(left)
        else:
            self._deadline += math.floor(-left / dt) * dt
