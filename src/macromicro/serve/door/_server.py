"""Listens and serves the clients of one protocol."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from macromicro.serve._instrument import Instrument
from macromicro.serve.client import Capacity, Client
from macromicro.serve.door._connection import Bounds, Connection, SocketMonitor
from macromicro.serve.hosts import Token, guarded
from macromicro.serve.listening import Listener, check_port, refused

BEAT = 0.1
BACKLOG = 128


def token(host: str, given: str | Token | None) -> Token:
    """The token of a server that listens at `host`, checked."""
    if isinstance(given, Token):
        return given
    guarded(host, given)
    return Token(given)


class LineServer(Listener):
    """The server of a protocol of lines, at a TCP port.

    `session` makes a client, and `connection` what serves it.
    """

    def __init__(
        self,
        kind: str,
        host: str,
        port: int,
        session: Callable[..., Client],
        connection: Callable[..., Connection[Any]],
        instrument: Instrument,
        bounds: Bounds,
    ) -> None:
        super().__init__(kind, host, port)
        self._session, self._connection = session, connection
        self._instrument, self._bounds = instrument, bounds

    async def _serve(self) -> None:
        bounds = self._bounds
        connections: dict[Connection[Any], asyncio.Task[None]] = {}
        capacity = Capacity(bounds.clients, bounds.silent, bounds.crowd, yielding=True)

        async def run(connection: Connection[Any]) -> None:
            try:
                await connection.run()
            finally:
                capacity.leave(connection)
                del connections[connection]

        def accept(monitor: SocketMonitor, writer: asyncio.StreamWriter) -> None:
            most = 2 * (bounds.clients + bounds.silent)  # those that are on their way out counted
            peer = writer.get_extra_info("peername")
            if len(connections) >= most or peer is None:
                writer.transport.abort()
                return
            name = f"{self._kind.lower()} {peer[0]}:{peer[1]}"
            client = self._session(self._instrument, name, peer[0], capacity)
            connection = self._connection(client, monitor, writer, bounds)
            capacity.arrive(connection)
            connections[connection] = asyncio.create_task(run(connection))

        def protocol() -> asyncio.StreamReaderProtocol:
            monitor = SocketMonitor()
            return asyncio.StreamReaderProtocol(monitor, lambda _, writer: accept(monitor, writer))

        host, port = self._where
        check_port(port)
        try:
            loop = asyncio.get_running_loop()
            listening = await loop.create_server(protocol, host, port, backlog=BACKLOG)
        except OSError as error:
            raise refused(host, port, error) from None
        try:
            self._listening(*listening.sockets[0].getsockname()[:2])
            while True:
                await asyncio.sleep(BEAT)
                for connection in connections:
                    connection.watch()
        finally:
            listening.close()
            tasks = tuple(connections.values())
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
