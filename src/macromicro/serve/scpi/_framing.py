"""Splits the byte stream into messages, whose blocks may hold any byte."""

from __future__ import annotations

import re
from collections.abc import Iterator

from macromicro.serve.door._bounds import BLOCK_LIMIT, LINE_LIMIT
from macromicro.serve.scpi.errors import ScpiError

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
