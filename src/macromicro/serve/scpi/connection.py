"""One client's connection: what it sends is read, done in order, and answered."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import time
from collections.abc import Callable
from concurrent.futures import Executor
from typing import NamedTuple, TypeVar

from macromicro.serve.scpi.device import Device
from macromicro.serve.scpi.errors import ScpiError
from macromicro.serve.scpi.framing import BLOCK_LIMIT, LINE_LIMIT, Framer
from macromicro.serve.scpi.message import Message, Unit, parse
from macromicro.serve.scpi.session import Session
from macromicro.serve.scpi.system import MOST_FAILURES
from macromicro.serve.scpi.tree import TREE

POLL = 0.02  # s between two looks at motions that *OPC? waits for
PENALTY = 1.0  # s that a wrong token costs
_READ = 16 * 1024
_T = TypeVar("_T")


class Bounds(NamedTuple):
    """What one client may use. `clients`: at a time, all together; `messages`: waiting;
    `line`, `block` [bytes]; `rate`: simple commands per second in the long run, `burst` of
    them at once; `unread` [s]: for which a client may leave its answers unread."""

    clients: int = 16
    messages: int = 64
    line: int = LINE_LIMIT
    block: int = BLOCK_LIMIT
    rate: float = 500.0
    burst: float = 500.0
    unread: float = 10.0


class Bucket:
    """Delays what comes faster than `rate` for longer than `burst` (a token bucket)."""

    def __init__(self, rate: float, burst: float) -> None:
        self._rate, self._burst = rate, burst
        self._level = burst
        self._time = time.monotonic()

    async def take(self, cost: float) -> None:
        """Return once `cost` is within the rate."""
        now = time.monotonic()
        self._level = min(self._burst, self._level + (now - self._time) * self._rate)
        self._time = now
        self._level -= cost
        if self._level < 0.0:
            await asyncio.sleep(-self._level / self._rate)


class Threads(NamedTuple):
    """Where calls to the station run: `urgent` is kept free for stops."""

    orders: Executor
    urgent: Executor


class Connection:
    """Serves one client until it goes.

    Messages are done one after the other, except for stops: those at a message's beginning
    are done as soon as they are read.
    """

    def __init__(
        self,
        device: Device,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
        threads: Threads,
        bounds: Bounds,
    ) -> None:
        self._reader, self._writer = reader, writer
        self._threads, self._bounds = threads, bounds
        self._bucket = Bucket(bounds.rate, bounds.burst)
        self._intake = Bucket(bounds.rate, bounds.burst)
        self._queue: asyncio.Queue[tuple[Message, tuple[Unit, ...], int] | None] = asyncio.Queue(
            bounds.messages
        )
        self._heard = time.monotonic()
        peer = writer.get_extra_info("peername")
        self.session = Session(device, f"scpi {peer[0]}:{peer[1]}")

    async def run(self) -> None:
        """Serve; returns when the client is gone."""
        keep_alive(self._writer.get_extra_info("socket"))
        await self._in(self._threads.orders, self._station_connect)
        worker = asyncio.create_task(self._work())
        reading = asyncio.create_task(self._read())
        try:
            await asyncio.wait({worker, reading}, return_when=asyncio.FIRST_COMPLETED)
            await self._in(self._threads.urgent, self.session.close)
            if not worker.done():  # queries that came before the end are still answered
                with contextlib.suppress(TimeoutError, OSError):
                    async with asyncio.timeout(2.0):
                        await self._finish(worker)
        finally:
            self.session.gone.set()
            for task in (worker, reading):
                task.cancel()
            await asyncio.gather(worker, reading, return_exceptions=True)
            self._writer.transport.abort()

    def beat(self) -> None:
        """Tell the station that this client lives; lose it where its watchdog has run out."""
        session = self.session
        if session.gone.is_set():
            return
        silent = time.monotonic() - self._heard
        if session.watchdog and silent > session.watchdog:
            station = session.device.station
            if station.snapshot().holder == session.client:
                station.disconnect(session.client)
                station.connect(session.client)
                session.fail(ScpiError(-200, "control lost: silent for longer than the watchdog"))
            return
        session.device.station.heartbeat(session.client)

    def _station_connect(self) -> None:
        self.session.device.station.connect(self.session.client)

    async def _finish(self, worker: asyncio.Task[None]) -> None:
        await self._queue.put(None)
        await worker
        await self._writer.drain()
        self._writer.close()
        await self._writer.wait_closed()

    async def _in(self, executor: Executor, act: Callable[..., _T], *given: object) -> _T:
        return await asyncio.get_running_loop().run_in_executor(executor, act, *given)

    async def _read(self) -> None:
        """Frame what comes; stops are done here, the rest waits for its turn."""
        framer = Framer(self._bounds.line, self._bounds.block)
        while True:
            try:
                data = await self._reader.read(_READ)
            except OSError:  # reset, or the peer no longer answers
                return
            if not data:
                return
            self._heard = time.monotonic()
            await self._intake.take(len(data) / 4096)
            for found in framer.feed(data):
                if isinstance(found, ScpiError):
                    await self._queue.put((Message((), found), (), self.session.stops))
                    continue
                message = parse(TREE, found)
                urgent, rest = message.parted()
                for unit in urgent:
                    await self._in(self._threads.urgent, self._now, unit)
                if rest or message.error is not None:
                    await self._queue.put((message, rest, self.session.stops))
                await self._intake.take(0.25)

    def _now(self, unit: Unit) -> None:
        self.session.attempt(unit, self.session.stops, self.session.failed)

    async def _work(self) -> None:
        """Do messages one after the other."""
        while True:
            item = await self._queue.get()
            if item is None:
                return
            message, units, stops = item
            await self._bucket.take(message.cost)
            if message.error is not None:
                self.session.fail(message.error)
            if not await self._do(units, stops):
                return

    async def _do(self, units: tuple[Unit, ...], stops: int) -> bool:
        """Do the commands of a message; False where the connection must end."""
        session = self.session
        session.answered = False
        failed, failures = session.failed, session.failures
        for unit in units:
            if unit.command.waits and not await self._rest():
                continue
            answer = await self._in(self._threads.orders, session.attempt, unit, stops, failed)
            if session.failures != failures:
                await asyncio.sleep(PENALTY)
                failures = session.failures
            if answer is not None:
                data = answer.encode("ascii", "replace") if isinstance(answer, str) else answer
                self._writer.write(b";" + data if session.answered else data)
                session.answered = True
                if not await self._drained():
                    return False
        if session.answered:
            session.answered = False
            self._writer.write(b"\n")
            if not await self._drained():
                return False
        return session.failures < MOST_FAILURES

    async def _rest(self) -> bool:
        """Wait for this client's motions; False if it has gone meanwhile."""
        while not await self._in(self._threads.orders, self.session.poll):
            if self.session.gone.is_set():
                return False
            self._heard = time.monotonic()  # it waits for us: this is no silence
            await asyncio.sleep(POLL)
        return True

    async def _drained(self) -> bool:
        try:
            async with asyncio.timeout(self._bounds.unread):
                await self._writer.drain()
        except (TimeoutError, OSError):
            return False
        return True


def keep_alive(connection: socket.socket) -> None:
    """Let the system find out within about 11 s that the other end is gone without a word."""
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for option, value in (
        ("TCP_KEEPIDLE", 5),
        ("TCP_KEEPINTVL", 2),
        ("TCP_KEEPCNT", 3),
        ("TCP_USER_TIMEOUT", 11_000),
    ):
        if hasattr(socket, option):
            connection.setsockopt(socket.IPPROTO_TCP, getattr(socket, option), value)
