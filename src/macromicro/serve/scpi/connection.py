"""One client's connection: what it sends is read, done in order, and answered."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Callable
from concurrent.futures import Executor, Future
from typing import Any, NamedTuple, TypeVar

from macromicro.serve import seats
from macromicro.serve.bucket import Bucket
from macromicro.serve.guesses import TRIES
from macromicro.serve.scpi.device import Device
from macromicro.serve.scpi.errors import ScpiError
from macromicro.serve.scpi.intake import Intake
from macromicro.serve.scpi.message import Message, Unit
from macromicro.serve.scpi.rates import Bounds, Threads
from macromicro.serve.scpi.session import Session
from macromicro.serve.scpi.strangers import FirstLine, Stranger
from macromicro.serve.scpi.wire import Ear, prepare
from macromicro.serve.seats import Places
from macromicro.serve.sending import Stops

POLL = 0.02  # s between two looks at motions that *OPC? waits for
PENALTY = 1.0  # s that a wrong token costs
GRACE = 2.0  # s for which queries of a client that has closed are still answered
_READ = 16 * 1024
_UNIT_BYTES = 256  # memory of a parsed command
_LONG, _PER_BYTE = 4096, 1 / 2000  # answer from which on its bytes cost, and how much
_T = TypeVar("_T")


class _Waiting(NamedTuple):
    """A message that waits: what of it is to be done, the client's and the station's
    stops when it came, and its size in memory [bytes]."""

    message: Message
    units: tuple[Unit, ...]
    stops: int
    since: Stops
    size: int


class Connection:
    """Serves one client until it goes.

    Messages are done one after the other, except for stops: those at a message's beginning
    are done as soon as they are read. Nothing is done before the first line has shown that this
    is a client of SCPI. A `seats.Guest`.
    """

    def __init__(
        self,
        device: Device,
        ear: Ear,
        writer: asyncio.StreamWriter,
        threads: Threads,
        bounds: Bounds,
        places: Places,
    ) -> None:
        self._ear, self._writer = ear, writer
        self._places = places
        self._threads, self._bounds = threads, bounds
        self._bucket = Bucket(bounds.rate, bounds.burst)
        self._intake = Intake(bounds, self._price)
        self._queue: asyncio.Queue[_Waiting | None] = asyncio.Queue(bounds.messages)
        self._bytes = 0  # of what waits
        self._calls: set[Future[Any]] = set()  # those under way in other threads
        self._working = False
        self._waited = time.monotonic()  # until when the client waited for us
        self._patience: float = device.settings.serve.client_timeout
        peer = writer.get_extra_info("peername")
        self.session = Session(device, f"scpi {peer[0]}:{peer[1]}", str(peer[0]))

    # As the places see it

    @property
    def rank(self) -> int:
        """Who makes room for whom."""
        session = self.session
        if session.device.station.holder == session.client:
            return seats.HOLDER
        if session.authenticated and not session.device.token.open:
            return seats.ADMITTED
        return seats.stranger(session.address)

    @property
    def heard(self) -> float:
        """When bytes came last."""
        return self._ear.heard

    def dismiss(self) -> None:
        """Its place is another one's now."""
        self._ear.reset = True
        self._ear.ended.set()

    def _price(self) -> float:
        """What everything costs this client: more in a crowd, where it may not command."""
        if self.rank >= seats.ADMITTED:
            return 1.0
        return max(1.0, self._places.crowd / self._bounds.crowd)

    @property
    def _executor(self) -> Executor:
        threads = self._threads
        return threads.orders if self.rank >= seats.ADMITTED else threads.others

    # From the first line to the end

    async def run(self) -> None:
        """Serve; returns when the client is gone and nothing is being done for it any more."""
        prepare(self._writer.get_extra_info("socket"))
        worker = asyncio.create_task(self._work())
        reading = asyncio.create_task(self._read())
        ended = asyncio.create_task(self._ear.ended.wait())
        tasks = worker, reading, ended
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            await self._in(self._threads.urgent, self.session.close)
            if not worker.done() and not self._ear.reset:
                # What came before the end: stops are done and queries answered.
                with contextlib.suppress(TimeoutError, OSError):
                    async with asyncio.timeout(GRACE):
                        await self._finish(reading, worker)
        finally:
            self.session.gone.set()
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            self._writer.transport.abort()
            while self._calls:
                await asyncio.sleep(POLL)

    def watch(self) -> None:
        """Notice that the client is gone, apart from reading what it has sent; to be called
        in the event loop now and then. Whom this server cannot keep up with any more, so that
        its end could not be seen, is let go too, and who leaves a block unfinished."""
        ear, now = self._ear, time.monotonic()
        ear.look(self._writer.get_extra_info("socket"))
        deaf = ear.deaf_since is not None and now - ear.deaf_since > self._patience
        stuck = self._intake.in_block and now - ear.heard > self._bounds.unread
        if deaf or (stuck and not self._behind):
            ear.reset = True
            ear.ended.set()

    def beat(self) -> None:
        """Tell the station that this client lives; lose it where its watchdog has run out."""
        session = self.session
        if session.gone.is_set() or self._ear.ended.is_set():
            return
        if session.watchdog and self._silence() > session.watchdog:
            station = session.device.station
            if station.holder == session.client:
                station.disconnect(session.client)
                station.connect(session.client)
                if session.gone.is_set():  # it went meanwhile
                    station.disconnect(session.client)
                session.fail(ScpiError(-200, "control lost: silent for longer than the watchdog"))
            return
        session.device.station.heartbeat(session.client)

    @property
    def _behind(self) -> bool:
        """Is there something of this client's still to be done?"""
        return self._working or not self._queue.empty() or self._ear.deaf_since is not None

    def _silence(self) -> float:
        """For how long [s] nothing came, though nothing was waited for; while this server is
        the slow one, for a client_timeout less."""
        silent = time.monotonic() - max(self._ear.heard, self._waited)
        return silent - (self._patience if self._behind else 0.0)

    def _station_connect(self) -> None:
        self.session.device.station.connect(self.session.client)

    async def _finish(self, reading: asyncio.Task[None], worker: asyncio.Task[None]) -> None:
        await reading
        await self._queue.put(None)
        await worker
        await self._writer.drain()
        self._writer.close()
        await self._writer.wait_closed()

    async def _in(self, executor: Executor, act: Callable[..., _T], *given: object) -> _T:
        future = executor.submit(act, *given)
        self._calls.add(future)
        future.add_done_callback(self._calls.discard)
        return await asyncio.wrap_future(future)

    async def _read(self) -> None:
        """Stops are done here; the rest of what comes waits for its turn."""
        try:
            data = await self._first()
            while data:
                async for message, length in self._intake.messages(data):
                    urgent, rest = message.parted()
                    for unit in urgent:
                        await self._in(self._threads.urgent, self._now, unit)
                    if rest or message.error is not None:
                        await self._put(message, rest, length)
                    await self._intake.pay(len(urgent))
                data = b"" if self._intake.broken else await self._ear.take(_READ)
        except Stranger as stranger:
            session = self.session
            session.device.station.trail.client("stranger", session.client, f"sent {stranger}")
        except OSError:  # reset, or the peer no longer answers
            return

    async def _first(self) -> bytes:
        """What came up to the first line and with it, once that has got this client a place;
        nothing where it gets none. Raises `Stranger`."""
        line, found = FirstLine(), b""
        while not found:
            data = await self._ear.take(_READ)
            if not data:
                return b""
            found = line.take(data)
        if not self._places.claim(self):
            return b""
        await self._in(self._threads.urgent, self._station_connect)
        return found

    async def _put(self, message: Message, units: tuple[Unit, ...], length: int) -> None:
        """Let a message wait for its turn."""
        size = length + _UNIT_BYTES * len(units)
        while self._bytes and self._bytes + size > self._bounds.waiting:
            await asyncio.sleep(POLL)
        self._bytes += size
        await self._queue.put(
            _Waiting(message, units, self.session.stops, self.session.device.station.stops, size)
        )

    def _now(self, unit: Unit) -> None:
        self.session.attempt(unit, self.session.stops, self.session.failed)

    async def _work(self) -> None:
        """Do messages one after the other."""
        while True:
            if self._queue.empty() and self._working:
                self._working, self._waited = False, time.monotonic()
            item = await self._queue.get()
            if item is None:
                return
            self._working = True
            await self._bucket.take(item.message.cost * self._price())
            self._bytes -= item.size
            if item.message.error is not None:
                self.session.fail(item.message.error)
            self.session.since = item.since
            if not await self._do(item.units, item.stops):
                return

    async def _do(self, units: tuple[Unit, ...], stops: int) -> bool:
        """Do the commands of a message; False where the connection must end."""
        session = self.session
        session.answered = False
        failed, failures = session.failed, session.failures
        for unit in units:
            if unit.command.waits and not await self._rest():
                continue
            answer = await self._in(self._executor, session.attempt, unit, stops, failed)
            if session.failures != failures:
                await asyncio.sleep(PENALTY)
                failures = session.failures
                if failures >= TRIES:
                    return False
            if answer is not None:
                data = answer.encode("ascii", "replace") if isinstance(answer, str) else answer
                self._writer.write(b";" + data if session.answered else data)
                session.answered = True
                if not await self._drained():
                    return False
                if len(data) > _LONG:
                    await self._bucket.take(len(data) * _PER_BYTE)
        if session.answered:
            session.answered = False
            self._writer.write(b"\n")
            if not await self._drained():
                return False
        return True

    async def _rest(self) -> bool:
        """Wait for this client's motions; False if it has gone meanwhile."""
        while not await self._in(self._executor, self.session.poll):
            if self.session.gone.is_set():
                return False
            self._waited = time.monotonic()  # it waits for us: this is no silence
            await asyncio.sleep(POLL)
        return True

    async def _drained(self) -> bool:
        try:
            async with asyncio.timeout(self._bounds.unread):
                await self._writer.drain()
        except (TimeoutError, OSError):
            return False
        return True
