"""A GCS server before a station without a machine."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))
from fake_station import FakeStation
from tests.serve.scpi.client import Client

from macromicro.serve.gcs import GcsServer


@pytest.fixture
def fake() -> FakeStation:
    found = FakeStation()
    found.trusted = True
    return found


@pytest.fixture
def connect(fake: FakeStation, request: pytest.FixtureRequest) -> Iterator[Callable[[], Client]]:
    """Makes clients of one server; its token is the fixture's parameter, if it has one."""
    made: list[Client] = []
    token = getattr(request, "param", None)
    with GcsServer(fake, token=token) as server:  # type: ignore[arg-type]

        def make() -> Client:
            made.append(Client(server.address))
            return made[-1]

        yield make
        for each in made:
            each.close()
