"""How long the loop has shown no period, as far as this process was awake to see it."""

from __future__ import annotations

import time
from collections.abc import Callable

LOOKS = 10  # in the time that is allowed


class Pulse:
    """Counts silence by its own looks. `allowed` [s]: look every `pause` [s] at least.

    A serving process that was halted (or a computer that slept) sees an old count when it
    goes on; that time is not counted, for the loop may have been halted as well.
    """

    def __init__(self, allowed: float, count: int, now: float) -> None:
        self.pause = allowed / LOOKS
        self._count, self._looked = count, now
        self.silent = 0.0

    def look(self, count: int, now: float) -> float:
        """Silence [s] so far, at the time `now` [s], the loop having counted to `count`."""
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
    """Watch while `going`, until the count has stood for longer than `most` [s]: for how long
    it has; 0 where it went on to the end. `allowed` [s]: the least that `most` may be."""
    pulse = Pulse(allowed, count(), time.monotonic())
    while going():
        silent = pulse.look(count(), time.monotonic())
        if silent > most():
            return silent
        time.sleep(pulse.pause)
    return 0.0
