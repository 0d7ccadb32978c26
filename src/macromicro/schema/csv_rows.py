"""CSV as this package asks for it: commas, points, `#` for comments; what is wrong, by its line."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable, Iterator
from typing import NamedTuple

from macromicro.errors import InputError
from macromicro.schema.text import printable

_COMMAS = "commas between the columns and points in the numbers"
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?")


class Row(NamedTuple):
    """A line below the header.

    Attributes
    ----------
    line : int
        Its number, from 1.
    where : str
        File and line, for messages.
    cells : dict[str, str]
        By the column's name, without spaces around them.
    """

    line: int
    where: str
    cells: dict[str, str]


def table(
    text: str, file: str, header: Callable[[list[str], str], object], accepted: str
) -> Iterator[Row]:
    """The rows of a table; its first line that is more than a comment names the columns.

    Parameters
    ----------
    text : str
        Content of the file.
    file : str
        Its name, for messages.
    header : Callable[[list[str], str], object]
        Called with the columns' names and where they stand; raises for those it does not accept.
    accepted : str
        What the header may be, for the message if there is none.

    Yields
    ------
    Row
        One after the other.

    Raises
    ------
    InputError
        No header, cells that no commas part, too few or too many, or bad quotes; names the line.
    """
    names: list[str] = []
    for number_of, line in enumerate(re.split(r"\r\n|\r|\n", text), 1):
        content = line.partition("#")[0].strip()
        if not content:
            continue
        where = f"{file}, line {number_of}"
        cells = _cells(content, where)
        if not names:
            header(cells, where)
            names = cells
        elif len(cells) == len(names):
            yield Row(number_of, where, dict(zip(names, cells, strict=True)))
        else:
            wanted = f"{len(names)} cells: {', '.join(names)}"
            raise InputError(where, f"{len(cells)} cells", wanted)
    if not names:
        raise InputError(file, "no header", accepted)


def _cells(content: str, where: str) -> list[str]:
    if ";" in content or "\t" in content:
        found = "columns separated by ';'" if ";" in content else "columns separated by tabs"
        raise InputError(where, found, _COMMAS)
    if '"' not in content:
        return [cell.strip() for cell in content.split(",")]
    try:
        return [
            cell.strip() for cell in next(csv.reader([content], strict=True, skipinitialspace=True))
        ]
    except csv.Error as error:
        raise InputError(where, f"bad quotes ({error})", _COMMAS) from None


def number(text: str, where: str) -> float:
    """The number in a cell.

    Parameters
    ----------
    text : str
        The cell.
    where : str
        File, line and column, for the message.

    Returns
    -------
    float
        Finite.

    Raises
    ------
    InputError
        There is none.
    """
    found = float(text) if _NUMBER.fullmatch(text) else math.nan
    if not math.isfinite(found):
        raise InputError(where, printable(text, 40) or "an empty cell", "a finite number")
    return found


def increasing(t: float, before: float, where: str) -> None:
    """Refuse a time that is not later than the one before it.

    Parameters
    ----------
    t : float
        s.
    before : float
        s.
    where : str
        File and line, for the message.

    Raises
    ------
    InputError
        It is not later.
    """
    if t <= before:
        raise InputError(where, f"{t:g} s", f"times that increase: more than {before:g} s")
