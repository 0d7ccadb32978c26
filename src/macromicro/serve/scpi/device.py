"""What all SCPI clients share: the station, its settings and its newest rows."""

from __future__ import annotations

import math
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from macromicro.control.live.targets import reach
from macromicro.control.settings import Control
from macromicro.serve import following
from macromicro.serve.aims import aim, aimed
from macromicro.serve.guesses import Token
from macromicro.serve.shared import PERIOD

if TYPE_CHECKING:
    from macromicro.serve.settings import LiveSettings
    from macromicro.serve.station import Station

SPARE = 1000  # rows: for clocks that differ


class Device:
    """The instrument behind all connections.

    `folder`: where recordings go; `token`: what a client must give before it may change
    anything.
    """

    def __init__(
        self,
        station: Station,
        folder: Path = Path(),
        token: Token | None = None,
    ) -> None:
        self.station = station
        self.settings: LiveSettings = station.settings
        self.folder = folder
        self.token = token or Token(None)
        self._lock = threading.Lock()
        self._control: Control = self.settings.controller
        self._seen = -1
        self._followed, self._target = -1, math.nan
        self._newest = -1, 0.0  # number of the last row of telemetry, and when it was looked at

    # Positions

    def extreme(self, kind: str, which: str) -> float:
        """The lower ("MIN") or upper ("MAX") end of what is accepted now: of the whole, by what
        both stages reach together [m]; of the macro-stage [counts], of the micro-stage [mm]."""
        limits = self.station.snapshot().limits
        if kind == "whole":
            tolerance = self.control().sequence.tolerance
            return reach(self.settings.live, limits, tolerance)[which == "MAX"]
        return float(getattr(limits, f"{kind}_{'low' if which == 'MIN' else 'high'}"))

    def target(self) -> float:
        """Where the whole positioner is going or is held [m]; NaN where it is not."""
        with self._lock:
            self._followed, events = self.station.events(self._followed)
            for event in events:
                self._target = aimed(event, self._target)
            target = self._target
        return aim(self.station.snapshot(), target, self.settings.live.pitch)

    # Telemetry

    def newest(self, wanted: int) -> NDArray[np.float64]:
        """The last `wanted` rows of telemetry, or as many as there are: float64[columns, rows].

        Only what may be needed is copied: there is a new row every period at most, so since
        the last look no more of them can have come than periods have passed.
        """
        with self._lock:
            last, seen = self._newest
            now = time.monotonic()
            first = last + round((now - seen) / PERIOD) - wanted - SPARE if last >= 0 else -1
            last, rows, _ = self.station.telemetry(max(first, -1))
            if rows.shape[1] < wanted and first >= 0:
                last, rows, _ = self.station.telemetry()
            self._newest = last, now
        return rows[:, rows.shape[1] - min(wanted, rows.shape[1]) :]

    # Gains

    def control(self) -> Control:
        """The controller's settings in force, with what any client has changed."""
        with self._lock:
            self._seen, events = self.station.events(self._seen)
            for event in events:
                self._control = following.gains(self._control, event, self.settings.controller)
            return self._control
