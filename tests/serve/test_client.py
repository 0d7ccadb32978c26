"""What every client needs is there for any protocol: shown by one of a single file."""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from fake_station import FakeStation
from line_protocol import CLIENTS, WAITING, LineServer

from macromicro.control.live import messages as m
from macromicro.serve._instrument import Instrument
from macromicro.serve.client import Client, Entry, Waiting
from macromicro.serve.hosts import TRIES
from macromicro.serve.requests import OVERTAKEN
from tests.waiting import until


class Station(FakeStation):
    """`open`: while it is not set, requests but stops wait."""

    def __init__(self) -> None:
        super().__init__()
        self.open = threading.Event()
        self.open.set()
        self.entered = 0

    async def order(self, client: str, request: Any, since: Any = None) -> m.Reply:
        return await asyncio.to_thread(self.request, client, request, since)

    def request(self, client: str, request: Any, since: Any = None) -> m.Reply:
        self.entered += 1
        if not isinstance(request, m.Stop):
            assert self.open.wait(30.0)
        return super().request(client, request, since)


class Line:
    """A client that speaks it."""

    def __init__(self, address: tuple[str, int]) -> None:
        self.socket = socket.create_connection(address, 10.0)
        self._file = self.socket.makefile("r")

    def send(self, *lines: str) -> None:
        self.socket.sendall("".join(f"{line}\n" for line in lines).encode())

    def line(self) -> str:
        return self._file.readline().rstrip("\n")

    def ask(self, line: str) -> str:
        self.send(line)
        return self.line()

    def close(self) -> None:
        self._file.close()
        self.socket.close()


Connect = Callable[[], Line]


@pytest.fixture
def station() -> Station:
    return Station()


@pytest.fixture
def connect(station: Station, request: pytest.FixtureRequest) -> Iterator[Connect]:
    """Clients of a server; its token is the test's parameter, or none is asked for."""
    lines: list[Line] = []
    with LineServer(station, getattr(request, "param", None)) as server:

        def make() -> Line:
            lines.append(Line(server.address))
            return lines[-1]

        yield make
        for line in lines:
            line.close()


def test_a_move_and_where_it_is(connect: Connect, station: Station) -> None:
    client = connect()
    assert client.ask("MOVE 12.5").startswith("no; this client does not hold control")
    assert client.ask("take") == "ok"
    assert client.ask("MOVE 12.5") == "ok 1"
    assert station.requests == [m.MoveTo(0.0125, station.holder)]
    assert client.ask("WHERE") == "ok 42.1234 mm, trusted"
    assert client.ask("MOVE far").startswith("no; no such line")
    assert client.ask("dance").startswith("no; no such line")


def test_a_request_of_the_table_needs_no_line_of_its_own(
    connect: Connect, station: Station
) -> None:
    client = connect()
    client.ask("TAKE")
    assert client.ask("HOME") == "ok 1"
    assert client.ask("DISABLE") == "ok"
    assert client.ask("FAN").startswith("no; no such line")  # it has a value
    assert [type(r) for r in station.requests] == [m.Home, m.Disable]


@pytest.mark.parametrize("connect", ["open sesame"], indirect=True)
def test_a_token_is_needed_for_all_but_looking_and_stopping(
    connect: Connect, station: Station
) -> None:
    client = connect()
    for line in ("TAKE", "MOVE 1", "HOME"):
        assert client.ask(line).startswith("no; this client has not given the token")
    assert client.ask("WHERE").startswith("ok") and client.ask("STOP") == "ok"
    assert client.ask("EMERGENCY") == "ok" and station.emergencies == 1
    assert client.ask("TOKEN sesame").startswith("no; this is not the token")
    assert client.ask("TOKEN open").startswith("no; this is not the token")
    assert client.ask("TAKE").startswith("no;") and station.holder == ""


@pytest.mark.parametrize("connect", ["sesame"], indirect=True)
def test_guesses_are_counted_by_address(connect: Connect, station: Station) -> None:
    inside, guesser = connect(), connect()
    assert inside.ask("TOKEN sesame") == "ok"
    for _ in range(TRIES):
        assert guesser.ask("TOKEN guess").startswith("no; this is not")
    assert guesser.line() == ""  # its connection is ended
    again = connect()
    assert again.ask("TOKEN sesame").startswith("no; too many wrong tokens from 127.0.0.1")
    assert inside.ask("TOKEN sesame") == "ok" and inside.ask("TAKE") == "ok"


