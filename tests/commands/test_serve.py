"""What ends `macromicro serve` besides a signal."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Any, Self, cast

import pytest

from macromicro.commands import serve
from macromicro.commands.signals import Signals
from macromicro.errors import MacromicroError
from macromicro.serve.scpi import server as scpi
from macromicro.serve.station import Station
from macromicro.serve.web import server as web


class Stand:
    """In place of the station or of a server; it has ended by itself if `failing`."""

    realtime, address, url = "", ("127.0.0.1", 1), ""

    def __init__(self, failing: bool = False) -> None:
        self.failure = MacromicroError("it ended by itself") if failing else None

    def events(self, since: int) -> tuple[int, list[Any]]:
        return since, []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        pass


@pytest.mark.parametrize("failing", ["scpi", "web"])
def test_a_server_that_has_ended_ends_it_all(failing: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def make(name: str) -> Any:
        return lambda *_, **__: Stand(failing == name)

    monkeypatch.setattr(scpi, "Server", make("scpi"))
    monkeypatch.setattr(web, "WebServer", make("web"))
    station, doors = cast(Station, Stand()), serve._Doors("127.0.0.1", 0, 0, -1, (), None, None)
    with (
        Signals() as signals,
        ExitStack() as stack,
        pytest.raises(MacromicroError, match="ended by itself"),
    ):
        signals.later()
        servers = serve._Servers(station, doors, Path(), stack)
        servers.open_page()
        servers.open_others()
        serve._serve(station, servers, None, signals)
