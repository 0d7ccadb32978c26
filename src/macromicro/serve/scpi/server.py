from __future__ import annotations

import asyncio
import inspect
import math
import re
import time
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from macromicro.errors import InputError, MacromicroError
from macromicro.serve._instrument import Instrument
from macromicro.serve.client import Entry
from macromicro.serve.door import _connection as door
from macromicro.serve.door._connection import Bounds, Connection, SocketMonitor
from macromicro.serve.door._first_line import Grammar
from macromicro.serve.hosts import HOST, Token
from macromicro.serve.hosts import SCPI_PORT as PORT
from macromicro.serve.requests import CONTROL, EVERYONE, STOPS
from macromicro.serve.scpi._intake import Intake
from macromicro.serve.scpi._message import Message, Unit
from macromicro.serve.scpi._session import Session
from macromicro.serve.scpi.command import Answer, Call
from macromicro.serve.scpi.errors import ScpiError
from macromicro.serve.scpi.tree import tree

if TYPE_CHECKING:
    from macromicro.serve.station import Station


async def attempt(session: Session, unit: Unit, stops: int, failed: int) -> Answer:
    """Execute one command: its response, or None; an error goes to the session's queue."""
    command = unit.command
    try:
        if command.access == CONTROL:
            if session.stops != stops:
                raise ScpiError(-200, f"{command.header} not done: it came before a stop")
            if session.failed != failed:
                raise ScpiError(-200, f"{command.header} not done: error before it")
        if command.access not in (EVERYONE, STOPS) and session.gone:
            raise ScpiError(-200, f"{command.header} not done: the client is gone")
        return await _run(session, unit)
    except ScpiError as error:
        session.fail(error)
        return None


async def _run(session: Session, unit: Unit) -> Answer:
    command = unit.command
    try:
        if command.access != STOPS:  # a stop waits for nothing
            session.poll()
        if command.access not in (EVERYONE, STOPS) and not session.authenticated:
            raise ScpiError(-203, "SYSTem:AUTHenticate first")
        call = Call(session, unit.values, unit.suffixes)
        if command.blocks:
            answer = await session.in_thread(command.act, call)
        else:
            answer = command.act(call)
        return await answer if inspect.isawaitable(answer) else answer
    except ScpiError:
        raise
    except InputError as error:
        raise ScpiError(-224, str(error)) from error
    except MacromicroError as error:
        raise ScpiError(-200, str(error)) from error
    except Exception as error:
        raise ScpiError(-310, f"{type(error).__name__}: {error}") from error


GRAMMAR = Grammar(
    name="SCPI",
    leading=re.compile(rb"[ \t\r\n;]*"),
    begins=re.compile(rb"[*:A-Za-z]"),
    # The form of a line's first command: a header, and behind white space the beginning of a
    # number, a string, a block, or a word that ends as words do.
    form=re.compile(
        rb"""(?:\*[A-Z]+|:?[A-Z]\w*(?::[A-Z]\w*)*)\??
        (?: [ \t\r]*(?:;|$) | [ \t\r]+ (?: [-+.0-9"'#(] | [A-Z]\w*[ \t\r]*(?:[,;]|$) ) )""",
        re.IGNORECASE | re.VERBOSE,
    ),
    end=re.compile(rb"\n"),
)


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
        self, session: Session, monitor: SocketMonitor, writer: asyncio.StreamWriter, bounds: Bounds
    ) -> None:
        self.session = session
        super().__init__(self.session, GRAMMAR, monitor, writer, bounds)
        instrument = session.instrument
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


class Server(door.LineServer):
    """The SCPI server, in the background; a context manager."""

    def __init__(
        self,
        station: Station,
        host: str = HOST,
        port: int = PORT,
        *,
        token: str | Token | None = None,
        folder: Path = Path(),
        bounds: Bounds | None = None,
    ) -> None:
        instrument = Instrument(station, folder, door.token(host, token))
        super().__init__(
            "SCPI", host, port, Session, ScpiConnection, instrument, bounds or Bounds()
        )
