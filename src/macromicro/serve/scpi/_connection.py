from __future__ import annotations

import asyncio
import time
from typing import NamedTuple

from macromicro.serve._instrument import Instrument
from macromicro.serve.client import POLL_S, Dispatcher, Entry
from macromicro.serve.door._bounds import Bounds
from macromicro.serve.door._connection import Connection
from macromicro.serve.door._monitor import SocketMonitor
from macromicro.serve.scpi._execution import attempt
from macromicro.serve.scpi._grammar import GRAMMAR
from macromicro.serve.scpi._intake import Intake
from macromicro.serve.scpi._message import Message, Unit
from macromicro.serve.scpi._session import Session
from macromicro.serve.scpi.errors import ScpiError
from macromicro.serve.scpi.tree import tree

_UNIT_BYTES = 256  # memory of a parsed command
_LONG, _PER_BYTE = 4096, 1 / 2000  # answer from which on its bytes cost, and how much


class _Rest(NamedTuple):
    """Commands of a message that wait for their turn."""

    message: Message
    units: tuple[Unit, ...]


class ScpiConnection(Connection[_Rest]):
    """Executes messages in order; stops at a message's beginning as soon as they are read."""

    def __init__(
        self,
        instrument: Instrument,
        monitor: SocketMonitor,
        writer: asyncio.StreamWriter,
        dispatcher: Dispatcher,
        bounds: Bounds,
    ) -> None:
        peer = writer.get_extra_info("peername")
        self.session = Session(instrument, f"scpi {peer[0]}:{peer[1]}", str(peer[0]))
        super().__init__(self.session, GRAMMAR, monitor, writer, dispatcher, bounds)
        self._intake = Intake(
            bounds, lambda: dispatcher.price(self.session), tree(instrument.place, instrument.axes)
        )

    @property
    def _unfinished(self) -> bool:
        return self._intake.in_block

    def _silenced(self) -> None:
        self.session.fail(ScpiError(-200, "control lost: silent for longer than the watchdog"))

    async def _hear(self, data: bytes) -> bool:
        """Execute stops, queue the rest."""
        async for message, length in self._intake.messages(data):
            urgent, rest = message.parted()
            for unit in urgent:
                await self._dispatcher.overtake(self.session, self._now, unit)
            if rest or message.error is not None:
                size = length + _UNIT_BYTES * len(rest)
                await self._waiting.put(_Rest(message, rest), size)
            await self._intake.pay(len(urgent))
        return not self._intake.broken

    def _now(self, unit: Unit) -> None:
        attempt(self.session, unit, self.session.stops, self.session.failed)

    async def _do(self, entry: Entry[_Rest]) -> bool:
        """Execute the commands of a message; False if the connection must end."""
        session, (message, units) = self.session, entry.order
        session.entry = entry
        await self._bucket.take(message.cost * self._dispatcher.price(session))
        if message.error is not None:
            session.fail(message.error)
        session.answered = False
        failed = session.failed
        for unit in units:
            if unit.command.waits and not await self._rest():
                continue
            answer = await self._dispatcher.run(
                session, attempt, session, unit, entry.stops, failed
            )
            if not await self._admissible():
                return False
            if answer is not None and not await self._answer(answer):
                return False
        if session.answered:
            session.answered = False
            return await self._send(b"\n")
        return True

    async def _answer(self, answer: str | bytes) -> bool:
        """Send a query's response; False if the client does not read it."""
        session = self.session
        data = answer.encode("ascii", "replace") if isinstance(answer, str) else answer
        part = b";" + data if session.answered else data
        session.answered = True
        if not await self._send(part):
            return False
        if len(data) > _LONG:
            await self._bucket.take(len(data) * _PER_BYTE)
        return True

    async def _rest(self) -> bool:
        """Wait for this client's motions; False if it leaves meanwhile."""
        while not await self._dispatcher.run(self.session, self.session.poll):
            if self.session.gone.is_set():
                return False
            self._waiting.rested = time.monotonic()  # it waits for us: this is no silence
            await asyncio.sleep(POLL_S)
        return True
