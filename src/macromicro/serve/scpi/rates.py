"""What one client may use, and how what comes faster is held back."""

from __future__ import annotations

import asyncio
import time
from typing import NamedTuple

from macromicro.serve.scpi.framing import BLOCK_LIMIT, LINE_LIMIT


class Bounds(NamedTuple):
    """What one client may use. `clients`: at a time, all together; `messages`: waiting, of
    `waiting` bytes altogether; `line`, `block` [bytes]; `rate`: simple commands per second in
    the long run, `burst` of them at once; `unread` [s]: for which a client may leave its
    answers unread, or a block without its next byte."""

    clients: int = 16
    messages: int = 64
    waiting: int = 4 * BLOCK_LIMIT
    line: int = LINE_LIMIT
    block: int = BLOCK_LIMIT
    rate: float = 500.0
    burst: float = 500.0
    unread: float = 10.0


class Bucket:
    """Delays what comes faster than `rate` for longer than `burst` (a token bucket)."""

    def __init__(self, rate: float, burst: float) -> None:
        self._rate, self._burst = rate, burst
        self._level = burst
        self._time = time.monotonic()

    async def take(self, cost: float) -> None:
        """Return once `cost` is within the rate."""
        now = time.monotonic()
        self._level = min(self._burst, self._level + (now - self._time) * self._rate)
        self._time = now
        self._level -= cost
        if self._level < 0.0:
            await asyncio.sleep(-self._level / self._rate)
