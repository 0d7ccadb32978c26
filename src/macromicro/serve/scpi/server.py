"""The SCPI server: listens, and serves its clients beside each other."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from macromicro.serve.client import Dispatcher
from macromicro.serve.guesses import Token
from macromicro.serve.hosts import HOST, guarded
from macromicro.serve.hosts import SCPI_PORT as PORT
from macromicro.serve.instrument import Instrument
from macromicro.serve.scpi.bounds import Bounds
from macromicro.serve.scpi.connection import ScpiConnection
from macromicro.serve.scpi.socket_monitor import SocketMonitor
from macromicro.serve.threaded import Threaded, check_port, refused

if TYPE_CHECKING:
    from macromicro.serve.station import Station

BEAT = 0.1
BACKLOG = 128
_READY = Callable[[str, int], None]


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
        self._instrument = Instrument(station, folder, _token(host, token))
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
    ready: _READY | None = None,
) -> None:
    """Serve in the running event loop until cancelled; arguments as of `Server`.

    `ready` is called with host and port once it listens. Raises InputError as `start` does.
    """
    instrument = Instrument(station, folder, _token(host, token))
    await _serve(instrument, host, port, bounds or Bounds(), ready)


async def _serve(
    instrument: Instrument, host: str, port: int, bounds: Bounds, ready: _READY | None
) -> None:
    connections: dict[ScpiConnection, asyncio.Task[None]] = {}
    dispatcher = Dispatcher("scpi", bounds.clients, bounds.silent, bounds.crowd, yielding=True)

    async def run(connection: ScpiConnection) -> None:
        try:
            await connection.run()
        finally:
            dispatcher.capacity.leave(connection)
            del connections[connection]

    def accept(monitor: SocketMonitor, writer: asyncio.StreamWriter) -> None:
        most = 2 * (bounds.clients + bounds.silent)  # those that are on their way out counted
        if len(connections) >= most or writer.get_extra_info("peername") is None:
            writer.transport.abort()
            return
        connection = ScpiConnection(instrument, monitor, writer, dispatcher, bounds)
        dispatcher.capacity.arrive(connection)
        connections[connection] = asyncio.create_task(run(connection))

    try:
        listening = await _listen(accept, host, port)
        try:
            if ready is not None:
                bound = listening.sockets[0].getsockname()
                ready(bound[0], bound[1])
            while True:
                await asyncio.sleep(BEAT)
                for connection in connections:
                    connection.watch()
                await dispatcher.beat(connections)
        finally:
            listening.close()
            tasks = tuple(connections.values())
            for task in tasks:
                task.cancel()
            for connection in tuple(connections):
                connection.session.close()
            await asyncio.gather(*tasks, return_exceptions=True)
    finally:
        dispatcher.close()


def _token(host: str, token: str | Token | None) -> Token:
    if isinstance(token, Token):
        return token
    guarded(host, token)
    return Token(token)


async def _listen(
    accept: Callable[[SocketMonitor, asyncio.StreamWriter], None], host: str, port: int
) -> asyncio.Server:
    """Bind and listen; InputError in words where that fails."""

    def protocol() -> asyncio.StreamReaderProtocol:
        monitor = SocketMonitor()
        return asyncio.StreamReaderProtocol(monitor, lambda _, writer: accept(monitor, writer))

    check_port(port)
    try:
        loop = asyncio.get_running_loop()
        return await loop.create_server(protocol, host, port, backlog=BACKLOG)
    except OSError as error:
        raise refused(host, port, error) from None
