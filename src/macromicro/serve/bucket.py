"""A token bucket: how much may pass in the long run, and how much at once."""

from __future__ import annotations

import asyncio
import time


class Bucket:
    """Lets `rate` a second through, and `burst` at once."""

    def __init__(self, rate: float, burst: float) -> None:
        self._rate, self._burst = rate, burst
        self._level, self._time = burst, time.monotonic()

    def spend(self, cost: float = 1.0) -> float:
        """Take `cost` out; seconds until that is within the rate, 0 if it is now."""
        now = time.monotonic()
        level = self._level + (now - self._time) * self._rate
        self._level, self._time = min(level, self._burst) - cost, now
        return max(-self._level / self._rate, 0.0)

    async def take(self, cost: float) -> None:
        """Take `cost` out; returns once that is within the rate. All others of this event
        loop get their turn meanwhile, also where nothing has to be waited for."""
        await asyncio.sleep(self.spend(cost))
