"""CSV with commas, decimal points and `#` comments; errors name the line."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable, Iterator
from typing import NamedTuple

from macromicro.errors import InputError, ProblemError
from macromicro.schema.text import printable

_COMMAS = "commas between the columns and points in the numbers"
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?")


class Row(NamedTuple):
    line: int  # its number, from 1
    where: str  # file and line, for messages
    cells: dict[str, str]  # by the column's name, without spaces around them


def table(
    text: str, file: str, header: Callable[[list[str], str], object], accepted: str
) -> Iterator[Row]:
    """The rows of a table; the first line that is not a comment names the columns."""
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
            found = f"the heading has {len(names)} cells, this line {len(cells)}"
            raise ProblemError(where, found, f"Give {', '.join(names)}.")
    if not names:
        raise ProblemError(file, "no header", f"Accepted: {accepted}.")


def _cells(content: str, where: str) -> list[str]:
    if ";" in content or "\t" in content:
        found = "semicolons" if ";" in content else "tabs"
        raise ProblemError(where, f"{found} separate the columns", f"Accepted: {_COMMAS}.")
    if '"' not in content:
        return [cell.strip() for cell in content.split(",")]
    try:
        return [
            cell.strip() for cell in next(csv.reader([content], strict=True, skipinitialspace=True))
        ]
    except csv.Error as error:
        raise ProblemError(
            where, f"the quotes are wrong ({error})", f"Accepted: {_COMMAS}."
        ) from None


def number(text: str, where: str) -> float:
    found = float(text) if _NUMBER.fullmatch(text) else math.nan
    if not math.isfinite(found):
        raise InputError(where, printable(text, 40) or "an empty cell", "a finite number")
    return found


def increasing(t: float, before: float, where: str) -> None:
    """Refuse a time that is not later than the one before it."""
    if t <= before:
        raise InputError(where, f"{t:g} s", f"times that increase: more than {before:g} s")
