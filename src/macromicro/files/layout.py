"""How a text of columns is laid out, told from its first lines."""

from __future__ import annotations

import codecs
import re
from typing import NamedTuple

from macromicro.errors import InputError
from macromicro.files.cells import (
    BLANKS,
    EMPTY,
    MARKS,
    NUMBER,
    REMARKS,
    TEXT,
    TIME,
    cells,
    heading,
    kind,
    majority,
)
from macromicro.files.naming import spelled
from macromicro.schema.text import printable

SAMPLE = 1 << 18  # bytes that are looked at
_MOST = 100  # rows that are judged
_JUNK = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f]")
_RULED = re.compile(r"(?=.*(?:---|===|___))[-=_+|,;:\s]+")  # a line that is drawn below a heading
_HEADER_END = "***End_of_Header***"
_BOMS = {
    codecs.BOM_UTF8: "utf-8-sig",
    codecs.BOM_UTF16_LE: "utf-16",
    codecs.BOM_UTF16_BE: "utf-16",
}
ACCEPTED = "text in UTF-8, UTF-16 or Latin-1"
HEADING = "a heading with the columns' names, such as t_s,u_V,x_mm"


class Layout(NamedTuple):
    """How a text is laid out.

    Attributes
    ----------
    encoding : str
        As Python calls it.
    mark : str
        What parts cells, one of `MARKS`.
    lines : int
        Lines before the first row.
    names : tuple[str, ...]
        One for each cell of a row; as in the heading, else "1", "2" ...
    units : tuple[str, ...]
        Of a row of units below the heading, "" where it says none.
    kinds : tuple[str, ...]
        What the cells of each column are, mostly.
    comma : bool
        Whether numbers have a decimal comma.
    headed : bool
        Whether there is a heading.
    before : tuple[str, ...]
        The lines before the first row.
    returns : bool
        Whether lines end with a carriage return alone.
    """

    encoding: str
    mark: str
    lines: int
    names: tuple[str, ...]
    units: tuple[str, ...]
    kinds: tuple[str, ...]
    comma: bool
    headed: bool
    before: tuple[str, ...]
    returns: bool = False


def told(sample: bytes, whole: bool, where: str) -> Layout:
    """The layout of a text.

    Parameters
    ----------
    sample : bytes
        What it begins with.
    whole : bool
        Whether that is all of it.
    where : str
        The file, for messages.

    Returns
    -------
    Layout
        Of its rows.

    Raises
    ------
    InputError
        It is empty, no text, has no rows of numbers, or another heading than rows.
    """
    encoding = encoded(sample, where)
    text = sample.decode(encoding, errors="replace")
    if junk := _JUNK.search(text):
        place = text.count("\n", 0, junk.start()) + 1
        found = f"control character 0x{ord(junk[0]):02x}"
        raise InputError(f"{where}, line {place}", found, ACCEPTED)
    if not text.strip():
        raise InputError(where, "an empty file", "columns of numbers below a heading")
    returns = "\n" not in text and "\r" in text.rstrip("\r")
    lines = text.split("\r" if returns else "\n")
    lines = [line.rstrip("\r") for line in (lines if whole else lines[:-1])]
    # LabVIEW says where its headers end; they hold rows of numbers, too.
    ends = [k for k, line in enumerate(lines) if line.startswith(_HEADER_END)]
    begin = ends[-1] + 1 if ends else 0
    full = [(k, line) for k, line in enumerate(lines) if line.strip() and k >= begin]
    full = [(k, line) for k, line in full if not _RULED.fullmatch(line)]
    plain = [(k, line) for k, line in full if line.lstrip()[0] not in REMARKS]
    if not plain:
        raise InputError(where, "nothing but comments", "rows of numbers below a heading")
    mark, count = parting(plain)
    rows = [(k, row) for k, line in plain if len(row := cells(line, mark)) == count]
    kinds = tuple(majority([kind(row[j]) for _, row in rows[-_MOST:]]) for j in range(count))
    first = next((k for k, row in rows if _data(row, kinds)), None)
    if first is None or not {NUMBER, TIME} & set(kinds):
        k, line = plain[-1]
        raise InputError(f"{where}, line {k + 1}", printable(line), "rows of numbers")
    above = [(k, line) for k, line in full if k < first]
    names, units = _named(above, mark, kinds, where, first)
    seen = [cell for k, row in rows if k >= first for cell in row]
    comma = any("," in cell and kind(cell) == NUMBER for cell in seen)
    headed = bool(names)
    if headed:
        names = [name or f"column {j + 1}" for j, name in enumerate(names)]
    else:
        names = [str(j + 1) for j in range(count)]
    before = tuple(lines[:first])
    laid = Layout(encoding, mark, first, tuple(names), tuple(units), kinds, comma, headed, before)
    return laid._replace(returns=returns)


