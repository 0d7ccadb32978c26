"""A station without a machine and a raw client, for tests of the web server."""

from __future__ import annotations

import asyncio
import json
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from fake_station import FakeStation
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from macromicro.control.live import messages as m
from macromicro.serve.hosts import STARTING
from macromicro.serve.settings import LiveSettings
from macromicro.serve.shared import INDEX, NAMES


class Station(FakeStation):
    """`open`: while it is not set, requests but stops wait. Telemetry grows by 33 rows a look."""

    def __init__(self) -> None:
        super().__init__()
        self.settings = LiveSettings()
        self.rig = "twin"
        self.open = threading.Event()
        self.open.set()
        self.entered: list[str] = []
        self.written = 5000
        self.grow = 33
        self.recorded: tuple[Path, ...] = ()

    async def order(self, client: str, request: Any, since: Any = None) -> m.Reply:
        return await asyncio.to_thread(self.request, client, request, since)

    def request(self, client: str, request: Any, since: Any = None) -> m.Reply:
        self.entered.append(type(request).__name__)
        if not isinstance(request, m.Stop):
            assert self.open.wait(30.0)
        return super().request(client, request, since)

    def record(self, path: Path, *, overwrite: bool = False, client: str = "") -> None:
        super().record(path, overwrite=overwrite)
        self.recorded = (*self.recorded, path)

    def telemetry(self, since: int = -1) -> tuple[int, Any, Any]:
        self.written += self.grow
        first = max(since + 1, self.written - 60_000, 0)
        numbers = np.arange(first, self.written, dtype=float)
        block = np.ones((len(NAMES), numbers.size))
        block[INDEX["t"]] = numbers * 1e-3
        block[INDEX["temperature_estimate"]] = 25.0
        return self.written - 1, block, NAMES


class Client:
    """A WebSocket that speaks as the page does. `max_queue`: frames that it takes before they are
    read; without that bound, it hears the end of a connection behind them."""

    def __init__(self, port: int, hello: dict[str, Any] | None = None, **rest: Any) -> None:
        rest.setdefault("origin", f"http://127.0.0.1:{port}")
        rest.setdefault("close_timeout", 1.0)
        rest.setdefault("max_queue", None)
        rest |= {"proxy": None, "max_size": None, "ping_interval": None}
        self.number = 0
        self.seen: list[dict[str, Any]] = []
        self.frames: list[bytes] = []
        self.welcome: dict[str, Any] = {}
        deadline = time.monotonic() + 60.0
        while not self.welcome:
            self._open = connect(f"ws://127.0.0.1:{port}/live", **rest)
            self.socket: ClientConnection = self._open.__enter__()
            if hello is None:
                return
            try:
                self.put(do="hello", **hello)
                self.welcome = self.get("welcome")
            except ConnectionClosed as closed:  # a page may come before its machine has started
                starts = closed.rcvd is not None and closed.rcvd.code == STARTING[0]
                if not starts or time.monotonic() > deadline:
                    raise
                time.sleep(0.05)

    def put(self, **message: Any) -> None:
        self.socket.send(json.dumps(message))

    def read(self) -> dict[str, Any] | None:
        """The next message; None for a frame, which is kept."""
        message = self.socket.recv(10.0)
        if isinstance(message, bytes):
            self.frames.append(message)
            return None
        found: dict[str, Any] = json.loads(message)
        self.seen.append(found)
        return found

    def get(self, key: str, wanted: Callable[[Any], bool] = lambda value: True) -> Any:
        """The next message that has this key, with a value that is wanted."""
        deadline = time.monotonic() + 30.0
        while time.monotonic() < deadline:
            message = self.read()
            if message is not None and key in message and wanted(message[key]):
                return message[key] if key != "reply" else message
        raise AssertionError(f"no {key} came")

    def begin(self, do: str, **fields: Any) -> int:
        """Send an order; its number."""
        self.number += 1
        self.put(do=do, id=self.number, **fields)
        return self.number

    def reply(self, number: int) -> dict[str, Any]:
        for message in self.seen:
            if message.get("reply") == number:
                return message
        found: dict[str, Any] = self.get("reply", lambda value: value == number)
        return found

    def order(self, do: str, **fields: Any) -> dict[str, Any]:
        return self.reply(self.begin(do, **fields))

    def close(self) -> None:
        self._open.__exit__(None, None, None)
