"""A virtual machine that is served to the program that starts it, and to nobody else."""

from __future__ import annotations

import atexit
import secrets
import tempfile
from pathlib import Path

from macromicro.rig.opening import TWIN
from macromicro.serve.choosing import load
from macromicro.serve.hosts import HOST
from macromicro.serve.settings import patient
from macromicro.serve.station import Station
from macromicro.serve.web.server import WebServer


class Alone:
    """Starts and stops a server of the twin at any free port of this computer, which runs late
    rather than stop where the computer is busy (`serve.settings.patient`). `config`: a settings
    file; `token`: what its one client gives."""

    def __init__(self, config: str | None = None) -> None:
        self.token = secrets.token_urlsafe(24)
        self._folder = tempfile.TemporaryDirectory(prefix="macromicro-")
        settings = load(None if config is None else Path(config))
        settings = settings._replace(serve=patient(settings.serve))
        state = Path(self._folder.name) / "position.json"
        self._station = Station(TWIN, settings=settings, state=state)
        self._page = WebServer(self._station, HOST, 0, self.token, folder=Path(self._folder.name))

    def start(self) -> int:
        """Start; the port of the page."""
        atexit.register(self.stop)  # whatever becomes of the program
        self._station.start()
        self._page.start()
        return self._page.address[1]

    def stop(self) -> None:
        """End it and forget where it was. Does nothing where that was done."""
        atexit.unregister(self.stop)
        self._page.stop()
        self._station.stop()
        self._folder.cleanup()
