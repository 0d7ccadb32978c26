"""What the connections of one server share."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from macromicro import __version__
from macromicro.hysteresis.table import FodTable
from macromicro.serve.client import Dispatcher
from macromicro.serve.guesses import Token
from macromicro.serve.instrument import Instrument
from macromicro.serve.settings import LiveSettings
from macromicro.serve.web import bins, reporting
from macromicro.serve.web.bounds import Bounds
from macromicro.serve.web.downloads import Downloads
from macromicro.serve.web.hub import Hub
from macromicro.serve.web.orders import Orders, units
from macromicro.serve.web.sessions import Sessions

if TYPE_CHECKING:
    from macromicro.serve.station import Station


class Context:
    """The station and all that stands before it."""

    def __init__(
        self, station: Station, token: Token, folder: Path, table: FodTable | None, bounds: Bounds
    ) -> None:
        self.station, self.bounds = station, bounds
        self.instrument = Instrument(station, folder, token)
        self.hub = Hub(self.instrument, table)
        self.dispatcher = Dispatcher("web", bounds.viewers, bounds.silent)
        self.sessions = Sessions(self.instrument, self.dispatcher)
        self.orders = Orders(self.instrument)
        self.recordings = Downloads(station, folder)
        law = self.instrument.law_columns
        two = isinstance(station.settings, LiveSettings)
        self.about: dict[str, Any] = {
            "version": __version__,
            "rig": station.rig,
            "model": "" if two else station.settings.model,
            "open": token.open,
            "stages": list(station.stages),
            "axes": reporting.axes(station.settings),
            "limits": reporting.limits(station.settings),
            "units": list(units(station.settings.live.place)),
            "programmes": list(self.instrument.programmes()),
            "channels": [*bins.channels(station.stages), *(c.name for c in law)],
            "law": [{"name": c.name, "unit": c.unit, "meaning": c.meaning} for c in law],
            "spans": list(bins.SPANS),
            "period": self.instrument.period,
            "jog_s": bounds.jog,
            "largest": bounds.largest,
        }

    def look(self) -> None:
        """Bring what all viewers see up to date."""
        self.hub.look({"recordings": self.recordings.listed()})

    def close(self) -> None:
        """All pages are gone."""
        self.sessions.close()
        self.dispatcher.close()
