"""The open variants: spans of indices, handed out in chunks."""

from __future__ import annotations

from typing import NamedTuple

from macromicro.sweeps._journal import Spans, gaps


class Chunk(NamedTuple):
    first: int
    size: int
    deaths: int = 0  # how many workers died over them without finishing one


class Todo:
    """The open variants, handed out in order; returned chunks come first again."""

    def __init__(self, count: int, done: Spans) -> None:
        self._open = gaps(done, 0, count)[::-1]
        self._back: list[Chunk] = []
        self.left = sum(high - low for low, high in self._open)

    def __bool__(self) -> bool:
        return bool(self._open or self._back)

    def take(self, count: int, block: int) -> Chunk:
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
        self._back.append(chunk)
        self.left += chunk.size
