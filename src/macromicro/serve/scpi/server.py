from __future__ import annotations

import asyncio
import contextlib
from pathlib import Path
from typing import TYPE_CHECKING

from macromicro.serve._instrument import Instrument
from macromicro.serve.door import _server as door
from macromicro.serve.door._bounds import Bounds
from macromicro.serve.guesses import Token
from macromicro.serve.hosts import HOST
from macromicro.serve.hosts import SCPI_PORT as PORT
from macromicro.serve.scpi._connection import ScpiConnection
from macromicro.serve.threaded import Threaded

if TYPE_CHECKING:
    from macromicro.serve.station import Station


class Server(Threaded):
    """The SCPI server in a thread of its own; a context manager."""

    def __init__(
        self,
        station: Station,
        host: str = HOST,
        port: int = PORT,
        *,
        token: str | Token | None = None,
        folder: Path = Path(),
        bounds: Bounds | None = None,
    ) -> None:
        super().__init__("SCPI", host, port)
        self._instrument = Instrument(station, folder, door.token(host, token))
        self._bounds = Bounds() if bounds is None else bounds

    async def _serve(self) -> None:
        with contextlib.suppress(asyncio.CancelledError):
            await _serve(self._instrument, *self._where, self._bounds, self._listening)


async def serve(
    station: Station,
    host: str = HOST,
    port: int = PORT,
    token: str | Token | None = None,
    *,
    folder: Path = Path(),
    bounds: Bounds | None = None,
    ready: door.Ready | None = None,
) -> None:
    """Serve in the running event loop until cancelled; `ready` gets host and port."""
    instrument = Instrument(station, folder, door.token(host, token))
    await _serve(instrument, host, port, bounds or Bounds(), ready)


async def _serve(
    instrument: Instrument, host: str, port: int, bounds: Bounds, ready: door.Ready | None
) -> None:
    await door.serve(
        "scpi", lambda *opened: ScpiConnection(instrument, *opened), host, port, bounds, ready
    )
