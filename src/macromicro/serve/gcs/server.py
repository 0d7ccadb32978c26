from __future__ import annotations

import asyncio
import inspect
import re
from typing import TYPE_CHECKING, Any

from macromicro.serve._instrument import Instrument
from macromicro.serve.client import Entry
from macromicro.serve.door import _connection as door
from macromicro.serve.door._connection import STOP_COST, Bounds, Connection, SocketMonitor
from macromicro.serve.door._first_line import Grammar
from macromicro.serve.gcs import _errors
from macromicro.serve.gcs._commands import COMMANDS, Call
from macromicro.serve.gcs._errors import GcsError
from macromicro.serve.gcs._session import Session
from macromicro.serve.hosts import HOST, Token

if TYPE_CHECKING:
    from macromicro.serve.station import Station


SINGLE = {5: "#5", 7: "#7", 24: "#24"}  # commands of one byte, which need no line's end
_BYTES = re.escape(bytes(SINGLE))

GRAMMAR = Grammar(
    name="GCS",
    leading=re.compile(rb"[ \t\r\n]*"),
    begins=re.compile(rb"[*A-Za-z" + _BYTES + rb"]"),
    # A single byte, or a command of three letters with its first argument: an axis, a number
    # or a word. No path and no address of a request is one.
    form=re.compile(
        rb"$|\*?[A-Z]{3}\?? (?: [ \t]*$ | [ \t]+ [-+.]? \w [-+.\w]* (?: [ \t]|$ ) )",
        re.IGNORECASE | re.VERBOSE,
    ),
    end=re.compile(rb"[\r\n" + _BYTES + rb"]"),
)


BOUNDS = Bounds(line=1024)
CODEPAGE = "cp1252"
_STOPS = ("#24", "STP", "HLT")
_PIECE = 1024  # bytes that are read in one go


class GcsConnection(Connection[list[str]]):
    """Executes lines one after the other; stops as soon as they are read."""

    def __init__(
        self, session: Session, monitor: SocketMonitor, writer: asyncio.StreamWriter, bounds: Bounds
    ) -> None:
        self.session = session
        super().__init__(self.session, GRAMMAR, monitor, writer, bounds)
        self._line = b""

    async def _hear(self, data: bytes) -> bool:
        for start in range(0, len(data), _PIECE):
            await self._pay()  # also for bytes that are no line
            for line in self._lines(data[start : start + _PIECE]):
                await self._take(line)
            if len(self._line) > self._bounds.line:
                self.session.fail(_errors.TOO_LONG)
                return False
        return True

    def _lines(self, data: bytes) -> list[str]:
        """Complete commands in `data`, without terminators; single-byte commands have none."""
        lines = []
        for byte in data:
            if len(self._line) > self._bounds.line:
                break
            if byte in SINGLE:
                lines.append(SINGLE[byte])
            elif byte in b"\r\n":
                lines.append(self._line.decode(CODEPAGE, "replace"))
                self._line = b""
            else:
                self._line += bytes((byte,))
        return lines

    async def _take(self, line: str) -> None:
        """Execute stops, queue the rest."""
        words = line.split()
        if not words:
            return
        if words[0].upper() in _STOPS:
            await self.session.halt()
            await self._pay(STOP_COST)
        else:
            await self._pay()
            await self._waiting.put(words, len(line))

    async def _pay(self, cost: float = 1.0) -> None:
        await self._bucket.take(cost * self.session.price)

    async def _do(self, entry: Entry[list[str]]) -> bool:
        answer = await self._act(entry)
        if not await self._admissible():
            return False
        return answer is None or await self._send(f"{answer}\n".encode(CODEPAGE, "replace"))

    async def _act(self, entry: Entry[list[str]]) -> Any:
        name, *words = entry.order
        command = COMMANDS.get(name.upper())
        try:
            if command is None:
                raise GcsError(_errors.UNKNOWN, name[:40])
            call = Call(self.session, words, entry)
            if command.blocks:
                return await self.session.in_thread(command.act, call)
            answer = command.act(call)
            return await answer if inspect.isawaitable(answer) else answer
        except GcsError as error:
            self.session.fail(error.number)
        return None


class GcsServer(door.LineServer):
    """GCS 2.0 at a TCP port, in the background; a context manager."""

    def __init__(
        self,
        station: Station,
        host: str = HOST,
        port: int = 0,
        *,
        token: str | Token | None = None,
        bounds: Bounds = BOUNDS,
    ) -> None:
        instrument = Instrument(station, token=door.token(host, token))
        super().__init__("GCS", host, port, Session, GcsConnection, instrument, bounds)
