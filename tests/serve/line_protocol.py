"""A third protocol in one file, to show what `serve.client` does for any of them.

Lines of words: `TOKEN secret`, `TAKE`, `WATCHDOG 2` (s), `WHERE`, `MOVE 12.5` (mm), any request
that has no value by its name (`HOME`, `ENABLE`), `STOP` and `EMERGENCY`. Each is answered by one
line, `ok ...` or `no ...`, in the order in which they are done: stops come before what waits.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import time
from typing import Any

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Refused, Reply
from macromicro.serve._instrument import Instrument
from macromicro.serve.bucket import Bucket
from macromicro.serve.client import Capacity, Client, Entry, Waiting
from macromicro.serve.hosts import TRIES, Token
from macromicro.serve.listening import Listener
from macromicro.serve.requests import KINDS, OVERTAKEN, STOPS

CLIENTS, SILENT, WAITING = 4, 8, 16
RATE, BURST = 100.0, 100.0  # lines a second, and at once
BEAT_S = 0.05
_UNKNOWN = Refused("no such line", "TOKEN, TAKE, WATCHDOG, WHERE, MOVE or a request's name")
_NO_TOKEN = Refused("this client has not given the token", "TOKEN first")


class LineConnection:
    """One client's lines."""

    def __init__(
        self,
        instrument: Instrument,
        capacity: Capacity,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
    ) -> None:
        address, port = writer.get_extra_info("peername")[:2]
        self.client = Client(instrument, f"line {address}:{port}", address, capacity)
        self._reader, self._writer = reader, writer
        self._waiting: Waiting[list[str]] = Waiting(self.client, WAITING)
        self._bucket = Bucket(RATE, BURST)
        self.heard = time.monotonic()

    @property
    def rank(self) -> int:
        return self.client.rank

    def dismiss(self) -> None:
        self._writer.transport.abort()

    def beat(self) -> None:
        if not self.client.beat(time.monotonic() - max(self.heard, self._waiting.rested)):
            lost = Refused("control lost: silent for longer than the watchdog", "TAKE")
            self._answer(lost)

    async def run(self) -> None:
        tasks = [asyncio.create_task(self._read())]
        tasks.append(asyncio.create_task(self._waiting.work(self._do)))
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            self.client.close()
            for task in tasks:
                task.cancel()
            self._writer.transport.abort()

    async def _read(self) -> None:
        with contextlib.suppress(ValueError, OSError):  # a line without an end; a reset
            line = await self._reader.readline()
            if line and self.client.capacity.claim(self):
                self.client.connect()
                while line:
                    await self._hear(line)
                    line = await self._reader.readline()

    async def _hear(self, line: bytes) -> None:
        """Stops are done here; the rest waits for its turn."""
        self.heard = time.monotonic()
        await self._bucket.take(self.client.price)
        words = line.decode("ascii", "replace").lower().split()
        kind = KINDS.get(" ".join(words))
        if kind is not None and kind.access == STOPS:
            for _ in self._waiting.drop():
                self._answer(OVERTAKEN)
            act = self._stop if kind.message is m.Stop else self._emergency
            self._answer(await act())
        elif not self._waiting.offer(words):
            self._answer(Refused("too many lines wait", "wait for answers"))

    async def _stop(self) -> Reply:
        return await self.client.stop()

    async def _emergency(self) -> Reply:
        silent = math.isnan(await self.client.emergency())
        return Refused("the loop did not answer", "the supply") if silent else Accepted()

    async def _do(self, entry: Entry[list[str]]) -> bool:
        if entry.order[:1] == ["where"]:
            now = self.client.station.snapshot()
            self._say(f"ok {now.position_m * 1e3:.4f} mm, {'' if now.trusted else 'not '}trusted")
            return True
        try:
            self._answer(await self._order(entry))
        except ValueError:
            self._answer(_UNKNOWN)
        return self.client.failures < TRIES

    async def _order(self, entry: Entry[list[str]]) -> Reply:
        client, (word, *given) = self.client, [*entry.order, ""]
        if word == "token":
            problem = client.authenticate(given[0])
            return Refused(problem, "") if problem else Accepted()
        if word == "watchdog":
            client.watchdog = _number(given[0])
            return Accepted()
        if not client.authenticated:
            return _NO_TOKEN
        if word == "take":
            return client.take()
        if word == "move":
            return await client.request(m.MoveTo(_number(given[0]) * 1e-3), entry)
        kind = KINDS.get(" ".join(entry.order))
        known = kind is not None and not kind.fields
        return await client.request(kind.message(), entry) if known else _UNKNOWN

    def _answer(self, reply: Reply) -> None:
        if isinstance(reply, Accepted):
            self._say(f"ok {reply.id}" if reply.id else "ok")
        else:
            self._say(f"no; {reply.reason}; {reply.remedy}")

    def _say(self, text: str) -> None:
        self._writer.write(f"{text}\n".encode())


def _number(text: str) -> float:
    """A finite number; ValueError for anything else."""
    found = float(text)
    if not math.isfinite(found):
        raise ValueError(text)
    return found


class LineServer(Listener):
    """The protocol at a port."""

    def __init__(self, station: Any, token: str | None = None) -> None:
        super().__init__("line", "127.0.0.1", 0)
        self._instrument = Instrument(station, token=Token(token))

    async def _serve(self) -> None:
        capacity = Capacity(CLIENTS, SILENT, yielding=True)
        living: dict[LineConnection, asyncio.Task[None] | None] = {}

        async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            connection = LineConnection(self._instrument, capacity, reader, writer)
            capacity.arrive(connection)
            living[connection] = asyncio.current_task()
            with contextlib.suppress(asyncio.CancelledError):  # the server ends
                await connection.run()
            capacity.leave(connection)
            del living[connection]

        server = await asyncio.start_server(serve, *self._where, limit=256)
        self._listening(*server.sockets[0].getsockname()[:2])
        try:
            while True:
                await asyncio.sleep(BEAT_S)
                for connection in living:
                    connection.beat()
        finally:
            server.close()
            tasks = [task for task in living.values() if task is not None]
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
