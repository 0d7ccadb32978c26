"""One client's connection: what it sends is read, done in order, and answered."""

from __future__ import annotations

import asyncio
import contextlib
import time
from typing import NamedTuple

from macromicro.serve.bucket import Bucket
from macromicro.serve.client import POLL_S, Dispatcher, Entry, Waiting
from macromicro.serve.guesses import TRIES
from macromicro.serve.instrument import Instrument
from macromicro.serve.scpi.bounds import Bounds
from macromicro.serve.scpi.errors import ScpiError
from macromicro.serve.scpi.execution import attempt
from macromicro.serve.scpi.first_line import FirstLine, ForeignProtocol
from macromicro.serve.scpi.intake import Intake
from macromicro.serve.scpi.message import Message, Unit
from macromicro.serve.scpi.session import Session
from macromicro.serve.scpi.socket_monitor import SocketMonitor, prepare
from macromicro.serve.scpi.tree import tree

PENALTY = 1.0  # s that a wrong token costs
GRACE = 2.0  # s for which queries of a client that has closed are still answered
_READ = 16 * 1024
_UNIT_BYTES = 256  # memory of a parsed command
_LONG, _PER_BYTE = 4096, 1 / 2000  # answer from which on its bytes cost, and how much


class _Rest(NamedTuple):
    """What of a message is to be done in its turn."""

    message: Message
    units: tuple[Unit, ...]


