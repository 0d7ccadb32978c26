"""Listens and serves the clients of one protocol."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from macromicro.serve.client import Dispatcher
from macromicro.serve.door._bounds import Bounds
from macromicro.serve.door._connection import Connection
from macromicro.serve.door._monitor import SocketMonitor
from macromicro.serve.guesses import Token
from macromicro.serve.hosts import guarded
from macromicro.serve.threaded import check_port, refused

BEAT = 0.1
BACKLOG = 128
Ready = Callable[[str, int], None]
Make = Callable[[SocketMonitor, asyncio.StreamWriter, Dispatcher, Bounds], Connection[Any]]


def token(host: str, given: str | Token | None) -> Token:
    """The token of a server that listens at `host`, checked."""
    if isinstance(given, Token):
        return given
    guarded(host, given)
    return Token(given)


async def serve(
    name: str, make: Make, host: str, port: int, bounds: Bounds, ready: Ready | None
) -> None:
    """Serve connections that `make` makes until cancelled; `ready` gets host and port."""
    connections: dict[Connection[Any], asyncio.Task[None]] = {}
    dispatcher = Dispatcher(name, bounds.clients, bounds.silent, bounds.crowd, yielding=True)

    async def run(connection: Connection[Any]) -> None:
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
        connection = make(monitor, writer, dispatcher, bounds)
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
                connection.client.close()
            await asyncio.gather(*tasks, return_exceptions=True)
    finally:
        dispatcher.close()


async def _listen(
    accept: Callable[[SocketMonitor, asyncio.StreamWriter], None], host: str, port: int
) -> asyncio.Server:
    """Bind and listen, or raise a clear error."""

    def protocol() -> asyncio.StreamReaderProtocol:
        monitor = SocketMonitor()
        return asyncio.StreamReaderProtocol(monitor, lambda _, writer: accept(monitor, writer))

    check_port(port)
    try:
        loop = asyncio.get_running_loop()
        return await loop.create_server(protocol, host, port, backlog=BACKLOG)
    except OSError as error:
        raise refused(host, port, error) from None
