"""What all viewers see alike, taken from the station once for all of them."""

from __future__ import annotations

import json
import math
from collections import deque
from typing import Any

import numpy as np

from macromicro.hysteresis.table import FodTable
from macromicro.schema.par import entries
from macromicro.serve.instrument import Instrument
from macromicro.serve.web import reporting
from macromicro.serve.web.plane import Plane

KEPT = 400  # events and ends of motions that a viewer who comes late still gets


class Hub:
    """State, news, gains and the Preisach plane; `look` brings them up to date."""

    def __init__(self, instrument: Instrument, table: FodTable | None = None) -> None:
        self._instrument, self.station = instrument, instrument.station
        self.settings = instrument.settings
        self.pitch = self.settings.live.pitch
        lives = getattr(self.settings, "lives", ())
        self.second = lives[1].pitch if lives else math.nan
        self.control: Any = self.settings.controller
        self.news: deque[tuple[int, str]] = deque(maxlen=KEPT)
        self.state = "{}"
        self.turn = 0
        self._plane = Plane(self.settings.guard.hottest, table)
        self._row, self._clock = -1, -math.inf
        self._seen, self._newest, self._motion = -1, 0, 1
        self._time = math.nan

    def look(self, extra: dict[str, Any]) -> None:
        """Ask the station; `extra`: what the server itself adds to the state."""
        self.follow()
        state = self.now()
        self._time = state["time_s"]
        self._follow_heat()
        state |= extra
        state["plane"] = self._plane.words()
        self.state = json.dumps({"state": state}, allow_nan=False)
        self.turn += 1

    def now(self) -> dict[str, Any]:
        """The machine's state at this instant."""
        now = self.station.snapshot()
        return reporting.state(now, self.settings.live, self.station.stages)

    def as_toml(self) -> str:
        """A file for `--config` that starts a server as this one is set now: gains and soft
        limits in force, and all else that differs from the defaults."""
        self.follow()
        now = self.station.snapshot()
        return self.settings.as_toml(self.control, now.limits)

    def gains(self) -> str:
        """The controller's settings in force, as a message."""
        return json.dumps({"gains": reporting.settings(self.control)}, allow_nan=False)

    def after(self, seen: int) -> tuple[int, str]:
        """News behind number `seen`: (number of the last one, message or "" for none)."""
        if seen >= self._newest:
            return seen, ""
        items = ", ".join(text for number, text in self.news if number > seen)
        return self._newest, f'{{"news": [{items}]}}'

    def has(self, path: str, value: float | int | str) -> bool:
        """Is this setting in force?"""
        return {e.path: e.value for e in entries(self.control)}.get(path) == value

    def follow(self) -> None:
        """Take the events that have come, and the gains in force."""
        self._seen, events = self.station.events(self._seen)
        for event in events:
            # Ends come before the events behind them; whoever is late is not reordered.
            self._note(reporting.event(self._newest + 1, event, self.control))
            if event.kind == "loop" and event.cause == "started":
                self._motion = 1
        self.control = self._instrument.control()
        while (end := self.station.finished(self._motion, 0.0)) is not None:
            self._note(reporting.finished(self._newest + 1, end, self._time))
            self._motion += 1

    def _note(self, item: dict[str, Any]) -> None:
        self._newest += 1
        self.news.append((self._newest, json.dumps(item, allow_nan=False)))

    def _follow_heat(self) -> None:
        last, block, names = self.station.telemetry(self._row)
        if block.shape[1]:
            time = float(block[names.index("t"), 0])
            if time < self._clock:  # another loop, whose wires are cold
                self._plane.forget()
            self._clock = float(block[names.index("t"), -1])
            self._plane.feed(np.asarray(block[names.index("temperature_estimate")]))
        elif last < self._row:
            self._plane.forget()
            self._clock = -math.inf
            last = -1
        self._row = last
