"""A web server before a station without a machine."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from macromicro.serve.web import WebServer

sys.path.insert(0, str(Path(__file__).parent))
from web_parts import Client, Station


@pytest.fixture
def fake() -> Station:
    return Station()


@pytest.fixture
def serve(fake: Station, tmp_path: Path) -> Iterator[Callable[..., WebServer]]:
    """Starts servers; stops them in the end."""
    made: list[WebServer] = []

    def make(**rest: Any) -> WebServer:
        server = WebServer(fake, port=0, folder=tmp_path, **rest)  # type: ignore[arg-type]
        server.start()
        made.append(server)
        return server

    yield make
    for server in made:
        server.stop()


@pytest.fixture
def client(serve: Callable[..., WebServer]) -> Iterator[Callable[..., Client]]:
    """Clients of one server that is started by the first; closes them in the end."""
    made: list[Client] = []
    servers: list[WebServer] = []

    def make(hello: dict[str, Any] | None = None, /, **rest: Any) -> Client:
        if not servers:
            servers.append(serve(**rest))
            rest = {}
        made.append(Client(servers[0].address[1], {} if hello is None else hello, **rest))
        return made[-1]

    yield make
    for each in made:
        each.close()
