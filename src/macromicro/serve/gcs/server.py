"""The GCS server: listens, and serves its clients beside each other."""

from __future__ import annotations

import asyncio
import contextlib
from typing import TYPE_CHECKING

from macromicro.serve.client import Dispatcher
from macromicro.serve.gcs.connection import GcsConnection
from macromicro.serve.guesses import Token
from macromicro.serve.hosts import HOST, guarded
from macromicro.serve.instrument import Instrument
from macromicro.serve.threaded import Threaded, check_port, refused

if TYPE_CHECKING:
    from macromicro.serve.station import Station

CLIENTS, SILENT = 16, 64
BEAT_S = 0.1


class GcsServer(Threaded):
    """GCS 2.0 at a port, in a thread of its own; a context manager that starts and stops it.

    `port` 0 is any free one; `address` is it. `token`: what a client must give (CCL 1 TOKEN)
    before it may change anything (stops need none), or a `Token` that other servers share. Raises
    InputError for a host that others reach, without a token.
    """

    def __init__(
        self,
        station: Station,
        host: str = HOST,
        port: int = 0,
        *,
        token: str | Token | None = None,
    ) -> None:
        super().__init__("GCS", host, port)
        if not isinstance(token, Token):
            guarded(host, token)
            token = Token(token)
        self._instrument = Instrument(station, token=token)

    async def _serve(self) -> None:
        dispatcher = Dispatcher("gcs", CLIENTS, SILENT, yielding=True)
        living: dict[GcsConnection, asyncio.Task[None] | None] = {}

        async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            if len(living) >= 2 * (CLIENTS + SILENT) or writer.get_extra_info("peername") is None:
                writer.transport.abort()
                return
            connection = GcsConnection(self._instrument, dispatcher, reader, writer)
            dispatcher.capacity.arrive(connection)
            living[connection] = asyncio.current_task()
            with contextlib.suppress(asyncio.CancelledError):  # the server ends
                await connection.run()
            dispatcher.capacity.leave(connection)
            del living[connection]

        host, port = self._where
        check_port(port)
        try:
            server = await asyncio.start_server(serve, host, port)
        except OSError as error:
            raise refused(host, port, error) from None
        self._listening(*server.sockets[0].getsockname()[:2])
        try:
            while True:
                await asyncio.sleep(BEAT_S)
                await dispatcher.beat(living)
        except asyncio.CancelledError:
            server.close()
            tasks = [task for task in living.values() if task is not None]
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
        finally:
            dispatcher.close()
