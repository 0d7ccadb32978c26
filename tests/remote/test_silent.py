"""A server that does not respond any more: every call ends in time, and stops say what to do."""

from __future__ import annotations

import asyncio
import contextlib
import math
import socket
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from web_parts import Station

from macromicro.remote.asynchronous import AsyncMachine
from macromicro.remote.failures import ConnectionLost, RequestError, StopNotConfirmed
from macromicro.remote.machine import Machine, connect
from macromicro.serve.web import WebServer

TIMEOUT = 1.0
BOUND = 10.0  # generous: what waits for ever is caught
SILENT = r"not confirmed: the server does not respond\. Cut the power now\."
Make = Callable[..., Machine]


class Cable:
    """Between a client and a server, until it is pulled: then no byte passes, and no farewell."""

    def __init__(self, server: tuple[str, int]) -> None:
        self._server, self.pulled = server, threading.Event()
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.address = self._listening.getsockname()
        self._sockets: list[socket.socket] = []
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                near, _ = self._listening.accept()
                far = socket.create_connection(self._server)
                self._sockets += near, far
                for ends in ((near, far), (far, near)):
                    threading.Thread(target=self._carry, args=ends, daemon=True).start()

    def _carry(self, here: socket.socket, there: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while data := here.recv(65536):
                if self.pulled.is_set():
                    return
                there.sendall(data)
            there.shutdown(socket.SHUT_WR)

    def close(self) -> None:
        for each in (self._listening, *self._sockets):
            with contextlib.suppress(OSError):  # closed alone it stays open for who reads it
                each.shutdown(socket.SHUT_RDWR)
            each.close()


@pytest.fixture
def cable(server: WebServer) -> Iterator[Cable]:
    made = Cable(server.address)
    yield made
    made.close()


def machine(cable: Cable, **rest: Any) -> Machine:
    return connect(*cable.address, **{"token": "sesame", "timeout": TIMEOUT, **rest})


def within(seconds: float, act: Callable[[], Any]) -> Exception | None:
    """What a call raises; it must end in time."""
    raised: list[Exception | None] = []

    def call() -> None:
        try:
            act()
            raised.append(None)
        except Exception as error:
            raised.append(error)

    thread = threading.Thread(target=call, daemon=True)
    thread.start()
    thread.join(seconds)
    assert raised, "it waits for ever"
    return raised[0]


def test_stops_that_nobody_confirms_say_so(cable: Cable) -> None:
    stage = machine(cable, timeout=60.0)
    cable.pulled.set()
    for act, words in ((stage.emergency, "Emergency stop "), (stage.stop, "Stop ")):
        error = within(BOUND, act)
        assert isinstance(error, StopNotConfirmed) and isinstance(error, ConnectionLost)
        assert (
            str(error) == f"{words}not confirmed: the server does not respond. Cut the power now."
        )
        assert error.remedy == "cut the power now"
    assert within(BOUND, stage.close) is None


VERBS: dict[str, Callable[[Machine], object]] = {
    "state": lambda stage: stage.state,
    "enable": lambda stage: stage.enable(),
    "release": lambda stage: stage.release(),
    "move": lambda stage: stage.move_to(0.05, wait=False),
    "gains": lambda stage: stage.gains({"sequence.wait": 1.5}),
    "programme": lambda stage: stage.programme("thesis", wait=False),
    "traces": lambda stage: next(stage.traces(2.0)),
    "record": lambda stage: stage.record(),
}


def test_every_call_ends_in_time(tmp_path: Path) -> None:
    """Each of a server of its own, all at once."""

    def silent(verb: Callable[[Machine], object]) -> Exception | None:
        fake: Any = Station()
        with (
            WebServer(fake, port=0, folder=tmp_path, token="sesame") as server,
            contextlib.closing(Cable(server.address)) as cable,
        ):
            stage = machine(cable)
            cable.pulled.set()
            error = within(BOUND, lambda: verb(stage))
            within(BOUND, stage.close)
        return error

    with ThreadPoolExecutor(len(VERBS)) as pool:
        errors = dict(zip(VERBS, pool.map(silent, VERBS.values()), strict=True))
    for name, error in errors.items():
        assert isinstance(error, ConnectionLost), (name, error)
        assert "the server does not respond" in str(error), name


@pytest.mark.slow
def test_a_move_that_is_waited_for_ends_with_the_server(cable: Cable, fake: Station) -> None:
    """As long as the server lives its end is waited for, longer than the timeout."""
    stage = machine(cable)
    motion = stage.move_to(0.05, wait=False)
    with pytest.raises(TimeoutError):
        motion.wait(1.5 * TIMEOUT)
    cable.pulled.set()
    error = within(BOUND, motion.wait)
    assert isinstance(error, ConnectionLost) and "the server does not respond" in str(error)
    error = within(BOUND, stage.emergency)
    assert isinstance(error, StopNotConfirmed)
    error = within(BOUND, stage.close)
    assert isinstance(error, StopNotConfirmed)  # of the motion that this client began


@pytest.mark.slow
def test_the_end_of_a_with_block_does_not_hang(cable: Cable) -> None:
    def block(*, moves: bool) -> None:
        with machine(cable) as stage:
            if moves:
                stage.move_to(0.05, wait=False)
            cable.pulled.set()

    error = within(BOUND, lambda: block(moves=True))
    assert isinstance(error, StopNotConfirmed)
    cable.pulled.clear()


def test_the_end_of_a_with_block_that_moved_nothing_is_quiet(cable: Cable) -> None:
    def block() -> None:
        with machine(cable, timeout=60.0):
            cable.pulled.set()

    assert within(BOUND, block) is None


def test_a_server_that_never_answers_is_not_waited_for(cable: Cable) -> None:
    cable.pulled.set()
    error = within(BOUND, lambda: machine(cable))
    assert isinstance(error, ConnectionLost)


def test_stops_over_a_closed_connection_say_so(cable: Cable, server: WebServer) -> None:
    stage = machine(cable)
    server.stop()
    with pytest.raises(RequestError):
        while True:
            stage.enable()
    with pytest.raises(StopNotConfirmed, match=r"Emergency stop not .*closed.*Cut the power now\."):
        stage.emergency()
    stage.close()


def test_a_loop_that_does_not_answer_an_emergency_stop_is_told(
    client: Make, fake: Station, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The server answers, but knows no more than this client."""
    stage = client()
    monkeypatch.setattr(fake, "emergency", lambda name="": math.nan)
    with pytest.raises(StopNotConfirmed) as refusal:
        stage.emergency()
    words = "Emergency stop not confirmed: the control loop does not respond. Cut the power now."
    assert str(refusal.value) == words


@pytest.mark.slow
def test_asyncio_keeps_its_limits_too(cable: Cable) -> None:
    async def main() -> float:
        stage = AsyncMachine(*cable.address, token="sesame", timeout=TIMEOUT)
        async with asyncio.timeout(3.0 * BOUND):
            await stage.open()
            waits = asyncio.create_task(stage.move_to(0.05))
            await asyncio.sleep(0.2)
            cable.pulled.set()
            began = time.monotonic()
            with pytest.raises(StopNotConfirmed, match=SILENT):
                await stage.emergency()
            took = time.monotonic() - began
            with pytest.raises(ConnectionLost):
                await waits
            with contextlib.suppress(StopNotConfirmed):
                await stage.close()
        return took

    assert asyncio.run(main()) < BOUND
