"""Reports a silent laser without stopping."""

from __future__ import annotations

import math

from macromicro.control.live.messages import Event

PERIODS = 5  # without a value that count as silence


class Silence:
    """Watches the laser, if `present`."""

    def __init__(self, present: bool) -> None:
        self._present = present
        self._missing = 0

    def look(self, laser: float, time: float) -> Event | None:
        """The event of this reading: laser lost or back."""
        if not math.isnan(laser):
            was, self._missing = self._missing, 0
            if was < PERIODS or not self._present:
                return None
            return Event(time, "sensor", "", "", "laser back", {"silent_periods": was})
        self._missing += 1
        if self._missing != PERIODS or not self._present:
            return None
        words = "the position is now known to half a count only; the laser's column is empty"
        remedy = "clear its beam and check its controller; zero it again before use"
        return Event(time, "sensor", "", "", "laser lost", {"effect": words, "remedy": remedy})
