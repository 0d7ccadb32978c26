"""The computer's own clock, for a rig that has none."""

from __future__ import annotations

import math
import time


class Deadlines:
    """A clock of absolute deadlines: a period that is late does not move those after it.

    A period that is missed whole is left out, so that a loop that was held up does not run faster
    than its period to catch up.
    """

    def __init__(self) -> None:
        self._began = self._deadline = time.monotonic()

    def start(self) -> None:
        """Time begins now, and the first period."""
        self._began = self._deadline = time.monotonic()

    def now(self) -> float:
        """Time since the start.

        Returns
        -------
        float
            s.
        """
        return time.monotonic() - self._began

    def wait(self, dt: float) -> None:
        """Sleep until the next period begins.

        Parameters
        ----------
        dt : float
            Length of a period, s.
        """
        self._deadline += dt
        left = self._deadline - time.monotonic()
        if left > 0.0:
            time.sleep(left)
        else:
            self._deadline += math.floor(-left / dt) * dt
