"""What a file holds: columns by name, which are read when they are asked for."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import NamedTuple

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.files.naming import DATES, TIMES, by_name
from macromicro.schema.text import printable

Fetch = Callable[[Sequence[str]], dict[str, Array]]


class Columns(Mapping[str, Array]):
    """Columns that stay in their file until they are asked for.

    Parameters
    ----------
    names : Collection[str]
        Of all columns, in the file's order.
    fetch : Fetch
        Reads some of them, in one go.
    """

    def __init__(self, names: Collection[str], fetch: Fetch) -> None:
        self._names = dict.fromkeys(names)
        self._fetch = fetch
        self._read: dict[str, Array] = {}

    def __getitem__(self, name: str) -> Array:
        """One column; KeyError where there is none of that name."""
        return self.several([name])[name]

    def __contains__(self, name: object) -> bool:
        """Whether there is a column of that name; reads nothing."""
        return name in self._names

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def several(self, names: Sequence[str]) -> dict[str, Array]:
        """Some columns, read in one go where they have not been read yet.

        Parameters
        ----------
        names : Sequence[str]
            Which.

        Returns
        -------
        dict[str, Array]
            Shape (n,) by name.

        Raises
        ------
        KeyError
            There is no such column.
        """
        for name in names:
            if name not in self._names:
                raise KeyError(name)
        missing = [name for name in dict.fromkeys(names) if name not in self._read]
        if missing:
            self._read |= self._fetch(missing)
        return {name: self._read[name] for name in names}

    def forget(self) -> None:
        """Give the memory of what was read back."""
        self._read.clear()


class Table(NamedTuple):
    """What a file holds.

    Attributes
    ----------
    file : str
        Name, for messages.
    columns : Mapping[str, Array]
        Shape (n,) by name; n may differ.
    units : dict[str, str]
        By name, "" where unknown.
    constants : dict[str, float]
        Scalars of a MAT file, numbers among a recording's attributes.
    reasons : dict[str, str]
        Where a unit is from, in words, by name of the column; none for one without a unit.
    doubtful : dict[str, str]
        Columns that cannot be read, by name, and why.
    words : tuple[str, ...]
        Columns that seem to hold words, or nothing.
    note : str
        What a message about a missing column should add.
    """

    file: str
    columns: Mapping[str, Array]
    units: dict[str, str]
    constants: dict[str, float]
    reasons: dict[str, str] = {}  # noqa: RUF012 - nobody writes into it
    doubtful: dict[str, str] = {}  # noqa: RUF012
    words: tuple[str, ...] = ()
    note: str = ""

    def times(self, used: Collection[str] = ()) -> str:
        """The column that holds times: one with a usual name, or else of dates.

        Parameters
        ----------
        used : Collection[str], optional
            Columns that are something else.

        Returns
        -------
        str
            "" where there is none.
        """
        free = [n for n in self.columns if n not in self.doubtful and n not in used]
        dated = (n for n in free if self.reasons.get(n) == DATES)
        return by_name(free, TIMES) or next(dated, "")

    def several(self, names: Sequence[str]) -> dict[str, Array]:
        """Some columns, read in one go.

        Parameters
        ----------
        names : Sequence[str]
            Which of `columns`.

        Returns
        -------
        dict[str, Array]
            Shape (n,) by name.

        Raises
        ------
        InputError
            One of them is ambiguous, or not made of numbers; names file, line and column.
        """
        for name in names:
            if name in self.doubtful:
                where = f"{self.file}, {printable(name)}"
                raise InputError(where, self.doubtful[name], "a column of numbers of its own name")
        if isinstance(self.columns, Columns):
            return self.columns.several(names)
        return {name: self.columns[name] for name in names}

    def forget(self) -> None:
        """Give the memory of columns back that the file still has."""
        if isinstance(self.columns, Columns):
            self.columns.forget()
