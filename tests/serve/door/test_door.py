"""Every protocol's port before clients that mean harm, or are dead: one suite for all of them."""

from __future__ import annotations

import contextlib
import json
import os
import socket
import struct
import time
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import pytest
from tests.serve.fake_station import FakeStation
from tests.serve.scpi.client import Client
from tests.serve.web.web_parts import Client as Page
from tests.serve.web.web_parts import Station as PageStation
from tests.systems import linux
from tests.waiting import until

from macromicro.serve.door import _connection
from macromicro.serve.door._connection import Bounds
from macromicro.serve.epics import _channels
from macromicro.serve.epics.server import EpicsServer
from macromicro.serve.gcs import GcsServer
from macromicro.serve.gcs.server import BOUNDS
from macromicro.serve.hosts import LEAST_TOKEN
from macromicro.serve.listening import Listener
from macromicro.serve.scpi import Server
from macromicro.serve.web import WebServer

TOKEN = "open sesame, open sesame"


class Protocol(NamedTuple):
    """`who`: a query, answered by a line that begins with `answer`; `control`, `move`, `stop`,
    `token`: lines that take control (a GCS client moves), move, stop, and give a token."""

    serve: Callable[..., Listener]
    who: str
    answer: str
    control: str
    move: str
    stop: str
    token: str
    bounds: Bounds


SCPI = Protocol(
    lambda station, **rest: Server(station, port=0, **rest),
    "*IDN?",
    "macromicro,",
    "SYST:LOCK:REQ?",
    "MOVE:ABS 10 MM",
    "STOP",
    'SYST:AUTH "{}"',
    Bounds(),
)
GCS = Protocol(
    GcsServer,
    "*IDN?",
    "macromicro,",
    "",
    "MOV 1 10",
    "STP",
    "CCL 1 {}",
    BOUNDS,
)
LINES = pytest.mark.parametrize("spoken", [SCPI, GCS], ids=["scpi", "gcs"])


@pytest.fixture
def station() -> Any:
    return FakeStation()


@pytest.fixture
def serve(station: Any) -> Iterator[Callable[..., Callable[[], Client]]]:
    """Serves a protocol; gives what makes clients of it."""
    with contextlib.ExitStack() as stack:

        def start(spoken: Protocol, **rest: Any) -> Callable[[], Client]:
            server = stack.enter_context(spoken.serve(station, **rest))

            def make() -> Client:
                client = Client(server.address)
                stack.callback(client.close)
                return client

            return make

        yield start


def moving(client: Client, spoken: Protocol, station: Any) -> None:
    """In control, with a move under way."""
    if spoken.control:
        assert client.ask(spoken.control) == "1"
    client.send(spoken.move)
    until(lambda: bool(station.motion))


def untouched(station: Any) -> None:
    assert station.requests == [] and station.emergencies == 0 and station.holder == ""


def closed(client: Client) -> bool:
    try:
        return client.file.read() == b""
    except ConnectionError:
        return True


def alive(client: Client, spoken: Protocol) -> None:
    assert client.ask(spoken.who).startswith(spoken.answer)


FOREIGN = {
    "garbage": os.urandom(64).replace(b"\x18", b"x").join([b"\xf0", b"\n"]),
    "POST": b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: text/plain\r\n\r\n",
    "GET": b"GET /;ABOR;STP HTTP/1.1\r\n\r\n",
    "TLS": b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03",
    "SSH": b"SSH-2.0-OpenSSH_9.2p1\r\n",
    "PJL": b"\x1b%-12345X@PJL INFO STATUS\r\n",
}


@LINES
@pytest.mark.parametrize("data", FOREIGN.values(), ids=FOREIGN)
def test_nothing_of_another_protocol_is_done(
    serve: Any, station: Any, spoken: Protocol, data: bytes
) -> None:
    """Not even a stop; and nothing is said, not even what this is."""
    make = serve(spoken)
    client, deadly = make(), f"\n{spoken.control}\n{spoken.move}\n{spoken.stop}\n"
    client.socket.sendall(data + deadly.encode())
    assert closed(client)
    alive(make(), spoken)
    untouched(station)


