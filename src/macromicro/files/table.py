"""Columns of a file by name, read when they are needed."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import NamedTuple

from macromicro.arrays import Array
from macromicro.errors import ProblemError
from macromicro.files.naming import DATES, TIMES, by_name
from macromicro.schema.text import printable

Fetch = Callable[[Sequence[str]], dict[str, Array]]


class Columns(Mapping[str, Array]):
    """Columns that stay in their file until they are needed."""

    def __init__(self, names: Collection[str], fetch: Fetch) -> None:
        self._names = dict.fromkeys(names)
        self._fetch = fetch
        self._read: dict[str, Array] = {}

    def __getitem__(self, name: str) -> Array:
        return self.several([name])[name]

    def __contains__(self, name: object) -> bool:
        return name in self._names

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def several(self, names: Sequence[str]) -> dict[str, Array]:
        """Some columns; unread ones are read in one pass."""
        for name in names:
            if name not in self._names:
                raise KeyError(name)
        missing = [name for name in dict.fromkeys(names) if name not in self._read]
        if missing:
            self._read |= self._fetch(missing)
        return {name: self._read[name] for name in names}

    def forget(self) -> None:
        """Free the memory of what was read."""
        self._read.clear()


class Table(NamedTuple):
    file: str  # name, for messages
    columns: Mapping[str, Array]  # shape (n,) by name; n may differ
    units: dict[str, str]  # by name, "" where unknown
    constants: dict[str, float]  # scalars of a MAT file, numbers among a recording's attributes
    # where a unit is from, in words, by name of the column; none for one without a unit
    reasons: dict[str, str] = {}  # noqa: RUF012 - nobody writes into it
    # columns that cannot be read, by name, and why
    doubtful: dict[str, str] = {}  # noqa: RUF012
    words: tuple[str, ...] = ()  # columns that seem to hold words, or nothing
    note: str = ""  # hint for messages about a missing column
    rate: float = math.nan  # rows per second by the header, Hz

    def times(self, used: Collection[str] = ()) -> str:
        """The column of times: a usual name, or dates."""
        free = [n for n in self.columns if n not in self.doubtful and n not in used]
        dated = (n for n in free if self.reasons.get(n) == DATES)
        return by_name(free, TIMES) or next(dated, "")

    def several(self, names: Sequence[str]) -> dict[str, Array]:
        for name in names:
            if name in self.doubtful:
                where = f"{self.file}, {printable(name)}"
                remedy = "Give each column of numbers its own name."
                raise ProblemError(where, self.doubtful[name], remedy)
        if isinstance(self.columns, Columns):
            return self.columns.several(names)
        return {name: self.columns[name] for name in names}

    def forget(self) -> None:
        """Free the memory of columns that are still in the file."""
        if isinstance(self.columns, Columns):
            self.columns.forget()
