"""The machine as the clients of one protocol share it."""

from __future__ import annotations

import math
import tempfile
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from macromicro.columns import Column
from macromicro.control.live import messages as m
from macromicro.control.live.parameters import SoftLimits
from macromicro.control.live.targets import reach
from macromicro.errors import InputError
from macromicro.place import Place
from macromicro.serve import telling
from macromicro.serve._programmes import Planned, error_under_name
from macromicro.serve.hosts import Token

if TYPE_CHECKING:
    from macromicro.serve.settings import AnySettings
    from macromicro.serve.station import Station

SPARE = 1000  # rows: for clocks that differ


class Instrument:
    """The station, its token, limits, programmes and newest telemetry; thread-safe."""

    def __init__(self, station: Station, folder: Path = Path(), token: Token | None = None) -> None:
        self.station = station
        self.settings: AnySettings = station.settings
        self.folder = folder
        self.token = token or Token(None)
        self._lock = threading.Lock()
        self._newest = -1, 0.0  # number of the last row of telemetry, and when it was looked at

    def admission(self, given: object, name: str, address: str, *, known: bool = False) -> str:
        """Why a client is refused, or ""; attempts are logged."""
        problem = self.token.problem(given, address, known=known)
        if problem:
            self.station.trail.client("token", name, problem)
        return problem

    # In force

    @property
    def place(self) -> Place:
        return self.settings.live.place

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the stages of a machine of several."""
        return tuple(name for name, _ in self.settings.axes)

    @property
    def period(self) -> float:
        return self.settings.period

    @property
    def law_columns(self) -> tuple[Column, ...]:
        """Telemetry columns of the law's memory."""
        return self.settings.law_columns

    @property
    def control(self) -> Any:
        """The controller's settings in force."""
        return self.station.in_force.control

    def speed(self, stage: str) -> float:
        """Maximum speed of moves of a stage [m/s]; NaN if its law sets the speed."""
        return self.station.in_force.speed(stage)

    def limit(self, kind: str, which: str) -> float:
        """The lower ("MIN") or upper ("MAX") limit in force: m, or counts of the macro-stage."""
        if kind not in telling.PARTS:  # a named stage
            axes = (a for a in self.station.snapshot().axes if a.name == kind)
            return next((a.high_m if which == "MAX" else a.low_m for a in axes), math.nan)
        limits = self.limits
        if kind == "whole" and self.station.stages == (m.MACRO,):
            counts = limits.macro_high if which == "MAX" else limits.macro_low
            return float(
                min(max(counts * self.settings.live.pitch, limits.whole_low), limits.whole_high)
            )
        if kind == "whole":
            tolerance = self.control.sequence.tolerance
            return reach(self.settings.live, limits, tolerance)[which == "MAX"]
        return float(getattr(limits, f"{kind}_{'low' if which == 'MIN' else 'high'}"))

    @property
    def limits(self) -> SoftLimits:
        return self.station.snapshot().limits

    def programmes(self) -> tuple[str, ...]:
        """Names of the machine's programmes."""
        return self.settings.programmes.names()

    def shipped(self, name: str) -> Planned:
        """One of the machine's programmes."""
        return self.settings.programmes.named(name, self.limits)

    def programme(self, path: Path, shown: str = "") -> Planned:
        """Read a programme from a file and check it against the soft limits."""
        try:
            return self.settings.programmes.read(path, self.limits)
        except InputError as error:
            raise error_under_name(error, path, shown or path.name) from None

    def programme_of(self, data: bytes, name: str, shown: str = "") -> Planned:
        """Read a programme from the content of a file `name`."""
        with tempfile.TemporaryDirectory(prefix="macromicro-") as folder:
            path = Path(folder) / name
            path.write_bytes(data)
            return self.programme(path, shown)

    # Telemetry

    def newest(self, count: int) -> NDArray[np.float64]:
        """The last `count` rows of telemetry, at most: float64[columns, rows]."""
        with self._lock:
            last, seen = self._newest
            now = time.monotonic()
            first = last + round((now - seen) / self.period) - count - SPARE if last >= 0 else -1
            last, rows, _ = self.station.telemetry(max(first, -1))
            if rows.shape[1] < count and first >= 0:
                last, rows, _ = self.station.telemetry()
            self._newest = last, now
        return rows[:, rows.shape[1] - min(count, rows.shape[1]) :]
