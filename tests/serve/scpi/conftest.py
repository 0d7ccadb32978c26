"""A fake station and a session on it; the tests of the server have their own."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from fake_station import FakeStation

from macromicro.serve._instrument import Instrument
from macromicro.serve.client import Capacity
from macromicro.serve.hosts import Token
from macromicro.serve.scpi import Server
from macromicro.serve.scpi._message import parse
from macromicro.serve.scpi._session import Session
from macromicro.serve.scpi.server import attempt
from macromicro.serve.scpi.tree import TREE

from .client import Client

Ask = Callable[..., str]
LOOP = asyncio.new_event_loop()


class Bench:
    """A session whose messages are done at once, as the connection does them."""

    def __init__(self, folder: Path, token: str | None = None) -> None:
        self.station = FakeStation()
        self.instrument = Instrument(self.station, folder=folder, token=Token(token))
        self.session = Session(self.instrument, "test", "127.0.0.1", Capacity(1, 1))

    def send(self, message: str | bytes) -> bytes:
        """The answers of a message, separated by semicolons; it never waits."""
        return LOOP.run_until_complete(self._send(message))

    async def _send(self, message: str | bytes) -> bytes:
        data = message.encode() if isinstance(message, str) else message
        found = parse(TREE, data)
        urgent, rest = found.parted()
        session = self.session
        for unit in urgent:
            await attempt(session, unit, session.stops, session.failed)
        if found.error is not None:
            session.fail(found.error)
        stops, failed, answers = session.stops, session.failed, []
        for unit in rest:
            answer = await attempt(session, unit, stops, failed)
            if answer is not None:
                answers.append(answer.encode() if isinstance(answer, str) else answer)
                session.answered = True
        session.answered = False
        return b";".join(answers)

    def ask(self, message: str) -> str:
        """The answers as text."""
        return self.send(message).decode()

    def errors(self) -> list[int]:
        """The numbers of all queued errors, taken out."""
        found = []
        while len(self.session.errors):
            found.append(self.session.errors.get().number)
        return found

    @property
    def requests(self) -> list[Any]:
        """What reached the station."""
        requests: list[Any] = self.station.requests
        return requests


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    """One that holds control."""
    bench = Bench(tmp_path)
    assert bench.ask("SYST:LOCK:REQ?") == "1"
    return bench


@pytest.fixture(scope="session")
def make_bench(tmp_path_factory: pytest.TempPathFactory) -> Callable[[], Bench]:
    """Fresh ones, without control."""
    folder = tmp_path_factory.mktemp("recordings")
    return lambda: Bench(folder)


@pytest.fixture
def watcher(tmp_path: Path) -> Bench:
    """One that does not hold control."""
    return Bench(tmp_path)


@pytest.fixture
def guarded(tmp_path: Path) -> Bench:
    """One with a token."""
    return Bench(tmp_path, "open sesame")


@pytest.fixture
def station() -> Any:
    """A fake station."""
    return FakeStation()


@pytest.fixture
def server(station, tmp_path) -> Iterator[Server]:
    with Server(station, port=0, folder=tmp_path) as server:
        yield server


@pytest.fixture
def connect(server) -> Iterator[Callable[[], Client]]:
    clients: list[Client] = []

    def make() -> Client:
        clients.append(Client(server.address))
        return clients[-1]

    yield make
    for client in clients:
        client.close()
