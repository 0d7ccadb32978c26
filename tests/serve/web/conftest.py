"""A web server before a station without a machine; the page in a browser, before the bench."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from macromicro.serve import station as real
from macromicro.serve.web import WebServer
from tests import browser
from tests.serve.quick import quick

sys.path.insert(0, str(Path(__file__).parent))
from page_parts import SPARING, Page
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


@pytest.fixture(scope="package")
def profile(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("web")


@pytest.fixture(scope="package")
def station(profile: Path) -> Iterator[real.Station]:
    """The virtual bench. Neither a page nor the loop is lost because the computer is busy."""
    patient = quick(client_timeout=60.0, loop_timeout=5.0)
    with real.Station(settings=patient, state=profile / "state.json") as made:
        yield made


@pytest.fixture(scope="package")
def driver(profile: Path) -> Iterator[Any]:
    """A browser, one for all pages."""
    browser.needed()
    made = browser.driver(profile / "browser", "127.0.0.1")
    yield made
    made.quit()


@pytest.fixture(scope="package")
def page(driver: Any, station: real.Station, profile: Path) -> Iterator[Page]:
    with WebServer(station, port=0, folder=profile, bounds=SPARING) as server:
        yield Page(driver, server, station)


@pytest.fixture
def ready(page: Page) -> Page:
    page.ready()
    return page
