from __future__ import annotations

from typing import TYPE_CHECKING

from macromicro.serve._instrument import Instrument
from macromicro.serve.door import _server as door
from macromicro.serve.door._bounds import Bounds
from macromicro.serve.gcs._connection import BOUNDS, GcsConnection
from macromicro.serve.guesses import Token
from macromicro.serve.hosts import HOST

if TYPE_CHECKING:
    from macromicro.serve.station import Station


class GcsServer(door.LineServer):
    """GCS 2.0 at a TCP port, in the background; a context manager."""

    def __init__(
        self,
        station: Station,
        host: str = HOST,
        port: int = 0,
        *,
        token: str | Token | None = None,
        bounds: Bounds = BOUNDS,
    ) -> None:
        instrument = Instrument(station, token=door.token(host, token))
        super().__init__("GCS", host, port, GcsConnection, instrument, bounds)