@LINES
def test_an_endless_line_is_not_kept(serve: Any, station: Any, spoken: Protocol) -> None:
    """As a first line, and behind one: it is refused or let go, and holds nobody up."""
    make = serve(spoken)
    first, second, good = make(), make(), make()
    alive(second, spoken)
    for client in (first, second):
        client.socket.settimeout(0.3)
        with contextlib.suppress(TimeoutError, ConnectionError):
            for _ in range(20):
                client.socket.send(b"A" * 60_000)
    alive(good, spoken)
    untouched(station)


@LINES
def test_a_huge_line_is_refused(serve: Any, station: Any, spoken: Protocol) -> None:
    make = serve(spoken)
    client = make()
    alive(client, spoken)
    with contextlib.suppress(ConnectionError):  # GCS ends with it
        client.send("A" * (2 * spoken.bounds.line))
        client.send(spoken.move)
    alive(make(), spoken)
    untouched(station)


@LINES
def test_a_flood_that_reads_no_answers_is_let_go(
    serve: Any, station: Any, spoken: Protocol
) -> None:
    """And loses control, by which its motion ends."""
    bounds = spoken.bounds._replace(unread=0.3, rate=1e6, burst=1e6)
    make = serve(spoken, bounds=bounds)
    pest, good = make(), make()
    pest.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    moving(pest, spoken, station)
    query = {"scpi": "SYST:HELP:HEAD?\n", "gcs": "HLP?\n"}["scpi" if spoken is SCPI else "gcs"]
    pest.socket.settimeout(0.3)
    deadline = time.monotonic() + 30.0
    with contextlib.suppress(ConnectionError):
        while station.holder and time.monotonic() < deadline:
            with contextlib.suppress(TimeoutError):
                pest.socket.send(query.encode() * 100)
    until(lambda: station.holder == "" and station.ended[1].outcome == "lost")
    alive(good, spoken)


@LINES
def test_a_flood_is_done_no_faster_than_the_rate(
    serve: Any, station: Any, spoken: Protocol
) -> None:
    make = serve(spoken)
    pests, good = [make() for _ in range(4)], make()
    for pest in pests:
        pest.fill(f"{spoken.stop}\n".encode() * 1000)
    alive(good, spoken)
    assert 1 <= len(station.requests) < 4000  # each has sent tens of thousands


@LINES
@pytest.mark.parametrize("how", ["close", "reset"])
def test_a_client_that_goes_is_lost(serve: Any, station: Any, spoken: Protocol, how: str) -> None:
    """Also behind much that it has sent and nobody has read."""
    client = serve(spoken)()
    moving(client, spoken, station)
    client.socket.sendall(f"{spoken.who}\n".encode() * 300)
    getattr(client, how)()
    until(lambda: station.holder == "" and not station.connected)
    assert station.ended[1].outcome == "lost"


@LINES
def test_whom_nothing_can_be_taken_from_is_let_go(
    serve: Any, station: Any, spoken: Protocol
) -> None:
    """Alive or dead, that cannot be told; nor would a stop of it be heard."""
    serving = station.settings.serve._replace(client_timeout=0.5)
    station.settings = station.settings._replace(serve=serving)
    client = serve(spoken)()
    moving(client, spoken, station)
    client.fill(f"{spoken.who}\n".encode() * 10_000)
    until(lambda: station.holder == "" and not station.connected)


@LINES
def test_a_client_that_leaves_its_side_is_still_answered(
    serve: Any, station: Any, spoken: Protocol
) -> None:
    """As with `echo '*IDN?' | nc -N`."""
    client = serve(spoken)()
    client.send(spoken.who)
    client.socket.shutdown(socket.SHUT_WR)
    assert client.line().startswith(spoken.answer)
    assert closed(client)