class ScpiConnection:
    """Serves one client until it goes.

    Messages are done one after the other, except for stops: those at a message's beginning
    are done as soon as they are read. Nothing is done before the first line has shown that this
    is a client of SCPI. A `capacity.Member`.
    """

    def __init__(
        self,
        instrument: Instrument,
        monitor: SocketMonitor,
        writer: asyncio.StreamWriter,
        dispatcher: Dispatcher,
        bounds: Bounds,
    ) -> None:
        self._monitor, self._writer = monitor, writer
        self._dispatcher, self._bounds = dispatcher, bounds
        peer = writer.get_extra_info("peername")
        self.session = Session(instrument, f"scpi {peer[0]}:{peer[1]}", str(peer[0]))
        self._bucket = Bucket(bounds.rate, bounds.burst)
        self._intake = Intake(
            bounds, lambda: dispatcher.price(self.session), tree(instrument.place)
        )
        self._waiting: Waiting[_Rest] = Waiting(self.session, bounds.messages, bounds.waiting)
        self._patience: float = instrument.settings.serve.client_timeout

    # As the places see it

    @property
    def rank(self) -> int:
        """Who makes room for whom."""
        return self.session.rank

    @property
    def heard(self) -> float:
        """When bytes came last."""
        return self._monitor.heard

    def dismiss(self) -> None:
        """Its place is another one's now."""
        self._monitor.reset = True
        self._monitor.ended.set()

    # From the first line to the end

    async def run(self) -> None:
        """Serve; returns when the client is gone and nothing is being done for it any more."""
        prepare(self._writer.get_extra_info("socket"))
        worker = asyncio.create_task(self._waiting.work(self._do))
        reading = asyncio.create_task(self._read())
        ended = asyncio.create_task(self._monitor.ended.wait())
        tasks = worker, reading, ended
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            await self._dispatcher.overtake(self.session, self.session.close)
            if not worker.done() and not self._monitor.reset:
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
            while self.session.calls:
                await asyncio.sleep(POLL_S)

    def watch(self) -> None:
        """Notice that the client is gone, apart from reading what it has sent; to be called
        in the event loop now and then. Whom this server cannot keep up with any more, so that
        its end could not be seen, is let go too, and who leaves a block unfinished."""
        monitor, now = self._monitor, time.monotonic()
        monitor.look(self._writer.get_extra_info("socket"))
        stalled = monitor.stalled_since is not None and now - monitor.stalled_since > self._patience
        stuck = self._intake.in_block and now - monitor.heard > self._bounds.unread
        if stalled or (stuck and not self._behind):
            self.dismiss()

    def beat(self) -> None:
        """Tell the station that this client lives; lose it where its watchdog has run out."""
        if not self._monitor.ended.is_set() and not self.session.beat(self._silence()):
            error = ScpiError(-200, "control lost: silent for longer than the watchdog")
            self.session.fail(error)

    @property
    def _behind(self) -> bool:
        """Is there something of this client's still to be done?"""
        return self._waiting.busy or self._monitor.stalled_since is not None

    def _silence(self) -> float:
        """For how long [s] nothing came, though nothing was waited for; while this server is
        the slow one, for a client_timeout less."""
        silent = time.monotonic() - max(self._monitor.heard, self._waiting.rested)
        return silent - (self._patience if self._behind else 0.0)

    async def _finish(self, reading: asyncio.Task[None], worker: asyncio.Task[None]) -> None:
        await reading
        await self._waiting.end()
        await worker
        await self._writer.drain()
        self._writer.close()
        await self._writer.wait_closed()

    async def _read(self) -> None:
        """Stops are done here; the rest of what comes waits for its turn."""
        try:
            data = await self._first()
            while data:
                async for message, length in self._intake.messages(data):
                    urgent, rest = message.parted()
                    for unit in urgent:
                        await self._dispatcher.overtake(self.session, self._now, unit)
                    if rest or message.error is not None:
                        size = length + _UNIT_BYTES * len(rest)
                        await self._waiting.put(_Rest(message, rest), size)
                    await self._intake.pay(len(urgent))
                data = b"" if self._intake.broken else await self._monitor.take(_READ)
        except ForeignProtocol as found:
            session = self.session
            session.station.trail.client("foreign", session.name, f"sent {found}")
        except OSError:  # reset, or the peer no longer answers
            return

    async def _first(self) -> bytes:
        """What came up to the first line and with it, once that has got this client a place;
        nothing where it gets none. Raises `ForeignProtocol`."""
        line, found = FirstLine(), b""
        while not found:
            data = await self._monitor.take(_READ)
            if not data:
                return b""
            found = line.take(data)
        if not self._dispatcher.capacity.claim(self):
            return b""
        await self._dispatcher.overtake(self.session, self.session.connect)
        return found

    def _now(self, unit: Unit) -> None:
        attempt(self.session, unit, self.session.stops, self.session.failed)

    async def _do(self, entry: Entry[_Rest]) -> bool:
        """Do the commands of a message; False where the connection must end."""
        session, (message, units) = self.session, entry.order
        session.entry = entry
        await self._bucket.take(message.cost * self._dispatcher.price(session))
        if message.error is not None:
            session.fail(message.error)
        session.answered = False
        failed, failures = session.failed, session.failures
        for unit in units:
            if unit.command.waits and not await self._rest():
                continue
            answer = await self._dispatcher.run(
                session, attempt, session, unit, entry.stops, failed
            )
            if session.failures != failures:
                await asyncio.sleep(PENALTY)
                failures = session.failures
                if failures >= TRIES:
                    return False
            if answer is not None and not await self._answer(answer):
                return False
        if session.answered:
            session.answered = False
            self._writer.write(b"\n")
            return await self._drained()
        return True

    async def _answer(self, answer: str | bytes) -> bool:
        """Send a query's response data; False where the client does not take it."""
        session = self.session
        data = answer.encode("ascii", "replace") if isinstance(answer, str) else answer
        self._writer.write(b";" + data if session.answered else data)
        session.answered = True
        if not await self._drained():
            return False
        if len(data) > _LONG:
            await self._bucket.take(len(data) * _PER_BYTE)
        return True

    async def _rest(self) -> bool:
        """Wait for this client's motions; False if it has gone meanwhile."""
        while not await self._dispatcher.run(self.session, self.session.poll):
            if self.session.gone.is_set():
                return False
            self._waiting.rested = time.monotonic()  # it waits for us: this is no silence
            await asyncio.sleep(POLL_S)
        return True

    async def _drained(self) -> bool:
        try:
            async with asyncio.timeout(self._bounds.unread):
                await self._writer.drain()
        except (TimeoutError, OSError):
            return False
        return True
