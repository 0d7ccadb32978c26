"""State that the connections of one server share."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from macromicro import __version__
from macromicro.serve._background import in_thread
from macromicro.serve._instrument import Instrument
from macromicro.serve.client import Capacity
from macromicro.serve.guesses import Token
from macromicro.serve.settings import LiveSettings
from macromicro.serve.telling import calibrations
from macromicro.serve.web import _reporting, bins
from macromicro.serve.web._downloads import Downloads
from macromicro.serve.web._hub import Hub
from macromicro.serve.web._orders import Orders, units
from macromicro.serve.web._sessions import Sessions
from macromicro.serve.web.server import Bounds

if TYPE_CHECKING:
    from macromicro.serve.station import Station


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
        two = isinstance(station.settings, LiveSettings)
        self.about: dict[str, Any] = {
            "version": __version__,
            "rig": station.rig,
            "model": "" if two else station.settings.model,
            "open": token.open,
            "stages": list(station.stages),
            "names": station.settings.names,
            "efforts": station.settings.efforts,
            "axes": _reporting.axes(station.settings),
            "calibrations": calibrations(station.settings),
            "plane": station.settings.plane,
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
