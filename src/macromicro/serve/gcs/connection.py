"""One client's lines."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator
from typing import Any

from macromicro.serve.bucket import Bucket
from macromicro.serve.client import Dispatcher, Entry, Waiting
from macromicro.serve.gcs import errors
from macromicro.serve.gcs.commands import COMMANDS, Call
from macromicro.serve.gcs.errors import GcsError
from macromicro.serve.gcs.session import Session
from macromicro.serve.guesses import TRIES
from macromicro.serve.instrument import Instrument

WAITING, LONGEST = 64, 1024
RATE, BURST = 500.0, 500.0  # commands a second, and at once
_SINGLE = {5: "#5", 7: "#7", 24: "#24"}
_STOPS = ("#24", "STP", "HLT")
CODEPAGE = "cp1252"


class GcsConnection:
    """A connection, as the dispatcher needs it."""

    def __init__(
        self,
        instrument: Instrument,
        dispatcher: Dispatcher,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
    ) -> None:
        address, port = writer.get_extra_info("peername")[:2]
        self.session = Session(instrument, f"gcs {address}:{port}", address)
        self._dispatcher, self._reader, self._writer = dispatcher, reader, writer
        self._waiting: Waiting[list[str]] = Waiting(self.session, WAITING)
        self._bucket = Bucket(RATE, BURST)
        self.heard = time.monotonic()

    @property
    def rank(self) -> int:
        """Who makes room for whom."""
        return self.session.rank

    def dismiss(self) -> None:
        """Its place is another one's now."""
        self._writer.transport.abort()

    def beat(self) -> None:
        """Its client lives as long as it is connected."""
        self.session.beat(0.0)

    async def run(self) -> None:
        """Serve until the client goes or is sent away."""
        tasks = [asyncio.create_task(self._read())]
        tasks.append(asyncio.create_task(self._waiting.work(self._do)))
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            await self._dispatcher.overtake(self.session, self.session.close)
            for task in tasks:
                task.cancel()
            self._writer.transport.abort()

    async def _read(self) -> None:
        with contextlib.suppress(OSError):
            async for line in self._lines():
                await self._hear(line)

    async def _lines(self) -> AsyncIterator[str]:
        """Commands, without their ends; those of a single character have none."""
        rest = b""
        admitted = False
        while data := await self._reader.read(4096):
            if not admitted:
                if not self._dispatcher.capacity.claim(self):
                    return
                await self._dispatcher.overtake(self.session, self.session.connect)
                admitted = True
            for byte in data:
                if byte in _SINGLE:
                    yield _SINGLE[byte]
                elif byte in b"\r\n":
                    if rest.strip():
                        yield rest.decode(CODEPAGE, "replace")
                    rest = b""
                elif len(rest) >= LONGEST:
                    self.session.fail(errors.TOO_LONG)
                    return
                else:
                    rest += bytes((byte,))

    async def _hear(self, line: str) -> None:
        """Stops are done here; the rest waits for its turn."""
        self.heard = time.monotonic()
        await self._bucket.take(self._dispatcher.price(self.session))
        words = line.split()
        if words[0].upper() in _STOPS:
            await self._dispatcher.overtake(self.session, self.session.halt)
        else:
            await self._waiting.put(words)

    async def _do(self, entry: Entry[list[str]]) -> bool:
        answer = await self._dispatcher.run(self.session, self._act, entry)
        if answer is not None:
            self._writer.write(f"{answer}\n".encode(CODEPAGE, "replace"))
            await self._writer.drain()
        return self.session.failures < TRIES

    def _act(self, entry: Entry[list[str]]) -> Any:
        """In a thread, as the station may take its time."""
        name, *words = entry.order
        command = COMMANDS.get(name.upper())
        try:
            if command is None:
                raise GcsError(errors.UNKNOWN, name[:40])
            return command.act(Call(self.session, words, entry))
        except GcsError as error:
            self.session.fail(error.number)
        return None
