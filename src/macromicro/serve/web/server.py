"""The web server: its own thread, its own event loop; page and WebSocket on one port."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import logging
import socket
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from macromicro.errors import InputError, MacromicroError
from macromicro.serve.hosts import is_loopback
from macromicro.serve.web.bounds import Bounds

if TYPE_CHECKING:
    from websockets.asyncio.server import Server, ServerConnection

    from macromicro.hysteresis.table import FodTable
    from macromicro.serve.station import Station
    from macromicro.serve.web.room import Room

HOST, PORT = "127.0.0.1", 8080
LOOK_S = 0.1
_LOG = logging.getLogger("macromicro.web")
_LOG.addHandler(logging.NullHandler())
_LOG.propagate = False


class WebServer:
    """The page of a station; a context manager that starts and stops it.

    `port` 0 is any free one; `address` tells which, `url` where to look. `token`: what a
    viewer must give before it may order anything (stops need none). `folder`: where
    recordings go; `names`: host names under which this server is reached, beside "localhost"
    and its addresses; `table`: the kiln's table of the actuator, for the contraction that the
    model expects.

    Raises InputError for a host that others reach, without a token.
    """

    def __init__(
        self,
        station: Station,
        host: str = HOST,
        port: int = PORT,
        token: str | None = None,
        *,
        folder: Path = Path(),
        names: Sequence[str] = (),
        table: FodTable | None = None,
        bounds: Bounds | None = None,
    ) -> None:
        try:
            from macromicro.serve.web.gate import Gate
        except ModuleNotFoundError as error:
            if error.name != "websockets":
                raise
            raise MacromicroError(
                "the page needs the package websockets: pip install 'macromicro[web]'"
            ) from None
        if token is None and not is_loopback(host):
            raise InputError("host", host, "127.0.0.1, or another one together with a token")
        if token is not None and not token.strip():
            raise InputError("token", token, "a text that is hard to guess")
        self._station, self._where = station, (host, port)
        self._gate = Gate(token, names)
        self._folder, self._table = folder, table
        self._bounds = bounds or Bounds()
        self._thread: threading.Thread | None = None
        self._bound = threading.Event()
        self._failures: list[BaseException] = []
        self._loop: asyncio.AbstractEventLoop | None = None
        self._task: asyncio.Task[None] | None = None
        self._viewers = 0
        self.address = host, port

    @property
    def url(self) -> str:
        """Where a browser finds the page."""
        host, port = self.address
        return f"http://[{host}]:{port}/" if ":" in host else f"http://{host}:{port}/"

    @property
    def failure(self) -> BaseException | None:
        """Why it ended by itself; None while it serves, and after `stop`."""
        return self._failures[0] if self._failures else None

    def start(self) -> None:
        """Listen. Raises InputError where the address cannot be had (port in use)."""
        if self._thread is not None:
            raise MacromicroError("the web server runs already")
        self._bound.clear()
        self._failures.clear()
        self._thread = threading.Thread(target=self._run, name="web", daemon=True)
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

    def __enter__(self) -> WebServer:
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
        from macromicro.serve.web.room import Room

        self._loop, self._task = asyncio.get_running_loop(), asyncio.current_task()
        room = Room(self._station, self._gate, self._folder, self._table, self._bounds)
        try:
            room.look()
            server = await self._listen(room)
            bound = server.sockets[0].getsockname()
            self.address = bound[0], bound[1]
            self._bound.set()
            with contextlib.suppress(asyncio.CancelledError):
                while True:
                    await asyncio.sleep(LOOK_S)
                    room.look()
                    await room.desk.tidy()
            server.close()
            await server.wait_closed()
        finally:
            room.desk.close()

    async def _listen(self, room: Room) -> Server:
        """Bind and listen; InputError in words where that fails."""
        from websockets.asyncio.server import serve

        from macromicro.serve.web.files import Files

        host, port = self._where
        if not 0 <= port <= 65535:
            raise InputError("port", port, "a whole number from 0 (any free one) to 65535")
        files, bounds = Files(self._gate), self._bounds

        async def view(socket: ServerConnection) -> None:
            await self._view(room, socket)

        try:
            return await serve(
                view,
                host,
                port,
                process_request=lambda _, request: files.respond(request),
                compression=None,
                max_size=bounds.largest,
                open_timeout=bounds.patience,
                close_timeout=1.0,
                logger=_LOG,
                server_header=None,
            )
        except socket.gaierror:
            raise InputError("host", host, _ADDRESS) from None
        except OSError as error:
            raise _refused(host, port, error) from None

    async def _view(self, room: Room, socket: Any) -> None:
        from macromicro.serve.web.connection import Connection

        if self._viewers >= self._bounds.viewers:
            await socket.close(1013, "too many viewers")
            return
        self._viewers += 1
        try:
            await Connection(room, socket).run()
        finally:
            self._viewers -= 1


_ADDRESS = "an address of this computer, such as 127.0.0.1"


def _refused(host: str, port: int, error: OSError) -> InputError:
    # asyncio words the error of each address anew, with the number kept.
    if error.errno == errno.EADDRINUSE:
        accepted = "a free port, or 0 for any; or end what listens there"
        return InputError(f"port {port}", f"in use on {host}", accepted)
    if error.errno == errno.EACCES:
        return InputError(f"port {port}", "not permitted", "a port from 1024 on")
    return InputError("host", f"{host}: {error.strerror}", _ADDRESS)
