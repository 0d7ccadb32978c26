"""Text cells: numbers, dates and times, words; and lines cut into cells."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence

BLANKS = " "  # the mark of files whose cells are parted by any number of spaces and tabs
MARKS = (",", ";", "\t", "|", BLANKS)
REMARKS = ("#", "%")
NUMBER, TIME, EMPTY, TEXT = "number", "time", "empty", "text"
_NUMBER = re.compile(r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eEdD][+-]?\d+)?")
_TIME = re.compile(
    r"(?:\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4}[T ]*(?:\d{1,2}:\d\d(?::\d\d(?:[.,]\d+)?)?)?"
    r"|\d{1,2}:\d\d(?::\d\d(?:[.,]\d+)?)?)\s*(?:[AaPp][Mm])?(?:Z|[+-]\d\d:?\d\d)?"
)
# What loggers write where they have no number.
MISSING = (
    *("", "nan", "NaN", "NAN", "-nan", "NA", "N/A", "n/a", "null", "NULL", "None", "-", "--"),
    *("1.#QNAN", "-1.#IND", "1.#IND", "nan(ind)", "-nan(ind)"),
)
_INFINITE = ("inf", "infinity")


def cells(line: str, mark: str) -> list[str]:
    if mark == BLANKS:
        line, mark = " ".join(line.split()), " "
    line = line.replace("\r", " ")  # which ends no line here
    row = next(csv.reader([line], delimiter=mark, skipinitialspace=True), [""])
    return [cell.strip() for cell in row] or [""]


def heading(line: str, mark: str, count: int) -> list[str]:
    """Cells of a heading, whose names may contain blanks."""
    text = line.strip().lstrip("".join(REMARKS)).strip() if line.lstrip()[:1] in REMARKS else line
    found = cells(text, mark)
    if mark != BLANKS or len(found) == count:
        return found
    for pattern in (r"\t|\s{2,}", r"\s*[,;]\s*"):
        names = [cell.strip() for cell in re.split(pattern, text.strip())]
        if len(names) == count:
            return names
    names = re.findall(r"[^\s\[(]+(?:\s*[\[(][^\])]*[\])])?", text)
    return names if len(names) == count else found


def kind(cell: str) -> str:
    if not cell:
        return EMPTY
    if _NUMBER.fullmatch(cell) or cell in MISSING or cell.lstrip("+-").lower() in _INFINITE:
        return NUMBER
    return TIME if _TIME.fullmatch(cell) else TEXT


def number(cell: str, mark: str) -> float | None:
    """A cell as a number: 1,5 is one and a half, unless the comma is the separator."""
    if cell in MISSING:
        return float("nan")
    try:
        return float(cell.replace(",", ".").replace("D", "e").replace("d", "e"))
    except ValueError:
        return None


def majority(column: Sequence[str]) -> str:
    """The most frequent kind of cell in a column."""
    full = [each for each in column if each != EMPTY]
    if not full:
        return EMPTY
    return max((NUMBER, TIME, TEXT), key=full.count)
