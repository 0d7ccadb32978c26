from __future__ import annotations

from collections.abc import AsyncIterator, Callable

from macromicro.serve.bucket import Bucket
from macromicro.serve.door._bounds import STOP_COST, Bounds
from macromicro.serve.scpi._framing import Framer
from macromicro.serve.scpi._header import Tree
from macromicro.serve.scpi._message import Message, reading
from macromicro.serve.scpi.errors import ScpiError
from macromicro.serve.scpi.tree import TREE

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
