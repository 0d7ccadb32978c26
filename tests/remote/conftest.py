"""A web server before a station without a machine, for the Python clients."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "serve"))
sys.path.insert(0, str(Path(__file__).parents[1] / "serve" / "web"))
from web_parts import Station

from macromicro.remote.machine import Machine, connect
from macromicro.serve.web import WebServer


@pytest.fixture
def fake() -> Station:
    return Station()


@pytest.fixture
def server(fake: Station, tmp_path: Path) -> Iterator[WebServer]:
    with WebServer(fake, port=0, folder=tmp_path, token="sesame") as made:  # type: ignore[arg-type]
        yield made


@pytest.fixture
def client(server: WebServer) -> Iterator[Callable[..., Machine]]:
    """Makes clients; closes them in the end."""
    made: list[Machine] = []

    def make(**rest: Any) -> Machine:
        made.append(connect(*server.address, **{"token": "sesame", **rest}))
        return made[-1]

    yield make
    for each in made:
        each.close()
