"""What all SCPI clients share: the station, its settings, the limits set here."""

from __future__ import annotations

import hmac
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from macromicro.control.live.parameters import SoftLimits
from macromicro.control.settings import Control
from macromicro.parameters import entries, replaced
from macromicro.serve.scpi.errors import ScpiError
from macromicro.serve.shared import PERIOD

if TYPE_CHECKING:
    from macromicro.serve.settings import LiveSettings
    from macromicro.serve.station import Station

SPARE = 1000  # rows: for clocks that differ


class Device:
    """The instrument behind all connections.

    `folder`: where recordings go; `token`: what a client must give before it may change
    anything, None for nothing.
    """

    def __init__(
        self,
        station: Station,
        folder: Path = Path(),
        token: str | None = None,
    ) -> None:
        self.station = station
        self.settings: LiveSettings = station.settings
        self.folder = folder
        self._token = token
        self._lock = threading.Lock()
        self._limits = self.settings.live.limits
        self._control: Control = self.settings.controller
        self._seen = -1
        self._newest = -1, 0.0  # number of the last row of telemetry, and when it was looked at

    @property
    def open(self) -> bool:
        """May every client change things, without a token?"""
        return self._token is None

    def admits(self, token: str) -> bool:
        """Is it the token? In a time that does not depend on where it differs."""
        wanted = self._token or ""
        return hmac.compare_digest(token.encode(), wanted.encode()) and bool(wanted)

    # Soft limits

    @property
    def limits(self) -> SoftLimits:
        """In force for SCPI clients: the machine's own, or narrower ones."""
        return self._limits

    @property
    def narrowed(self) -> bool:
        """Are they narrower than the machine's own?"""
        return self._limits != self.settings.live.limits

    def set_limits(self, kind: str, low: float, high: float) -> None:
        """New limits of "macro" [counts], "micro" [mm] or "whole" [m], within the machine's.

        Raises ScpiError -222.
        """
        own = self.settings.live.limits
        lowest, highest = getattr(own, f"{kind}_low"), getattr(own, f"{kind}_high")
        if not lowest <= low < high <= highest:
            accepted = f"from {lowest:g} to {highest:g}, the lower one first"
            raise ScpiError(-222, f"{low:g} to {high:g}; accepted: {accepted}")
        with self._lock:
            changed = {f"{kind}_low": low, f"{kind}_high": high}
            self._limits = self._limits._replace(**changed)

    def reset_limits(self) -> None:
        """The machine's own limits again."""
        self._limits = self.settings.live.limits

    def check(self, kind: str, value: float, margin: float = 0.0) -> None:
        """ScpiError -222 unless `value` is within the limits of its kind by `margin`."""
        low = getattr(self._limits, f"{kind}_low")
        high = getattr(self._limits, f"{kind}_high")
        if not low + margin <= value <= high - margin:
            # In the unit that a person reads: counts, mm, mm.
            scale, unit = {"macro": (1.0, "counts"), "micro": (1.0, "mm"), "whole": (1e3, "mm")}[
                kind
            ]
            found = f"{value * scale:.6g} {unit}"
            raise ScpiError(
                -222, f"{found}; accepted: {low * scale:.6g} to {high * scale:.6g} {unit}"
            )

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
            known = {e.path for e in entries(self._control)}
            for event in events:
                for path, change in event.evidence.items() if event.kind == "gains" else ():
                    if path in known:
                        self._control = replaced(self._control, path, change["new"])
            return self._control
