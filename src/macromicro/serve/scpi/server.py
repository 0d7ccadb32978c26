from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from macromicro.serve._instrument import Instrument
from macromicro.serve.door import _server as door
from macromicro.serve.door._bounds import Bounds
from macromicro.serve.guesses import Token
from macromicro.serve.hosts import HOST
from macromicro.serve.hosts import SCPI_PORT as PORT
from macromicro.serve.scpi._connection import ScpiConnection

if TYPE_CHECKING:
    from macromicro.serve.station import Station


class Server(door.LineServer):
    """The SCPI server, in the background; a context manager."""

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
        instrument = Instrument(station, folder, door.token(host, token))
        super().__init__("SCPI", host, port, ScpiConnection, instrument, bounds or Bounds())