@pytest.mark.parametrize("stop", ["STOP", "EMERGENCY"])
def test_a_stop_overtakes_what_waits_and_what_is_on_its_way(
    connect: Connect, station: Station, stop: str
) -> None:
    client = connect()
    client.ask("TAKE")
    station.open.clear()
    client.send("MOVE 1")
    until(lambda: station.entered == 1)
    client.send("MOVE 2", "FAN", stop)
    until(lambda: station.emergencies or m.Stop(station.holder) in station.requests)
    station.open.set()
    answers = sorted(client.line() for _ in range(4))
    assert answers[-1] == "ok"
    assert all(a.startswith("no; a stop came before it began") for a in answers[:-1])
    assert station.motion == 0 and m.MoveTo not in {type(r) for r in station.requests}
    assert client.ask("WHERE").startswith("ok")  # and it goes on


def test_a_stop_of_another_client_overtakes_too(connect: Connect, station: Station) -> None:
    client, other = connect(), connect()
    client.ask("TAKE")
    station.open.clear()
    client.send("MOVE 1")
    until(lambda: station.entered == 1)
    assert other.ask("STOP") == "ok"
    station.open.set()
    assert client.line().startswith("no; a stop came") and station.motion == 0


def test_too_many_waiting_lines_are_refused(connect: Connect, station: Station) -> None:
    client = connect()
    client.ask("TAKE")
    station.open.clear()
    client.send("MOVE 1")
    until(lambda: station.entered == 1)
    client.send(*["WHERE"] * (WAITING + 1))
    assert client.line().startswith("no; too many lines wait")
    station.open.set()
    assert client.line() == "ok 1"


def test_a_client_that_goes_is_lost(connect: Connect, station: Station) -> None:
    client = connect()
    client.ask("TAKE")
    client.ask("MOVE 5")
    client.close()
    until(lambda: station.ended)
    assert station.ended[1].outcome == "lost" and station.holder == "" and not station.connected


def test_a_silent_client_loses_control_by_its_watchdog(connect: Connect, station: Station) -> None:
    client = connect()
    client.ask("TAKE")
    client.ask("MOVE 5")
    until(lambda: station.beats)  # until then the server says that it lives
    assert client.ask("WATCHDOG 0.2") == "ok"
    assert client.line().startswith("no; control lost: silent for longer")
    assert station.ended[1].outcome == "lost" and station.holder == ""
    assert client.ask("TAKE") == "ok"


def test_who_may_command_takes_a_strangers_place(connect: Connect, station: Station) -> None:
    holder = connect()
    assert holder.ask("TAKE") == "ok"
    others = [connect() for _ in range(CLIENTS - 1)]
    assert all(each.ask("WHERE").startswith("ok") for each in others)
    late = connect()
    assert late.ask("WHERE").startswith("ok")
    assert others[0].line() == "" and holder.ask("WHERE").startswith("ok")


def test_a_line_without_an_end_ends_the_connection(connect: Connect, station: Station) -> None:
    client = connect()
    client.ask("WHERE")
    client.socket.sendall(b"x" * 4096)
    assert client.line() == ""
    until(lambda: not station.connected)


def test_what_is_dropped_makes_room_and_the_end_stays(station: Station) -> None:
    async def main() -> list[int]:
        client, done = Client(Instrument(station), "a"), []  # type: ignore[arg-type]
        waiting: Waiting[int] = Waiting(client, 3, largest=100)

        async def do(entry: Entry[int]) -> bool:
            done.append(entry.order)
            return True

        await waiting.put(1, 60)
        late = asyncio.create_task(waiting.put(2, 60))
        await asyncio.sleep(0.05)
        assert waiting.drop() == [1] and not late.done()
        await late
        await waiting.end()
        assert waiting.busy and waiting.drop() == [2]
        assert waiting.offer(3)  # behind the end, which nothing passes
        await asyncio.wait_for(waiting.work(do), 5.0)
        return done

    assert asyncio.run(main()) == []


def test_an_order_from_before_a_stop_does_not_reach_the_station(station: Station) -> None:
    client = Client(Instrument(station), "a")  # type: ignore[arg-type]
    station.acquire("a")
    entry = Entry("fan", client.stops, station.stops, 0)
    assert asyncio.run(client.request(m.Fan(True), entry)) == m.Accepted()
    asyncio.run(client.stop())
    assert asyncio.run(client.request(m.Fan(True), entry)) == OVERTAKEN
    assert [type(r) for r in station.requests] == [m.Fan, m.Stop]
