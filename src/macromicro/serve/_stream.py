"""The streamed set points of one motion on their way to the loop."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

from macromicro.control.live import messages as m
from macromicro.control.live.accept import NOT_FOLLOWING
from macromicro.control.live.messages import Refused
from macromicro.serve.requests import place

if TYPE_CHECKING:
    from macromicro.serve._loop_connection import LoopConnection

LATEST, OLDEST = 1e12, 10.0  # s: of a client's clock; age of a set point that was delayed
DRIFT = 2e-4  # by which two clocks may differ in rate


class Stream:
    """Set points of a motion that follows `stages` of them; not thread-safe."""

    def __init__(self, motion: int = 0, stages: int = 1) -> None:
        self.motion, self._stages = motion, stages
        self._ahead = math.inf  # what this clock showed more than the client's, at least, s
        self._last, self._stamp = 0.0, -math.inf

    def take(
        self, loop: LoopConnection, point: m.SetPoint | m.SetPoints, stamp: float = math.nan
    ) -> Refused | None:
        """Show the loop a set point; one that was overtaken by a later one is left out."""
        found = place(point)
        if not all(math.isfinite(value) for pair in found for value in pair):
            return Refused("a set point is not finite", "give finite numbers", True)
        if len(found) != self._stages:
            reason = f"a set point of {len(found)} stages, where {self._stages} follow"
            return Refused(reason, "give the positions of those that follow")
        if not loop.under_way(self.motion):
            return NOT_FOLLOWING
        now = at = time.monotonic()
        if abs(stamp) > LATEST:
            return Refused("the time of a set point is not a time", f"up to {LATEST:g} s", True)
        if math.isfinite(stamp):
            if stamp <= self._stamp:
                return None
            self._ahead += DRIFT * (now - self._last)
            self._ahead = min(self._ahead, now - stamp)
            self._stamp, self._last = stamp, now
            at = min(max(stamp + self._ahead, now - OLDEST), now)
        loop.point(found, round(at * 1e9))
        return None
