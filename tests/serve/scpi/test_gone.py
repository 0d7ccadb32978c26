"""Clients that die behind much that they have sent, flood with stops, or never end a block."""

from __future__ import annotations

import threading
import time

import pytest
from tests.waiting import until

from macromicro import programme
from macromicro.control.live import messages as m
from macromicro.serve.scpi import Bounds, Server

from .client import Client

PATIENCE = 0.5  # s: serve.client_timeout


@pytest.fixture
def strict(station):
    """A station that gives up soon."""
    return giving_up(station, PATIENCE)


def giving_up(station, client_timeout: float):
    serve = station.settings.serve._replace(client_timeout=client_timeout)
    station.settings = station.settings._replace(serve=serve)
    return station


def moving(client: Client, station) -> None:
    """In control, with a move under way that the client waits for."""
    assert client.ask("SYST:LOCK:REQ?") == "1"
    client.send("MOVE:ABS 10 MM;*OPC?")
    until(lambda: station.motion == 1)


@pytest.mark.parametrize("how", [pytest.param("close", marks=pytest.mark.slow), "reset"])
def test_the_end_is_noticed_behind_a_full_socket(station, how) -> None:
    """Its end waits in the client's own system, behind what nobody takes."""
    with Server(giving_up(station, 4.0), port=0) as server:
        client = Client(server.address)
        moving(client, station)
        assert client.fill(b"POS?\n" * 10_000) > 500_000
        assert station.holder
        getattr(client, how)()
        until(lambda: station.holder == "" and not station.connected)
        assert station.ended[1].outcome == "lost"


def test_a_patient_client_that_is_far_ahead_stays(strict) -> None:
    """What it has sent is in memory here: its end would be seen."""
    with Server(strict, port=0) as server:
        client = Client(server.address)
        moving(client, strict)
        client.send(b"POS?\n" * 3000)
        time.sleep(3 * PATIENCE)
        assert strict.motion == 1 and strict.holder
        strict.end("done")
        assert client.line() == "1" and client.line().startswith("42.1234,")
        client.close()


@pytest.mark.slow
def test_a_flood_of_stops_is_few_and_ends_with_its_client(server, station) -> None:
    pests = [Client(server.address) for _ in range(4)]
    for pest in pests:
        pest.fill(b"ABOR;" * 1000 + b"\n")
    assert 4 <= station.emergencies < 1000  # each had sent hundreds of thousands
    other = Client(server.address)
    assert other.ask("STOP;:MODE?") == '"disabled"'
    for pest in pests:
        pest.close()
    until(lambda: len(station.connected) == 1)  # their places are free
    heard = station.emergencies
    time.sleep(0.5)
    assert station.emergencies == heard
    other.close()


def test_one_who_talks_while_the_server_is_slow_is_not_silent(strict) -> None:
    with Server(strict, port=0, bounds=Bounds(messages=4, rate=20.0, burst=5.0)) as server:
        client = Client(server.address)
        assert client.ask("SYST:LOCK:REQ?;:SYST:LOCK:WATC 0.2;WATC?") == "1;0.2"
        client.send("*CLS\n" * 30)
        for _ in range(20):  # its queue is full all the time
            client.send("*CLS")
            time.sleep(0.05)
            assert strict.holder
        # It falls silent: the watchdog's time counts, and the bound of the server's own.
        until(lambda: strict.holder == "")
        client.close()


def test_a_stop_does_not_wait_for_a_programme_being_loaded(connect, station, monkeypatch) -> None:
    load, begun, go_on = programme.load, threading.Event(), threading.Event()

    def slow(*given):
        begun.set()
        assert go_on.wait(10.0)
        return load(*given)

    monkeypatch.setattr(programme, "load", slow)
    client = connect()
    assert client.ask("SYST:LOCK:REQ?") == "1"
    client.send('PROG:LOAD "thesis";RUN')
    assert begun.wait(10.0)
    client.send("STOP")
    until(lambda: bool(station.requests))
    go_on.set()
    assert client.ask("PROG:NAME?") == '"thesis"'
    assert station.requests == [m.Stop(station.holder)]  # what it was to run came before the stop


def test_a_programme_s_stop_overtakes_and_needs_no_control(connect, station) -> None:
    client, other = connect(), connect()
    assert client.ask("SYST:LOCK:REQ?") == "1"
    for stopper in (client, other):
        client.send('PROG:LOAD "thesis";RUN;*OPC?')
        until(lambda: station.motion > 0)
        stopper.send("PROG:STOP")
        assert client.line() == "1"
        assert "ended as stopped" in client.ask("SYST:ERR:ALL?")
        assert other.ask("SYST:ERR:COUN?") == "0"


def test_a_block_that_is_too_long_ends_the_connection(connect, station) -> None:
    """Nothing behind it could be told from its bytes, so nothing would be heard."""
    client = connect()
    moving(client, station)
    client.send("PROG:LOAD #9999999999")
    until(lambda: station.holder == "" and not station.connected)
    assert station.ended[1].outcome == "lost"


def test_a_block_that_does_not_go_on_ends_the_connection(station) -> None:
    with Server(station, port=0, bounds=Bounds(unread=0.5)) as server:
        client, other = Client(server.address), Client(server.address)
        assert client.ask("SYST:LOCK:REQ?") == "1"
        other.send("STOP;:*ID")  # an unfinished line is no block
        client.send(b"PROG:LOAD #71000000" + b"x" * 60_000)
        client.send("STOP")
        until(lambda: station.holder == "" and len(station.connected) == 1)
        other.close()
        client.close()


def test_large_messages_wait_for_each_other_and_are_all_done(station) -> None:
    """They are read no further ahead than `waiting` bytes."""
    text = b'title = "Long"\n[[moves]]\nmicro = "1 mm"\nhold = "1 s"\n#' + b"x" * 40_000
    with Server(station, port=0, bounds=Bounds(waiting=100_000, rate=1e5, burst=1e5)) as server:
        client = Client(server.address)
        for _ in range(10):
            client.send(b"PROG:LOAD #5%d" % len(text) + text)
        assert client.ask("PROG:NAME?;:SYST:ERR:COUN?") == '"Long";0'
        client.close()


def test_a_line_of_quotes_holds_nobody_up(connect) -> None:
    """It takes time to frame, which its sender has to wait for."""
    pest, other = connect(), connect()
    assert pest.fill(b'"' * 60_000) < 30_000_000
    assert other.ask("*IDN?").startswith("macromicro,")
