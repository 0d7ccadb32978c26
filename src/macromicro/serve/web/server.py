from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
from collections.abc import Sequence
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, NamedTuple

from macromicro.serve.door._connection import prepare
from macromicro.serve.hosts import HOST, STARTING, Guesses, Token, is_loopback, require_token, url
from macromicro.serve.hosts import WEB_PORT as PORT
from macromicro.serve.listening import Listener, check_port, listen_error

if TYPE_CHECKING:
    from websockets.asyncio.server import Server, ServerConnection

    from macromicro.serve.station import Station
    from macromicro.serve.web._hub import Context


class Bounds(NamedTuple):
    """Limits of the page's server; times in s."""

    viewers: int = 16  # connections at a time
    silent: int = 64  # connections that have not said hello
    largest: int = 16_384  # bytes of a message
    rate: float = 100.0  # messages per second
    burst: float = 200.0  # messages at once
    waiting: int = 32  # pending orders of one viewer
    patience: float = 5.0  # for unread data, or a missing hello
    frames: float = 30.0  # of telemetry per second
    views: float = 2.0  # changes of the view per second
    jog: float = 0.4  # a jog continues so long without a sign of its button
    tries: int = 5  # wrong tokens of one address within `forget`
    pause: float = 0.5  # after a wrong token
    forget: float = 60.0


LOOK_S = 0.1
_LOG = logging.getLogger("macromicro.web")
_LOG.addHandler(logging.NullHandler())
_LOG.propagate = False


class WebServer(Listener):
    """The web page of a station; a context manager. `url` is where to look.

    It may listen before the station has started: until then the page says that it starts.
    """

    def __init__(
        self,
        station: Station,
        host: str = HOST,
        port: int = PORT,
        token: str | Token | None = None,
        *,
        folder: Path = Path(),
        names: Sequence[str] = (),
        bounds: Bounds | None = None,
    ) -> None:
        from macromicro.serve.web._http import Gate

        self._bounds = bounds or Bounds()
        if not isinstance(token, Token):
            require_token(host, token)
            token = Token(token, Guesses(self._bounds.tries, self._bounds.forget))
        self._token = token
        super().__init__("web", host, port)
        self._station = station
        self._gate = Gate([*names, host])
        self._folder = folder
        self._context: Context | None = None

    @property
    def url(self) -> str:
        return url(*self.address)

    def start(self) -> None:
        from websockets.asyncio import server  # noqa: F401 - needed by `_listen`

        from macromicro.serve.web import _connection  # noqa: F401 - needed by `_view`

        if not is_loopback(self._where[0]):
            name = socket.gethostname()
            self._gate.answer_to(name)
            self._gate.answer_to(f"{name.partition('.')[0]}.local")
            # Its full name may be asked of the network, which may take its time.
            Thread(target=self._full_name, args=(name,), name="full name", daemon=True).start()
        super().start()

    def _full_name(self, name: str) -> None:
        full = socket.getfqdn(name)
        if full.partition(".")[0].lower() == name.partition(".")[0].lower():
            self._gate.answer_to(full)

    async def _serve(self) -> None:
        try:
            await self._look()
            server = await self._listen()
            bound = server.sockets[0].getsockname()
            self._listening(bound[0], bound[1])
            with contextlib.suppress(asyncio.CancelledError):
                while True:
                    await asyncio.sleep(LOOK_S)
                    await self._look()
            server.close()
            await server.wait_closed()
        finally:
            if self._context is not None:
                self._context.sessions.close()
                self._context = None

    async def _look(self) -> None:
        """Update what all viewers see, once the station has started."""
        from macromicro.serve.web._hub import Context

        if not self._station.started:
            return
        context = self._context or Context(self._station, self._token, self._folder, self._bounds)
        await context.look()
        context.sessions.tidy()
        self._context = context

    async def _listen(self) -> Server:
        from websockets.asyncio.server import serve

        from macromicro.serve.web._http import Files

        host, port = self._where
        check_port(port)
        files, bounds = Files(self._gate), self._bounds

        try:
            return await serve(
                self._view,
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
            raise listen_error(host, port, error) from None

    async def _view(self, opened: ServerConnection) -> None:
        from macromicro.serve.web._connection import PageConnection

        context = self._context
        if context is None:
            await opened.close(*STARTING)
            return
        prepare(opened.transport.get_extra_info("socket"))
        connection = PageConnection(context, opened)
        context.capacity.arrive(connection)
        try:
            await connection.run()
        finally:
            context.capacity.leave(connection)
