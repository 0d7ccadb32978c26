"""Clients that die, fall silent, flood, send garbage or fight, on the real machine over SCPI."""

from __future__ import annotations

import contextlib
import random
import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from fault_parts import CLIENT, Scene, note

import faulty
from macromicro.serve.scpi import Server
from tests.waiting import until

PITCH = 0.2 / 2800.0


class Client:
    """A raw SCPI socket."""

    def __init__(self, server: Server) -> None:
        self.socket = socket.create_connection(server.address, timeout=30.0)
        self.file = self.socket.makefile("rb")

    def send(self, text: str) -> None:
        self.socket.sendall(text.encode() + b"\n")

    def ask(self, text: str) -> str:
        self.send(text)
        return self.file.readline().decode().removesuffix("\n")

    def die(self) -> None:
        """Go as a killed process on another computer goes: with a reset, no farewell."""
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self.file.close()
        self.socket.close()


class Served(Scene):
    """The scene with its SCPI server; clients take control themselves."""

    server: Server

    def client(self, *, control: bool = False) -> Client:
        made = Client(self.server)
        if control:
            assert made.ask("SYST:LOCK:REQ?") == "1"
        return made

    def moving(self, client: Client, counts: int = 1500) -> int:
        """The number of a macro move of the client that is under way."""
        client.send(f"MOVE:MACR {counts}")
        until(lambda: self.cells[faulty.CARRIAGE] / PITCH > 20.0)
        return self.station.snapshot().motion


@pytest.fixture
def served(scene: Callable[..., Scene]) -> Iterator[Served]:
    bench = scene()
    bench.__class__ = Served
    assert isinstance(bench, Served)
    bench.station.release(CLIENT)
    with Server(bench.station, port=0, folder=bench.folder) as bench.server:
        yield bench


def at_rest(bench: Served, since_ns: int) -> float:
    """Milliseconds from then until the motor was off for good (the carriage has braked)."""
    until(lambda: bench.cells[faulty.SAFE_AT] >= 0.0 and not bench.station.snapshot().motion)
    return float(bench.cells[faulty.SAFE_NS] - since_ns) * 1e-6


def test_a_client_killed_on_the_way(served: Served) -> None:
    client, other = served.client(control=True), served.client()
    motion = served.moving(client)
    began = time.monotonic_ns()
    client.die()
    end = served.end(motion)
    assert end.outcome == "lost"
    assert abs(end.evidence["way_counts"]) <= end.evidence["allowed_counts"]
    took = at_rest(served, began)
    told = [e for e in served.station.events()[1] if e.cause == "client lost"]
    assert told[0].evidence["why"] == "disconnected" and told[0].evidence["action"] == "stop"
    assert other.ask("MODE?") == '"stopped"'
    assert other.ask("SYST:LOCK:REQ?") == "1"  # control is free again
    run = served.run()
    assert np.array_equal(np.diff(np.round(run["t"] * 1e3)), np.ones(run.rows - 1))
    note("client killed", took, "decelerates, then 0 V", "event: client lost; motion: lost")


def test_a_half_open_client_that_falls_silent(served: Served) -> None:
    """The connection stands and nobody is there: the watchdog that it asked for tells."""
    client, other = served.client(control=True), served.client()
    client.send("SYST:LOCK:WATC 0.3")
    motion = served.moving(client, 2900)
    silent = time.monotonic_ns()
    end = served.end(motion)
    assert end.outcome == "lost"
    took = at_rest(served, silent)
    assert other.ask("SYST:LOCK:OWN?") == '""'
    assert "watchdog" in client.ask("SYST:ERR?")  # told, should it come back
    note("client half-open", took, "decelerates, then 0 V", "its error queue: control lost")


@contextlib.contextmanager
def pestering(client: Client, chunk: Callable[[], bytes]) -> Iterator[Callable[[], bool]]:
    """A client that sends as much as it is allowed to and reads nothing. Yields whether it has
    sent 100 kB, or was thrown out, which garbage may be at any byte."""
    sent, enough, out = [0], threading.Event(), threading.Event()

    def send() -> None:
        client.socket.settimeout(0.2)
        while not enough.is_set():
            with contextlib.suppress(TimeoutError):
                try:
                    sent[0] += client.socket.send(chunk())
                except TimeoutError:
                    raise
                except OSError:
                    out.set()
                    return

    thread = threading.Thread(target=send, daemon=True)
    thread.start()
    try:
        yield lambda: sent[0] >= 100_000 or out.is_set()
    finally:
        enough.set()
        thread.join()


@pytest.mark.parametrize("what", ["flood", pytest.param("garbage", marks=pytest.mark.slow)])
def test_a_pest_holds_up_nobody(what: str, served: Served) -> None:
    client, pest = served.client(control=True), served.client()
    random_bytes = random.Random(1)
    orders = b"POS?;:MODE?;:MOVE:MACR 2900\n" * 200

    def chunk() -> bytes:
        return orders if what == "flood" else random_bytes.randbytes(4000)

    with pestering(pest, chunk) as pestered:
        motion = served.moving(client, 300)
        assert served.end(motion).outcome == "done"
        answers = 0
        while not pestered() or answers < 20:
            assert client.ask("MODE?") == '"ready"'  # nothing of the pest's was done
            answers += 1
        safe = served.station.emergency()
    assert safe >= 0.0
    assert served.station.snapshot().fault is None
    run = served.run()
    assert np.array_equal(np.diff(np.round(run["t"] * 1e3)), np.ones(run.rows - 1))
    note(f"client: {what}", safe * 1e3, "goes on; this is the emergency stop's time", "-221, -1xx")


def test_two_clients_that_fight(served: Served) -> None:
    first, second = served.client(control=True), served.client()
    motion = served.moving(first)
    assert second.ask("SYST:LOCK:REQ?") == "0"
    for order in ("MOVE:MACR 0", "HOME", "DIS", "SYST:LOCK:REL", "FAULT:CLE"):
        second.send(order)
        assert second.ask("SYST:ERR?").startswith("-203")
    assert served.station.snapshot().motion == motion
    second.send("STOP")  # which everybody may
    end = served.end(motion)
    assert end.outcome == "stopped"
    first.send("SYST:LOCK:REL")
    assert first.ask("SYST:LOCK:OWN?") == '""'
    assert second.ask("SYST:LOCK:REQ?") == "1"
    note("two clients fighting", float("nan"), "the holder's motion goes on", "-203 to the other")
