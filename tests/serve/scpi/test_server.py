"""The server on a socket: several clients, stops that overtake, clients that go or flood."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import sys
import time

import pytest
from tests.systems import posix
from tests.waiting import until

from macromicro.control.live import messages as m
from macromicro.errors import InputError
from macromicro.serve.door import _connection
from macromicro.serve.hosts import Token, is_loopback
from macromicro.serve.scpi import Bounds, Server

from .client import WAIT, Client


def test_question_and_answer(connect) -> None:
    client = connect()
    assert client.ask("*IDN?").startswith("macromicro,")
    assert client.ask("*OPC?;:SYST:ERR?;VERS?") == '1;0,"No error";1999.0'
    assert client.ask("SYST:CLI?") == f'"scpi 127.0.0.1:{client.socket.getsockname()[1]}"'
    client.send("")
    client.send("NONSENSE")
    assert client.ask("SYST:ERR?").startswith("-113,")


def test_an_answer_comes_in_one_segment(connect) -> None:
    client = connect()
    for _ in range(20):
        client.send("*IDN?;:MODE?")
        assert client.socket.recv(1 << 16).endswith(b"\n")


def test_one_holds_control_others_watch(connect, station) -> None:
    first, second = connect(), connect()
    assert first.ask("SYST:LOCK:REQ?") == "1"
    assert second.ask("SYST:LOCK:REQ?") == "0"
    assert first.ask("MOVE:ABS 10 MM;:SYST:ERR:COUN?") == "0"
    assert second.ask("MOVE:NUMB?;:MODE?") == '1;"moving-macro"'
    assert second.ask("MOVE:ABS 1 MM;:SYST:ERR:COUN?") == "2"  # of the request, and of the move
    assert first.ask("SYST:ERR:COUN?") == "0"  # each has a queue of its own
    assert second.ask("STOP;*OPC?") == "1"  # who watches may stop
    assert [type(r) for r in station.requests] == [m.MoveTo, m.Stop]


def test_opc_answers_when_the_motion_has_ended(connect, station) -> None:
    client, other = connect(), connect()
    client.ask("SYST:LOCK:REQ?")
    client.send("MOVE:ABS 10 MM;*OPC?;:SYST:ERR?")
    until(lambda: station.motion == 1)
    client.socket.settimeout(0.2)
    with pytest.raises(TimeoutError):
        client.socket.recv(1)
    assert other.ask("*OPC?") == "1"  # it has begun none
    client.socket.settimeout(WAIT)
    station.end("done")
    client.file = client.socket.makefile("rb")
    assert client.line() == '1;0,"No error"'
    client.send("MOVE:ABS 20 MM;*OPC?;:SYST:ERR?")
    until(lambda: station.motion == 2)
    station.end("stalled")
    assert client.line().startswith('1;-240,"Hardware error;move to 20 mm (motion 2) ended as st')


def test_wai_holds_the_next_order_back(connect, station) -> None:
    client = connect()
    client.ask("SYST:LOCK:REQ?")
    client.send("MOVE:ABS 10 MM;*WAI;:MOVE:ABS 20 MM;*OPC?")
    until(lambda: station.motion == 1)
    assert len(station.requests) == 1
    station.end("done")
    until(lambda: station.motion == 2)
    station.end("done")
    assert client.line() == "1"


def test_what_waits_behind_a_failed_motion_is_not_done(connect, station) -> None:
    client = connect()
    client.ask("SYST:LOCK:REQ?")
    client.send("MOVE:ABS 10 MM;*WAI;:MOVE:REL 5 MM;*OPC?")
    until(lambda: station.motion == 1)
    station.end("stalled")
    assert client.line() == "1"
    assert len(station.requests) == 1
    assert client.ask("SYST:ERR:COUN?") == "2"


@pytest.mark.parametrize("stop", ["ABOR", "STOP", ":abort;*OPC?", "*CLS;ABOR"])
def test_a_stop_overtakes_what_waits(connect, station, stop) -> None:
    """On the same connection, while *OPC? waits; what was sent before it is dropped."""
    client = connect()
    client.ask("SYST:LOCK:REQ?")
    client.send("MOVE:ABS 10 MM;*OPC?")
    client.send("MOVE:ABS 20 MM")
    client.send("MOVE:ABS 30 MM")
    until(lambda: station.motion == 1)
    client.send(stop)
    assert client.line() == "1"
    client.send("*OPC?")
    client.line()
    assert station.motion == 0
    assert [r for r in station.requests if isinstance(r, m.MoveTo)] == station.requests[:1]
    if "*CLS" not in stop:
        numbers = client.ask("SYST:ERR:ALL?") if "*OPC" not in stop else client.line()
        assert numbers
    station.mode = "ready"
    client.send("MOVE:ABS 40 MM")  # what comes after it is heard
    until(lambda: station.motion == 2)


@pytest.mark.parametrize("how", ["stop", "emergency"])
def test_anybodys_stop_overtakes_what_waits(connect, station, how) -> None:
    """Lines that wait behind *OPC? were sent before the stop: none of them begins anything."""
    first, second = connect(), connect()
    assert first.ask("SYST:LOCK:REQ?") == "1"
    first.send("MOVE:ABS 10 MM;*OPC?\nMOVE:ABS 20 MM\nENAB\nHOME\nSYST:ERR:ALL?")
    until(lambda: station.motion == 1)
    time.sleep(0.3)  # all of it has been read
    if how == "stop":
        assert second.ask("STOP;*OPC?") == "1"
    else:
        station.emergency("web")
    assert first.line() == "1"
    assert first.line().count("a stop came before it began") >= 2
    begun = [r for r in station.requests if not isinstance(r, m.Stop)]
    assert begun == [m.MoveTo(0.01, first_name(first))]
    station.mode = "ready"
    first.ask("MOVE:ABS 30 MM;:SYST:ERR:COUN?")  # sent behind it: done
    assert station.motion == 2


def first_name(client) -> str:
    return f"scpi 127.0.0.1:{client.socket.getsockname()[1]}"


@posix
def test_a_killed_client_loses_control_in_the_middle_of_a_move(server, station) -> None:
    code = (
        "import socket, sys, time\n"
        f"s = socket.create_connection({server.address!r})\n"
        "s.sendall(b'SYST:LOCK:REQ?;:MOVE:ABS 10 MM;*OPC?\\n')\n"
        "time.sleep(60)\n"
    )
    process = subprocess.Popen([sys.executable, "-c", code])
    try:
        until(lambda: station.motion == 1)
        assert station.holder.startswith("scpi 127.0.0.1:")
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
        until(lambda: station.holder == "" and station.ended[1].outcome == "lost")
    finally:
        process.kill()
        process.wait()


def test_orders_of_a_client_that_has_gone_are_not_done(server, station) -> None:
    """Only what was begun before; nothing that waited behind *WAI."""
    client = Client(server.address)
    client.ask("SYST:LOCK:REQ?")
    client.send("MOVE:ABS 10 MM;*WAI;:ENAB;:MOVE:ABS 20 MM")
    until(lambda: station.motion == 1)
    client.close()
    until(lambda: not station.connected)
    assert len(station.requests) == 1


def test_beats_and_watchdog(connect, station) -> None:
    client = connect()
    name = client.ask("SYST:CLI?").strip('"')
    client.ask("SYST:LOCK:REQ?")
    until(lambda: station.beats.count(name) > 3)  # a connection that is alive counts as alive
    client.send("SYST:LOCK:WATC 300 MS")
    assert client.ask("SYST:LOCK:WATC?") == "0.3"
    until(lambda: station.holder == "")
    assert client.ask("SYST:ERR?").startswith('-200,"Execution error;control lost')
    # Waiting for us is no silence.
    client.send("SYST:LOCK:REQ?;:MOVE:ABS 1 MM;*OPC?")
    until(lambda: station.motion == 1)
    time.sleep(1.0)
    assert station.holder == name
    station.end("done")
    assert client.line() == "1;1"


def test_garbage_and_long_lines_leave_the_others_alone(connect, station) -> None:
    bad, good = connect(), connect()
    assert bad.ask("*IDN?").startswith("macromicro,")
    bad.send(os.urandom(100_000).replace(b"#", b"x").replace(b"*", b"x"))
    bad.send(b"x" * 200_000)
    assert good.ask("*IDN?").startswith("macromicro,")
    assert bad.ask("\n*IDN?").startswith("macromicro,")
    found = bad.ask("SYST:ERR:ALL?")
    assert "-363," in found or "-350," in found
    assert station.requests == []


def test_a_flooding_client_starves_nobody(connect, station) -> None:
    """It is read no faster than the rate allows: what it sends beyond stays in its own
    socket, and the others are answered meanwhile."""
    flood, other = connect(), connect()
    flood.socket.setblocking(False)
    sent = 0

    def push() -> int:
        nonlocal sent
        with contextlib.suppress(BlockingIOError):
            for _ in range(200):
                sent += flood.socket.send(b"*IDN?;*IDN?;POS?\n" * 1000)
        return sent

    for _ in range(20):
        push()
        assert other.ask("*IDN?;POS?").startswith("macromicro,")
    until(lambda: push() == push())  # full: nothing is taken any more
    full = sent
    assert full < 20_000_000
    assert other.ask("SYST:LOCK:REQ?;:MOVE:ABS 1 MM;:ABOR;:SYST:ERR:COUN?") == "1;1"  # it was ended
    assert station.emergencies == 1


def gone(client: Client) -> bool:
    """Has the server ended this connection?"""
    try:
        return client.socket.recv(10) == b""
    except ConnectionResetError:
        return True


def test_a_newcomer_takes_the_place_of_the_one_silent_longest(connect, station) -> None:
    """Whoever sits in all places keeps nobody out; who holds control stays."""
    with Server(station, port=0, bounds=Bounds(clients=3)) as server:
        clients = [Client(server.address) for _ in range(3)]
        assert clients[0].ask("SYST:LOCK:REQ?") == "1"
        for k in (1, 2, 1):
            assert clients[k].ask("*IDN?")
        newcomers = [Client(server.address) for _ in range(2)]
        assert newcomers[0].ask("*IDN?;:STOP;*OPC?").startswith("macromicro,")
        assert gone(clients[2])
        assert newcomers[1].ask("*IDN?") and gone(clients[1])
        assert clients[0].ask("SYST:LOCK:OWN?") == f'"{first_name(clients[0])}"'
        assert len(station.connected) == 3
        for client in (*clients, *newcomers):
            client.close()


def test_who_gave_the_token_keeps_its_place(station) -> None:
    bounds = Bounds(clients=1)
    with Server(station, port=0, token="open sesame", bounds=bounds) as server:
        own, other = Client(server.address), Client(server.address)
        assert own.ask('SYST:AUTH "open sesame";:SYST:ERR:COUN?') == "0"
        other.send("*IDN?")
        assert gone(other) and own.ask("*IDN?")
        own.close()
        other.close()


def test_wrong_tokens_end_the_connection(station, monkeypatch) -> None:
    """They count for the address: a new connection has no new tries, nor has the page."""
    monkeypatch.setattr(_connection, "PENALTY", 0.01)
    token = Token("open sesame")
    with Server(station, port=0, token=token) as server:
        own = Client(server.address)
        assert own.ask('SYST:AUTH "open sesame";:SYST:LOCK:REQ?') == "1"
        client = Client(server.address)
        client.send("SYST:LOCK:REQ?")
        assert client.ask("SYST:ERR?").startswith("-203,")
        for _ in range(5):
            client.send('SYST:AUTH "guess"')
        assert client.line() == ""
        client.close()
        client = Client(server.address)
        words = client.ask('SYST:AUTH "open sesame";:SYST:ERR?')
        assert "too many wrong tokens from 127.0.0.1: wait" in words
        assert "wait" in token.problem("open sesame", "127.0.0.1")
        assert client.ask("STOP;:SYST:LOCK:REQ?;:SYST:ERR?").startswith('-203,"Command prot')
        assert own.ask('SYST:AUTH "open sesame";:FAN ON;:SYST:ERR:COUN?') == "0"  # it stays in
        own.close()
        client.close()


def test_small_packets_wait_for_nothing(connect, station, server, monkeypatch) -> None:
    """Each accepted socket sends at once what there is to send (TCP_NODELAY)."""
    seen: list[int] = []
    prepare = _connection.prepare

    def watched(accepted: socket.socket) -> None:
        prepare(accepted)
        seen.append(accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY))

    monkeypatch.setattr(_connection, "prepare", watched)
    connect().ask("*IDN?")
    assert seen == [1]


def test_port_in_use(server, station) -> None:
    host, port = server.address
    second = Server(station, host, port)
    with pytest.raises(
        InputError, match=f"port {port}: already in use on 127.0.0.1. Choose a free"
    ):
        second.start()
    second.stop()


@pytest.mark.parametrize(
    ("host", "port", "words"),
    [("no.such.host.invalid", 0, "host"), ("192.0.2.1", 0, "host"), ("127.0.0.1", 70000, "port")],
)
def test_address_that_cannot_be_had(station, host, port, words) -> None:
    with pytest.raises(InputError, match=words):
        Server(station, host, port).start()


def test_start_and_stop_again(station) -> None:
    server = Server(station, port=0)
    for _ in range(2):
        server.start()
        client = Client(server.address)
        assert client.ask("SYST:LOCK:REQ?") == "1"
        server.stop()
        with contextlib.suppress(ConnectionResetError):
            assert client.line() == ""
        client.close()
        assert station.holder == "" and station.connected == []
    server.stop()


def test_loopback() -> None:
    assert all(is_loopback(h) for h in ("127.0.0.1", "localhost", "::1", "127.1.2.3"))
    assert not any(is_loopback(h) for h in ("0.0.0.0", "::", "192.168.1.2", "lab.example", ""))
