"""The SCPI server."""

from __future__ import annotations

import asyncio
import contextlib
from pathlib import Path
from typing import TYPE_CHECKING

from macromicro.serve.door import server as door
from macromicro.serve.door.bounds import Bounds
from macromicro.serve.guesses import Token
from macromicro.serve.hosts import HOST
from macromicro.serve.hosts import SCPI_PORT as PORT
from macromicro.serve.instrument import Instrument
from macromicro.serve.scpi.connection import ScpiConnection
from macromicro.serve.threaded import Threaded

if TYPE_CHECKING:
    from macromicro.serve.station import Station


class Server(Threaded):
    """The SCPI server in a thread of its own; a context manager that starts and stops it.

    `port` 0 is any free one; `address` is it. `token`: what a client must give before
    it may change anything (stops need none), or a `Token` that other servers share, so that
    wrong ones count together. `folder`: where recordings go. Raises InputError for a host
    that others reach, without a token.
    """

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
    """Serve in the running event loop until cancelled; arguments as of `Server`.

    `ready` is called with host and port once it listens. Raises InputError as `start` does.
    """
    instrument = Instrument(station, folder, door.token(host, token))
    await _serve(instrument, host, port, bounds or Bounds(), ready)


async def _serve(
    instrument: Instrument, host: str, port: int, bounds: Bounds, ready: door.Ready | None
) -> None:
    await door.serve(
        "scpi", lambda *opened: ScpiConnection(instrument, *opened), host, port, bounds, ready
    )
