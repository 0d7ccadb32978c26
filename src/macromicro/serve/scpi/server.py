"""The SCPI server: listens, and serves its clients beside each other."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import socket
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING

from macromicro.errors import InputError, MacromicroError
from macromicro.serve.scpi.connection import Bounds, Connection, Threads
from macromicro.serve.scpi.device import Device

if TYPE_CHECKING:
    from macromicro.serve.station import Station

HOST, PORT = "127.0.0.1", 5025
BEAT = 0.1
_READY = Callable[[str, int], None]


class Server:
    """The SCPI server in a thread of its own; a context manager that starts and stops it.

    `port` 0 is any free one; `address` tells which. `token`: what a client must give before
    it may change anything (stops need none). `folder`: where recordings go.
    """

    def __init__(
        self,
        station: Station,
        host: str = HOST,
        port: int = PORT,
        *,
        token: str | None = None,
        folder: Path = Path(),
        bounds: Bounds | None = None,
    ) -> None:
        self._device = Device(station, folder, token)
        self._where = host, port
        self._bounds = Bounds() if bounds is None else bounds
        self._thread: threading.Thread | None = None
        self._bound = threading.Event()
        self._failures: list[BaseException] = []
        self._loop: asyncio.AbstractEventLoop | None = None
        self._task: asyncio.Task[None] | None = None
        self.address = host, port

    def start(self) -> None:
        """Listen. Raises InputError where the address cannot be had (port in use)."""
        if self._thread is not None:
            raise MacromicroError("the SCPI server runs already")
        self._bound.clear()
        self._failures.clear()
        self._thread = threading.Thread(target=self._run, name="scpi", daemon=True)
        self._thread.start()
        self._bound.wait()
        if self._failures:
            self._thread.join()
            self._thread = None
            raise self._failures[0]

    def stop(self) -> None:
        """End all connections; the station sees its clients go. Does nothing where it does
        not run."""
        thread, loop, task = self._thread, self._loop, self._task
        if thread is None:
            return
        if loop is not None and task is not None:
            with contextlib.suppress(RuntimeError):  # it has ended by itself
                loop.call_soon_threadsafe(task.cancel)
        thread.join()
        self._thread = None

    def __enter__(self) -> Server:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def _run(self) -> None:
        try:
            asyncio.run(self._main())
        except BaseException as error:
            self._failures.append(error)
        finally:
            self._bound.set()

    async def _main(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._task = asyncio.current_task()

        def ready(host: str, port: int) -> None:
            self.address = host, port
            self._bound.set()

        with contextlib.suppress(asyncio.CancelledError):
            await _serve(self._device, *self._where, self._bounds, ready)


async def serve(
    station: Station,
    host: str = HOST,
    port: int = PORT,
    token: str | None = None,
    *,
    folder: Path = Path(),
    bounds: Bounds | None = None,
    ready: _READY | None = None,
) -> None:
    """Serve in the running event loop until cancelled; arguments as of `Server`.

    `ready` is called with host and port once it listens. Raises InputError as `start` does.
    """
    device = Device(station, folder, token)
    await _serve(device, host, port, bounds or Bounds(), ready)


async def _serve(
    device: Device, host: str, port: int, bounds: Bounds, ready: _READY | None
) -> None:
    connections: dict[Connection, asyncio.Task[None]] = {}
    orders = ThreadPoolExecutor(bounds.clients + 1, "scpi-orders")
    urgent = ThreadPoolExecutor(bounds.clients, "scpi-stops")
    threads = Threads(orders, urgent)

    async def run(connection: Connection) -> None:
        try:
            await connection.run()
        finally:
            del connections[connection]

    def accept(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if len(connections) >= bounds.clients or writer.get_extra_info("peername") is None:
            writer.transport.abort()
            return
        connection = Connection(device, reader, writer, threads, bounds)
        connections[connection] = asyncio.create_task(run(connection))

    def beat(living: tuple[Connection, ...]) -> None:
        for connection in living:
            with contextlib.suppress(Exception):  # one client's trouble is not the others'
                connection.beat()

    try:
        listening = await _listen(accept, host, port)
        try:
            if ready is not None:
                bound = listening.sockets[0].getsockname()
                ready(bound[0], bound[1])
            while True:
                await asyncio.sleep(BEAT)
                await asyncio.get_running_loop().run_in_executor(orders, beat, tuple(connections))
        finally:
            listening.close()
            tasks = tuple(connections.values())
            for task in tasks:
                task.cancel()
            for connection in tuple(connections):
                connection.session.close()
            await asyncio.gather(*tasks, return_exceptions=True)
    finally:
        orders.shutdown(wait=False, cancel_futures=True)
        urgent.shutdown(wait=False, cancel_futures=True)


async def _listen(
    accept: Callable[[asyncio.StreamReader, asyncio.StreamWriter], None], host: str, port: int
) -> asyncio.Server:
    """Bind and listen; InputError in words where that fails."""
    if not 0 <= port <= 65535:
        raise InputError("port", port, "a whole number from 0 (any free one) to 65535")
    try:
        return await asyncio.start_server(accept, host, port, backlog=16)
    except socket.gaierror:
        raise InputError("host", host, "an address of this computer, such as 127.0.0.1") from None
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            accepted = "a free port, or 0 for any; or end what listens there"
            raise InputError(f"port {port}", f"in use on {host}", accepted) from None
        if error.errno == errno.EACCES:
            raise InputError(f"port {port}", "not permitted", "a port from 1024 on") from None
        raise InputError(
            "host", f"{host}: {error.strerror}", "an address of this computer, such as 127.0.0.1"
        ) from None
