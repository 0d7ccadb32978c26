"""What is still to be computed: spans of indices, handed out in chunks."""

from __future__ import annotations

from typing import NamedTuple

from macromicro.sweep.journal import Spans, gaps


class Chunk(NamedTuple):
    """Consecutive variants, and how many workers died over them without finishing one."""

    first: int
    size: int
    deaths: int = 0


class Todo:
    """The variants 0 to `count` - 1 without the finished spans, in chunks in order.

    What is given back comes first again.
    """

    def __init__(self, count: int, done: Spans) -> None:
        self._open = gaps(done, 0, count)[::-1]
        self._back: list[Chunk] = []
        self.left = sum(high - low for low, high in self._open)

    def __bool__(self) -> bool:
        return bool(self._open or self._back)

    def take(self, count: int, block: int) -> Chunk:
        """The next at most `count` variants; the end is a whole block's where it can be."""
        if self._back:
            chunk = self._back.pop()
        else:
            low, high = self._open.pop()
            end = min(high, low - low % block + max(count, block))
            if end < high:
                self._open.append((end, high))
            chunk = Chunk(low, end - low)
        self.left -= chunk.size
        return chunk

    def give_back(self, chunk: Chunk) -> None:
        """To be done again."""
        self._back.append(chunk)
        self.left += chunk.size
