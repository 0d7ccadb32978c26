"""A virtual machine served only to the program that starts it."""

from __future__ import annotations

import atexit
import secrets
import tempfile
from pathlib import Path

from macromicro.rig.opening import TWIN
from macromicro.serve.hosts import HOST
from macromicro.serve.settings import load, patient
from macromicro.serve.station import Station
from macromicro.serve.web.server import WebServer


class Alone:
    """Starts and stops a server of the twin at a free local port, tolerant of a busy computer."""

    def __init__(self, config: str | None = None) -> None:
        self.token = secrets.token_urlsafe(24)
        self._folder = tempfile.TemporaryDirectory(prefix="macromicro-")
        settings = load(None if config is None else Path(config))
        settings = settings._replace(serve=patient(settings.serve))
        state = Path(self._folder.name) / "position.json"
        self._station = Station(TWIN, settings=settings, state=state)
        self._page = WebServer(self._station, HOST, 0, self.token, folder=Path(self._folder.name))

    def start(self) -> int:
        """Start; returns the page's port."""
        atexit.register(self.stop)  # whatever becomes of the program
        self._station.start()
        self._page.start()
        return self._page.address[1]

    def stop(self) -> None:
        atexit.unregister(self.stop)
        self._page.stop()
        self._station.stop()
        self._folder.cleanup()
