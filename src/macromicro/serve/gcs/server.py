from __future__ import annotations

import asyncio
import contextlib
from typing import TYPE_CHECKING

from macromicro.serve._instrument import Instrument
from macromicro.serve.door import _server as door
from macromicro.serve.door._bounds import Bounds
from macromicro.serve.gcs._connection import BOUNDS, GcsConnection
from macromicro.serve.guesses import Token
from macromicro.serve.hosts import HOST
from macromicro.serve.threaded import Threaded

if TYPE_CHECKING:
    from macromicro.serve.station import Station


class GcsServer(Threaded):
    """GCS 2.0 at a TCP port, in a thread of its own; a context manager."""

    def __init__(
        self,
        station: Station,
        host: str = HOST,
        port: int = 0,
        *,
        token: str | Token | None = None,
        bounds: Bounds = BOUNDS,
    ) -> None:
        super().__init__("GCS", host, port)
        self._instrument = Instrument(station, token=door.token(host, token))
        self._bounds = bounds

    async def _serve(self) -> None:
        with contextlib.suppress(asyncio.CancelledError):
            await door.serve(
                "gcs",
                lambda *opened: GcsConnection(self._instrument, *opened),
                *self._where,
                self._bounds,
                self._listening,
            )
