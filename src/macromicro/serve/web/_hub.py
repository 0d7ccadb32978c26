"""What all viewers share, read from the station once."""

from __future__ import annotations

import json
import math
from collections import deque
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from macromicro import __version__
from macromicro.control.live.messages import Finished
from macromicro.hysteresis.everett import from_density
from macromicro.hysteresis.preisach import Preisach
from macromicro.hysteresis.table import FodTable
from macromicro.serve._background import in_thread
from macromicro.serve._instrument import Instrument
from macromicro.serve.client import Capacity
from macromicro.serve.hosts import Token
from macromicro.serve.settings import LiveSettings
from macromicro.serve.telling import calibrations
from macromicro.serve.web import _reporting, bins
from macromicro.serve.web._downloads import Downloads
from macromicro.serve.web._orders import Orders, units
from macromicro.serve.web._sessions import Sessions
from macromicro.serve.web.server import Bounds

if TYPE_CHECKING:
    from macromicro.serve.station import Station


SMALLEST = 0.3  # degC; smaller reversals are remembered but not drawn
_CELLS = 30


class Plane:
    """The Preisach plane of the wires from `ambient` to `hottest` [degC]."""

    def __init__(self, ambient: float, hottest: float) -> None:
        # Any density does: only the memory is read.
        density = np.tril(np.ones((_CELLS, _CELLS)))
        everywhere = from_density(density, ambient, (hottest - ambient) / _CELLS, _CELLS + 1)
        self.model = Preisach(FodTable.from_everett(everywhere))

    def feed(self, temperature: NDArray[np.float64]) -> None:
        """Follow the temperatures [degC], float64[rows]; NaN is skipped."""
        good = temperature[np.isfinite(temperature)]
        if good.size == 0:
            return
        turns = np.sign(np.diff(good))
        # Between its turning points a way leaves the same memory as one step.
        keep = np.concatenate([[0], np.flatnonzero(turns[1:] != turns[:-1]) + 1, [good.size - 1]])
        for u in good[keep].tolist():
            self.model.step(u)

    def forget(self) -> None:
        """Start again with a cold estimate."""
        self.model.reset()

    def words(self) -> dict[str, Any]:
        """Extent and input [degC], and corners (M, m) [degC]."""
        model = self.model
        corners = [
            [round(top, 2), round(low, 2)]
            for top, low in model.corners.tolist()
            if math.isfinite(low) and top - low >= SMALLEST
        ]
        return {
            "low": model.table.lo,
            "high": model.table.hi,
            "u": round(model.u, 2),
            "corners": corners,
            "contraction": None,  # nothing measured says how long the wires are
        }


KEPT = 400  # events and ends of motions kept for late viewers


class Hub:
    """State, news, gains and the Preisach plane; `look` updates them."""

    def __init__(self, instrument: Instrument) -> None:
        self._instrument, self.station = instrument, instrument.station
        self.settings = instrument.settings
        self.control: Any = self.settings.controller
        self.news: deque[tuple[int, str]] = deque(maxlen=KEPT)
        self.state = "{}"
        self.turn = 0
        limits = self.settings.guard
        self._plane = Plane(limits.ambient, limits.hottest)
        self._row, self._clock = -1, -math.inf
        self._seen, self._newest, self._motion = -1, 0, 1
        self._time = math.nan

    def look(self, extra: dict[str, Any]) -> None:
        """Ask the station; `extra` is added to the state."""
        self.follow()
        state = self.now()
        self._time = state["time_s"]
        self._follow_heat()
        state |= extra
        state["plane"] = self._plane.words()
        self.state = json.dumps({"state": state}, allow_nan=False)
        self.turn += 1

    def now(self) -> dict[str, Any]:
        now = self.station.snapshot()
        return _reporting.state(
            now, self.settings.live, self.station.stages, self.settings.facts.limited
        )

    def as_toml(self) -> str:
        """A file for `--config` with the gains and soft limits in force."""
        self.follow()
        now = self.station.snapshot()
        return self.settings.as_toml(self.control, now.limits)

    def gains(self) -> str:
        return json.dumps({"gains": _reporting.settings(self.control)}, allow_nan=False)

    def after(self, seen: int) -> tuple[int, str]:
        """News after number `seen`: (number of the last one, message or "")."""
        if seen >= self._newest:
            return seen, ""
        items = ", ".join(text for number, text in self.news if number > seen)
        return self._newest, f'{{"news": [{items}]}}'

    def follow(self) -> None:
        """Process new events and the gains in force."""
        ends = self._ends(math.inf)
        self._seen, events = self.station.events(self._seen)
        if any(event.kind == "loop" and event.cause == "started" for event in events):
            self._motion, ends = 1, []
        # An end that came meanwhile and is earlier than an event has its place before it.
        ends += self._ends(max((event.time for event in events), default=-math.inf))
        for event in events:
            while ends and ends[0].time < event.time:
                self._end(ends.pop(0))
            self._note(_reporting.event(self._newest + 1, event, self.control))
        for end in ends:
            self._end(end)
        self.control = self._instrument.control

    def _ends(self, latest: float) -> list[Finished]:
        """Ends of motions up to this time."""
        found = []
        while (end := self.station.finished(self._motion, 0.0)) is not None:
            if end.time > latest:
                break
            found.append(end)
            self._motion += 1
        return found

    def _end(self, end: Finished) -> None:
        self._note(_reporting.end_of_motion(self._newest + 1, end, self._time))

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


class Context:
    def __init__(self, station: Station, token: Token, folder: Path, bounds: Bounds) -> None:
        self.station, self.bounds = station, bounds
        self.instrument = Instrument(station, folder, token)
        self.hub = Hub(self.instrument)
        self.capacity = Capacity(bounds.viewers, bounds.silent)
        self.sessions = Sessions(self.instrument, self.capacity)
        self.orders = Orders(self.instrument)
        self.recordings = Downloads(station, folder)
        law, shown = station.settings.law_columns, bins.plots(station.settings)
        facts, two = station.settings.facts, isinstance(station.settings, LiveSettings)
        self.about: dict[str, Any] = {
            "version": __version__,
            "rig": station.rig,
            "model": "" if two else facts.model,
            "open": token.open,
            "stages": list(station.stages),
            "names": facts.names,
            "efforts": facts.efforts,
            "axes": _reporting.axes(station.settings),
            "calibrations": calibrations(station.settings),
            "plane": facts.plane,
            "limits": _reporting.limits(station.settings),
            "units": list(units(station.settings.live.place)),
            "programmes": list(self.instrument.programmes()),
            "channels": list(shown.channels),
            "law": [{"name": c.name, "unit": c.unit, "meaning": c.meaning} for c in law],
            "signals": [[c.name, c.unit, c.meaning] for c in station.captures.signals],
            "spans": list(bins.SPANS),
            "period": self.instrument.period,
            "jog_s": bounds.jog,
            "largest": bounds.largest,
        }

    async def look(self) -> None:
        """Update what all viewers see."""
        self.hub.look({"recordings": await in_thread(self.recordings.listed)})
