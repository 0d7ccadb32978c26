"""One client's bytes to its messages: in slices that hold nobody else up, at its own cost."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable

from macromicro.serve.bucket import Bucket
from macromicro.serve.door.bounds import STOP_COST, Bounds
from macromicro.serve.scpi.errors import ScpiError
from macromicro.serve.scpi.framing import Framer
from macromicro.serve.scpi.header import Tree
from macromicro.serve.scpi.message import Message, reading
from macromicro.serve.scpi.tree import TREE

PIECE = 1024  # bytes that are framed in one go
_PER_PIECE = 0.25  # cost of framing that many, in simple commands
_STEP_COST = 0.02  # of a framer's step
_UNIT_COST = 0.25  # of reading one


class Intake:
    """Frames and reads what comes, no faster than `bounds` allow times `price`.

    Every slice of work, however malformed what it meets, takes less than a millisecond; it is
    paid for before the next one begins, and everybody else of the event loop has a turn.
    """

    def __init__(self, bounds: Bounds, price: Callable[[], float], tree: Tree = TREE) -> None:
        self._framer = Framer(bounds.line, bounds.block)
        self._bucket = Bucket(bounds.rate, bounds.burst)
        self._price, self._tree = price, tree

    @property
    def broken(self) -> bool:
        """Can nothing more be read from these bytes?"""
        return self._framer.broken

    @property
    def in_block(self) -> bool:
        """Must more of a block come before anything else is heard?"""
        return self._framer.in_block

    async def pay(self, stops: int) -> None:
        """For stops that were done at once."""
        await self._take(STOP_COST * stops)

    async def messages(self, data: bytes) -> AsyncIterator[tuple[Message, int]]:
        """The messages that `data` completes, each with its length [bytes]."""
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
