"""A channel whose silence stops nothing, and is reported."""

from __future__ import annotations

import math

from macromicro.control.live.messages import Event

PERIODS = 5  # without a value that count as silence


class Silence:
    """Watches the laser of a rig that has one. `present`: has it?"""

    def __init__(self, present: bool) -> None:
        self._present = present
        self._missing = 0

    def look(self, laser: float, time: float) -> Event | None:
        """What is to be reported after this reading [m]: that it fell silent, that it is back."""
        if not math.isnan(laser):
            was, self._missing = self._missing, 0
            if was < PERIODS or not self._present:
                return None
            return Event(time, "sensor", "", "", "laser back", {"silent_periods": was})
        self._missing += 1
        if self._missing != PERIODS or not self._present:
            return None
        words = "the position is known to half a count from here on; its column is empty"
        remedy = "clear its beam, see that its controller is on; zero it again before use"
        return Event(time, "sensor", "", "", "laser lost", {"effect": words, "remedy": remedy})