@LINES
def test_wrong_tokens_end_the_connection(
    serve: Any, station: Any, spoken: Protocol, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(_connection, "PENALTY", 0.01)
    make = serve(spoken, token=TOKEN)
    client, own = make(), make()
    own.send(spoken.token.format(TOKEN))
    alive(own, spoken)
    client.send(spoken.move)
    for _ in range(5):
        client.send(spoken.token.format("guess"))
    assert closed(client)
    assert not station.motion
    moving(own, spoken, station)
    stopper = make()
    stopper.send(spoken.stop)  # needs no token
    until(lambda: not station.motion)


@LINES
def test_a_wrong_token_costs_time(serve: Any, station: Any, spoken: Protocol) -> None:
    client, began = serve(spoken, token=TOKEN)(), time.monotonic()
    client.send(spoken.token.format("guess"))
    alive(client, spoken)
    assert time.monotonic() - began >= 0.9 * _connection.PENALTY


@LINES
def test_too_many_clients_make_room(serve: Any, station: Any, spoken: Protocol) -> None:
    """Neither the silent ones nor those that only watch keep out who holds control."""
    make = serve(spoken, bounds=spoken.bounds._replace(clients=3, silent=4))
    holder = make()
    moving(holder, spoken, station)
    silent = [make() for _ in range(10)]
    watching = [make() for _ in range(6)]
    for each in watching:
        with contextlib.suppress(ConnectionError):
            each.ask(spoken.who)
    assert closed(silent[0]) and closed(watching[0])
    alive(holder, spoken)
    assert station.holder and station.motion


@LINES
def test_a_port_that_others_reach_needs_a_token(station: Any, spoken: Protocol) -> None:
    make: Any = Server if spoken is SCPI else GcsServer
    for token, words in ((None, "token"), ("x" * (LEAST_TOKEN - 1), f"{LEAST_TOKEN} characters")):
        with pytest.raises(Exception, match=words):
            make(station, "0.0.0.0", 0, token=token)


# The keep-alive timer that the system runs for each port's accepted sockets.


def timer(server: int, client: int) -> str:
    """That of the server's end of a connection, as /proc/net/tcp has it."""
    with open("/proc/net/tcp", encoding="ascii") as file:
        rows = [line.split() for line in file.readlines()[1:]]
    ends = f":{server:04X}", f":{client:04X}"
    return next(r[5] for r in rows if r[1].endswith(ends[0]) and r[2].endswith(ends[1]))


def probed(server: int, client: int) -> None:
    """The system asks within 5 s whether the other end lives (timer 02)."""
    until(lambda: timer(server, client).startswith("02:"))  # not while an answer is on its way
    ticks = int(timer(server, client).partition(":")[2], 16)
    assert ticks <= 5 * os.sysconf("SC_CLK_TCK")


@linux
@LINES
def test_the_system_asks_whether_a_client_lives(serve: Any, station: Any, spoken: Protocol) -> None:
    client = serve(spoken)()
    alive(client, spoken)
    probed(client.socket.getpeername()[1], client.socket.getsockname()[1])


# The records: Channel Access, which begins with a version message and carries no token.

VERSION = struct.pack(">HHHHII", 0, 0, 0, 13, 0, 0)
ECHO = struct.pack(">HHHHII", 23, 0, 0, 0, 0, 0)


@pytest.fixture
def records(station: Any, monkeypatch: pytest.MonkeyPatch) -> Iterator[EpicsServer]:
    for name in ("EPICS_CA_SERVER_PORT", "EPICS_CAS_SERVER_PORT", "EPICS_CAS_BEACON_PORT"):
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            monkeypatch.setenv(name, str(probe.getsockname()[1]))
    with EpicsServer(station, "T") as server:
        yield server


def answered(server: EpicsServer) -> socket.socket:
    """A circuit that was begun, and answers."""
    circuit = socket.create_connection(server.address, 10.0)
    circuit.sendall(VERSION + ECHO)
    said = b""
    while not said.endswith(ECHO):
        part = circuit.recv(4096)
        assert part, f"closed behind {said!r}"
        said += part
    return circuit


def ends(circuit: socket.socket) -> bool:
    circuit.settimeout(10.0)
    try:
        return circuit.recv(4096) == b""
    except ConnectionError:
        return True


@pytest.mark.parametrize("data", FOREIGN.values(), ids=FOREIGN)
def test_the_records_port_does_nothing_of_another_protocol(
    records: EpicsServer, station: Any, data: bytes
) -> None:
    with socket.create_connection(records.address, 10.0) as client:
        client.sendall(data + VERSION + ECHO)  # nor what is meant for it behind that
        assert ends(client)
    answered(records).close()
    untouched(station)


@linux
def test_the_system_asks_whether_a_circuit_lives(records: EpicsServer) -> None:
    with answered(records) as circuit:
        probed(records.address[1], circuit.getsockname()[1])


def test_circuits_are_counted(records: EpicsServer) -> None:
    """Those beyond the count are closed at once; the ones before go on."""
    held = [answered(records) for _ in range(_channels.MOST)]
    with socket.create_connection(records.address, 10.0) as client:
        assert ends(client)
    held[0].sendall(ECHO)
    assert held[0].recv(4096) == ECHO
    held.pop().close()
    until(lambda: not refused(records))
    for each in held:
        each.close()


def refused(server: EpicsServer) -> bool:
    with contextlib.suppress(AssertionError, ConnectionError):
        answered(server).close()
        return False
    return True


def test_a_circuit_that_floods_holds_nobody_up(records: EpicsServer, station: Any) -> None:
    with answered(records) as pest:
        pest.settimeout(0.3)
        with contextlib.suppress(TimeoutError, ConnectionError):
            for _ in range(200):
                pest.send(ECHO * 4000)
        answered(records).close()
    untouched(station)


def test_a_channel_access_message_that_is_none_ends_its_circuit(records: EpicsServer) -> None:
    with answered(records) as client:
        client.sendall(struct.pack(">HHHHII", 9999, 16, 0, 0, 0, 0) + b"x" * 16)
        client.sendall(struct.pack(">HHHHIIII", 4, 0xFFFF, 0, 0, 0, 0, 1 << 31, 1))
        client.settimeout(5.0)
        with contextlib.suppress(OSError):
            client.recv(4096)
    answered(records).close()


# The page: its port speaks HTTP, which is why it asks for host, origin and a hello.


@pytest.fixture
def page() -> Iterator[tuple[PageStation, WebServer]]:
    fake = PageStation()
    with WebServer(fake, port=0) as server:  # type: ignore[arg-type]
        yield fake, server


@pytest.mark.parametrize("data", FOREIGN.values(), ids=FOREIGN)
def test_the_page_s_port_does_nothing_of_another_protocol(page: Any, data: bytes) -> None:
    fake, server = page
    client = Client(server.address)
    client.socket.sendall(data + b'\n{"do": "emergency"}\nSTOP\nMOV 1 10\n')
    client.socket.settimeout(10.0)
    with contextlib.suppress(ConnectionError):
        while client.socket.recv(4096):
            pass
    client.close()
    assert not fake.requests and not fake.emergencies and not fake.holder
    own = Page(server.address[1], {})
    assert own.welcome["client"]
    own.close()


@linux
def test_the_system_asks_whether_a_page_lives(page: Any) -> None:
    _, server = page
    client = Page(server.address[1], {"frames": False})
    probed(server.address[1], client.socket.socket.getsockname()[1])
    client.close()


def test_a_page_that_sends_too_much_is_let_go(page: Any) -> None:
    _, server = page
    pest = Page(server.address[1], {})
    with pytest.raises(Exception, match=r"1009|1008"):
        pest.socket.send(json.dumps({"do": "x" * 100_000}))
        while True:
            pest.socket.recv(10.0)
    own = Page(server.address[1], {})
    own.close()
    pest.close()
