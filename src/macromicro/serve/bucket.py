"""A token bucket for rate limits."""

from __future__ import annotations

import asyncio
import time


class Bucket:
    def __init__(self, rate: float, burst: float) -> None:
        self._rate, self._burst = rate, burst
        self._level, self._time = burst, time.monotonic()

    def spend(self, cost: float = 1.0) -> float:
        """Take `cost`; the seconds to wait until the rate allows it."""
        now = time.monotonic()
        level = self._level + (now - self._time) * self._rate
        self._level, self._time = min(level, self._burst) - cost, now
        return max(-self._level / self._rate, 0.0)

    async def take(self, cost: float) -> None:
        """Take `cost`; waits, and yields to the event loop, until the rate allows it."""
        await asyncio.sleep(self.spend(cost))