def encoded(sample: bytes, where: str) -> str:
    """The encoding of a text, by its first bytes.

    Parameters
    ----------
    sample : bytes
        What it begins with.
    where : str
        The file, for messages.

    Returns
    -------
    str
        As Python calls it.

    Raises
    ------
    InputError
        Zeros that are no part of UTF-16.
    """
    for bom, name in _BOMS.items():
        if sample.startswith(bom):
            return name
    zeros = sample.count(0)
    if zeros:
        odd, even = sample[1::2].count(0), sample[::2].count(0)
        if max(odd, even) < 0.4 * len(sample):
            raise InputError(where, "bytes that are zero", ACCEPTED)
        return "utf-16-le" if odd > even else "utf-16-be"
    try:
        codecs.getincrementaldecoder("utf-8")().decode(sample)  # may end within a character
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8"


def parting(plain: list[tuple[int, str]]) -> tuple[str, int]:
    """What parts the cells of a text, and how many a row has.

    Parameters
    ----------
    plain : list[tuple[int, str]]
        Lines that are no remarks, with their numbers.

    Returns
    -------
    mark : str
        One of `MARKS`.
    count : int
        Cells of a row.
    """
    tail = [line for _, line in plain[-_MOST:]]
    best, chosen = 0.0, (",", 1)
    for mark in MARKS:
        rows = [cells(line, mark) for line in tail]
        sizes = [len(row) for row in rows]
        count = max(sizes, key=lambda size: (sizes.count(size), size))
        if (
            len(tail) > 1 and sizes.count(count) == 1
        ):  # a heading and a single row, perhaps not alike
            count = sizes[-1]
        kinds = [kind(c) for row in rows if len(row) == count for c in row]
        good = sum(k in (NUMBER, TIME, EMPTY) for k in kinds) if {NUMBER, TIME} & set(kinds) else 0
        score = good / count / len(rows) + (0.0 if count > 1 else -0.6)
        if score > best + 1e-9:
            best, chosen = score, (mark, count)
    return chosen


def _data(row: list[str], kinds: tuple[str, ...]) -> bool:
    """Whether a row is one of data: what its columns are elsewhere, and something at all."""
    here = [kind(cell) for cell in row]
    fits = sum(a == b != TEXT for a, b in zip(here, kinds, strict=True) if a != EMPTY)
    wrong = sum(
        a == TEXT and b in (NUMBER, TIME) for a, b in zip(here, kinds, strict=True) if a != EMPTY
    )
    return fits > 0 and wrong < max(fits, 1)


def _named(
    above: list[tuple[int, str]], mark: str, kinds: tuple[str, ...], where: str, first: int
) -> tuple[list[str], list[str]]:
    """Names and units from the lines above the rows; nothing where there is no heading."""
    count = len(kinds)
    none = [""] * count
    if not above:
        return [], none
    row = _fitting(heading(above[-1][1], mark, count), kinds)
    if row is None:
        line = above[-1][1]
        found = heading(line, mark, count)
        if line.lstrip()[0] in REMARKS or len(found) == 1 or mark == BLANKS:
            return [], none
        accepted = f"{len(found)}, as in the heading"
        raise InputError(f"{where}, line {first + 1}", f"{count} cells", accepted)
    if all(kind(cell) != TEXT for cell in row):
        return [], none
    units = [spelled(cell) for cell in row]
    if len(above) > 1 and sum(map(bool, units)) >= max(1, sum(map(bool, row)) / 2):
        names = _fitting(heading(above[-2][1], mark, count), kinds)
        if names is not None and any(kind(cell) == TEXT for cell in names):
            return names, units
    return row, none


def _fitting(row: list[str], kinds: tuple[str, ...]) -> list[str] | None:
    """A heading with as many cells as the rows, where they differ by an empty one at the end."""
    count = len(kinds)
    if len(row) == count:
        return row
    if len(row) == count - 1 and kinds[-1] == EMPTY:
        return [*row, ""]
    if len(row) == count + 1 and row[-1].lower() in ("", "comment"):
        return row[:-1]
    return None
