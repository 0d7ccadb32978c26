from __future__ import annotations

import asyncio
import math
import time
from typing import NamedTuple

from macromicro.serve._capacity import Capacity
from macromicro.serve._instrument import Instrument
from macromicro.serve.client import Entry
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

STREAMED = 0.1  # of the cost of other commands: set points of a motion that follows them
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
        capacity: Capacity,
        bounds: Bounds,
    ) -> None:
        address, port = writer.get_extra_info("peername")[:2]
        self.session = Session(instrument, f"scpi {address}:{port}", address, capacity)
        super().__init__(self.session, GRAMMAR, monitor, writer, bounds)
        self._intake = Intake(bounds, self._price, tree(instrument.place, instrument.axes))
        self._response = b""  # to the message under way, as far as it is not sent

    def _price(self) -> float:
        streams = self.session.station.streams(self.session.name)
        return self.session.price * (STREAMED if streams else 1.0)

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
                await self._at_once(unit)
            if rest and all(unit.command.streamed for unit in rest) and not self._waiting.busy:
                for unit in rest:
                    await self._at_once(unit)
            elif rest or message.error is not None:
                size = length + _UNIT_BYTES * len(rest)
                await self._waiting.put(_Rest(message, rest), size)
            await self._intake.pay(len(urgent))
        return not self._intake.broken

    async def _at_once(self, unit: Unit) -> None:
        await attempt(self.session, unit, self.session.stops, self.session.failed)

    async def _do(self, entry: Entry[_Rest]) -> bool:
        """Execute the commands of a message; False if the connection must end."""
        session, (message, units) = self.session, entry.order
        session.entry = entry
        await self._bucket.take(message.cost * session.price)
        if message.error is not None:
            session.fail(message.error)
        session.answered = False
        failed = session.failed
        for unit in units:
            if unit.command.waits:
                if not await self._flush():
                    return False
                if not await self._rest():
                    continue
            answer = await attempt(session, unit, entry.stops, failed)
            if not await self._admissible():
                return False
            if answer is not None and not await self._answer(answer):
                return False
        if session.answered:
            session.answered = False
            return await self._flush(b"\n")
        return True

    async def _answer(self, answer: str | bytes) -> bool:
        """Add to the response; False if the client does not read it."""
        data = answer.encode("ascii", "replace") if isinstance(answer, str) else answer
        self._response += b";" + data if self.session.answered else data
        self.session.answered = True
        if len(data) <= _LONG:
            return True
        sent = await self._flush()
        await self._bucket.take(len(data) * _PER_BYTE)
        return sent

    async def _flush(self, end: bytes = b"") -> bool:
        response, self._response = self._response + end, b""
        return not response or await self._send(response)

    async def _rest(self) -> bool:
        """Wait for this client's motions; False if it leaves meanwhile."""
        while not self.session.poll():
            if self.session.gone:
                return False
            self._waiting.rested = math.inf  # it waits for us: this is no silence
            await self.session.station.news()
        self._waiting.rested = time.monotonic()
        return True
