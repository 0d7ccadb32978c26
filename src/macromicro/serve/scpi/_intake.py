from __future__ import annotations

import re
from collections.abc import AsyncIterator, Callable, Iterator

from macromicro.serve.bucket import Bucket
from macromicro.serve.door._connection import BLOCK_LIMIT, LINE_LIMIT, STOP_COST, Bounds
from macromicro.serve.scpi._message import Message, Tree, reading
from macromicro.serve.scpi.errors import ScpiError
from macromicro.serve.scpi.tree import TREE

_MARK = re.compile(rb"[\n\"'#]")
_QUOTES = {ord('"'): re.compile(rb'[\n"]'), ord("'"): re.compile(rb"[\n']")}


class Framer:
    """Splits a stream at newlines outside of blocks, holding one message of bounded size.

    After a block head that announces too much it is `broken`: skipping the block would make it
    deaf to stops.
    """

    def __init__(self, line_limit: int = LINE_LIMIT, block_limit: int = BLOCK_LIMIT) -> None:
        self.line_limit, self.block_limit = line_limit, block_limit
        self.broken = False
        self.steps = 0  # quotes, number signs and newlines so far: what takes time
        self._buffer = bytearray()
        self._fresh()

    def _fresh(self) -> None:
        self._scanned = 0
        self._quote = 0
        self._skip = 0  # bytes of a block still to come
        self._blocks = 0  # bytes of blocks in this message
        self._error: ScpiError | None = None

    @property
    def held(self) -> int:
        """Bytes in memory."""
        return len(self._buffer)

    @property
    def in_block(self) -> bool:
        return self._skip > 0

    def feed(self, data: bytes) -> Iterator[bytes | ScpiError]:
        """The messages that `data` completes, or their errors."""
        for start in range(0, len(data), 4096):  # so that no more than limits and this is held
            if self.broken:
                return
            self._buffer += data[start : start + 4096]
            while True:
                end = self._scan()
                if self._blocks > self.block_limit:
                    self.broken = True
                    self._buffer.clear()
                    yield ScpiError(-223, f"blocks of at most {self.block_limit} bytes")
                    return
                if end < 0:
                    break
                message, error = bytes(self._buffer[:end]), self._error
                del self._buffer[: end + 1]
                self._fresh()
                yield message if error is None else error
            self._bound()

    def _scan(self) -> int:
        """Where the message in the buffer ends, or -1."""
        buffer = self._buffer
        while self._scanned < len(buffer):
            if self._skip:
                step = min(self._skip, len(buffer) - self._scanned)
                self._skip -= step
                self._scanned += step
                continue
            pattern = _QUOTES[self._quote] if self._quote else _MARK
            found = pattern.search(buffer, self._scanned)
            if found is None:
                self._scanned = len(buffer)
                break
            self.steps += 1
            place, mark = found.start(), buffer[found.start()]
            if mark == 0x0A:
                return place
            if mark == 0x23:
                if not self._block(place):
                    break
                continue
            self._quote = 0 if self._quote else mark
            self._scanned = place + 1
        return -1

    def _block(self, place: int) -> bool:
        """Skip a block's head at `place`; False until it is complete."""
        head = self._buffer[place : place + 11]
        if len(head) < 2:
            return False
        digits = head[1] - 0x30
        if not 1 <= digits <= 9:
            self._scanned = place + 1
            return True
        number = head[2 : 2 + digits]
        if number and not number.isdigit():
            self._scanned = place + 1
            return True
        if len(number) < digits:
            return False
        self._skip = int(number)
        self._blocks += self._skip
        self._scanned = place + 2 + digits
        return self._blocks <= self.block_limit

    def _bound(self) -> None:
        """Drop a message that is too long, up to its end."""
        arrived = self._blocks - self._skip
        if len(self._buffer) - arrived > self.line_limit and self._error is None:
            self._error = ScpiError(-363, f"lines of at most {self.line_limit} bytes")
        if self._error is not None:
            del self._buffer[: self._scanned]
            self._blocks -= arrived
            self._scanned = 0


PIECE = 1024  # bytes that are framed in one go
_PER_PIECE = 0.25  # cost of framing that many, in simple commands
_STEP_COST = 0.02  # of a framer's step
_UNIT_COST = 0.25  # of reading one


class Intake:
    """Frames and parses input at a limited rate, in slices of less than a millisecond."""

    def __init__(self, bounds: Bounds, price: Callable[[], float], tree: Tree = TREE) -> None:
        self._framer = Framer(bounds.line, bounds.block)
        self._bucket = Bucket(bounds.rate, bounds.burst)
        self._price, self._tree = price, tree

    @property
    def broken(self) -> bool:
        """Whether nothing more can be read."""
        return self._framer.broken

    @property
    def in_block(self) -> bool:
        return self._framer.in_block

    async def pay(self, stops: int) -> None:
        """Charge stops that were executed at once."""
        await self._take(STOP_COST * stops)

    async def messages(self, data: bytes) -> AsyncIterator[tuple[Message, int]]:
        """The messages that `data` completes, each with its length in bytes."""
        for start in range(0, len(data), PIECE):
            steps = self._framer.steps
            await self._take(_PER_PIECE)
            for found in self._framer.feed(data[start : start + PIECE]):
                if isinstance(found, ScpiError):
                    yield Message((), found), 0
                else:
                    yield await self._read(found), len(found)
            await self._take(_STEP_COST * (self._framer.steps - steps))

    async def _read(self, line: bytes) -> Message:
        slices, paid = reading(self._tree, line), 0
        while True:
            try:
                units = next(slices)
            except StopIteration as end:
                message: Message = end.value
                await self._take(_UNIT_COST * max(1, message.size - paid))
                return message
            paid += units
            await self._take(_UNIT_COST * units)

    async def _take(self, cost: float) -> None:
        await self._bucket.take(cost * self._price())
