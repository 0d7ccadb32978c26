"""Detects a silent loop."""

from __future__ import annotations

import time
from collections.abc import Callable

LOOKS = 10  # in the time that is allowed


class Pulse:
    """Measures silence by its own looks, so that a halt of this process does not count."""

    def __init__(self, allowed: float, count: int, now: float) -> None:
        self.pause = allowed / LOOKS
        self._count, self._looked = count, now
        self.silent = 0.0

    def look(self, count: int, now: float) -> float:
        """Silence at the time `now`, with the loop's period count."""
        passed = min(now - self._looked, 2.0 * self.pause)
        self._looked = now
        self.silent = self.silent + passed if count == self._count else 0.0
        self._count = count
        return self.silent


def silence(
    count: Callable[[], int],
    going: Callable[[], bool],
    most: Callable[[], float],
    allowed: float,
) -> float:
    """Watch while `going` until the count has stood for `most` seconds; the silence, or 0."""
    pulse = Pulse(allowed, count(), time.monotonic())
    while going():
        silent = pulse.look(count(), time.monotonic())
        if silent > most():
            return silent
        time.sleep(pulse.pause)
    return 0.0
