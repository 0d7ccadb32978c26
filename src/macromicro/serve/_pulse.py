"""Detects a silent loop."""

from __future__ import annotations

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
