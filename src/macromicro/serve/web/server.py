"""The web server: its own thread, its own event loop; page and WebSocket on one port."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from macromicro.errors import InputError, MacromicroError
from macromicro.serve.hosts import is_loopback
from macromicro.serve.threaded import Threaded, check_port, refused
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


class WebServer(Threaded):
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
        super().__init__("web", host, port)
        self._station = station
        self._gate = Gate(token, names)
        self._folder, self._table = folder, table
        self._bounds = bounds or Bounds()
        self._viewers = 0

    @property
    def url(self) -> str:
        """Where a browser finds the page."""
        host, port = self.address
        return f"http://[{host}]:{port}/" if ":" in host else f"http://{host}:{port}/"

    async def _serve(self) -> None:
        from macromicro.serve.web.room import Room

        room = Room(self._station, self._gate, self._folder, self._table, self._bounds)
        try:
            room.look()
            server = await self._listen(room)
            bound = server.sockets[0].getsockname()
            self._listening(bound[0], bound[1])
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
        check_port(port)
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
        except OSError as error:
            raise refused(host, port, error) from None

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
