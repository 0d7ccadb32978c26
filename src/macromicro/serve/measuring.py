"""Measures how well this computer keeps the loop's period, with the twin."""

from __future__ import annotations

import itertools
import math
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.control.live import messages as m
from macromicro.serve.settings import AnySettings, LiveSettings
from macromicro.serve.shared import INDEX
from macromicro.serve.snapshot import Trouble
from macromicro.serve.station import Station

SHARES = (0.5, 0.99, 0.999)
_LOOK_S = 0.1
_PLACES_M = (20.4e-3, 20.9e-3, 40.3e-3, 22.0e-3)
_SHARES = (0.1, 0.12, 0.3, 0.15)  # of the travel of another machine
_US = 1e6


class Latency(NamedTuple):
    """Timing of the loop; a value per period."""

    late: Array  # lateness of each period
    work: Array  # computing time of each period
    periods: int
    missed: int
    share: float  # greatest share of missed periods in a window
    emergency: float  # from an emergency stop to safe outputs
    realtime: str
    fault: Trouble | None


def moves(settings: AnySettings) -> tuple[m.Request, ...]:
    """Targets of the measurement's moves."""
    if isinstance(settings, LiveSettings):
        return tuple(map(m.MoveTo, _PLACES_M))
    axes = settings.axes or (("", settings.live),)
    ways = {n: (live.limits.whole_low, live.limits.whole_high) for n, live in axes}
    places = [{n: low + s * (high - low) for n, (low, high) in ways.items()} for s in _SHARES]
    if not settings.axes:
        return tuple(m.MoveTo(place[""]) for place in places)
    return tuple(map(m.MovePoint, places))


def measure(settings: AnySettings, seconds: float, progress: Callable[[float], bool]) -> Latency:
    """Run the loop on the twin for `seconds`, moving; `progress` may end it by returning False."""
    late: list[Array] = []
    work: list[Array] = []
    share = 0.0
    with tempfile.TemporaryDirectory() as folder:
        station = Station(settings=settings, state=Path(folder) / "position.json")
        with station:
            driver = _Driver(station, moves(settings))
            began, row = time.monotonic(), -1
            while True:
                done = time.monotonic() - began
                going = progress(min(done, seconds)) and done < seconds
                row, block, _ = station.telemetry(row)
                late.append(block[INDEX["late"]] / _US)
                work.append(block[INDEX["work"]] / _US)
                now = station.snapshot()
                share = max(share, now.pace.share)
                if not going or now.fault is not None or not now.running:
                    break
                driver.go_on()
                time.sleep(min(_LOOK_S, max(seconds - done, 0.0)))
            emergency = station.emergency()
    # Before the first row there was no period.
    lates, works = np.concatenate(late)[1:], np.concatenate(work)[1:]
    pace = now.pace
    return Latency(
        lates, works, pace.periods, pace.missed, share, emergency, station.realtime, now.fault
    )


class _Driver:
    """Homes the twin and keeps it moving."""

    def __init__(self, station: Station, moves: tuple[m.Request, ...]) -> None:
        self._station = station
        self._moves = itertools.cycle(moves)
        self._client = "latency"
        station.acquire(self._client)
        station.request(self._client, m.Enable())
        self._motion = self._begin(m.Home())

    def _begin(self, request: m.Request) -> int:
        reply = self._station.request(self._client, request)
        return reply.id if isinstance(reply, m.Accepted) else 0

    def go_on(self) -> None:
        self._station.heartbeat(self._client)
        if self._station.finished(self._motion, 0.0) is not None or not self._motion:
            self._motion = self._begin(next(self._moves))


def quantiles(times: Array) -> list[float]:
    """The quantiles of `SHARES`, then the maximum."""
    if not len(times):
        return [math.nan] * (len(SHARES) + 1)
    found = np.quantile(times, SHARES, method="higher")
    return [*(float(x) for x in found), float(times.max())]
