"""What is still to be computed: spans of indices, handed out in chunks."""

from __future__ import annotations

from typing import NamedTuple

from macromicro.sweep.journal import Spans, gaps


class Chunk(NamedTuple):
    """Consecutive variants.

    Attributes
    ----------
    first, size : int
        Which.
    deaths : int
        How many workers died over them without finishing one.
    """

    first: int
    size: int
    deaths: int = 0


class Todo:
    """The variants that are not finished, handed out in chunks in order.

    What is given back comes first again.

    Parameters
    ----------
    count : int
        Variants in all.
    done : ndarray, shape (n, 2)
        Merged spans of those that are finished.
    """

    def __init__(self, count: int, done: Spans) -> None:
        self._open = gaps(done, 0, count)[::-1]
        self._back: list[Chunk] = []
        self.left = sum(high - low for low, high in self._open)

    def __bool__(self) -> bool:
        return bool(self._open or self._back)

    def take(self, count: int, block: int) -> Chunk:
        """Hand out the next variants.

        Parameters
        ----------
        count : int
            At most so many.
        block : int
            Of the job; the chunk ends where a block does, if it can.

        Returns
        -------
        Chunk
            One or more of them.
        """
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
        """Take a chunk back, to be done again.

        Parameters
        ----------
        chunk : Chunk
            Of which nothing is finished.
        """
        self._back.append(chunk)
        self.left += chunk.size
