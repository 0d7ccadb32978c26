"""Layout of a text of columns, from its first lines."""

from __future__ import annotations

import codecs
import re
from typing import NamedTuple

from macromicro.errors import InputError, ProblemError
from macromicro.files._cells import (
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
    encoding: str  # as Python calls it
    mark: str  # cell separator, one of `MARKS`
    lines: int  # lines before the first row
    names: tuple[str, ...]  # one for each cell of a row; as in the heading, else "1", "2"
    units: tuple[str, ...]  # of a row of units below the heading, "" where it says none
    kinds: tuple[str, ...]  # most frequent kind in each column
    comma: bool  # decimal comma
    headed: bool
    before: tuple[str, ...]  # the lines before the first row
    returns: bool = False  # lines end with a carriage return alone


def told(sample: bytes, whole: bool, where: str) -> Layout:
    encoding = encoded(sample, where)
    text = sample.decode(encoding, errors="replace")
    if junk := _JUNK.search(text):
        place = text.count("\n", 0, junk.start()) + 1
        raise ProblemError(
            f"{where}, line {place}",
            f"the text contains the control character 0x{ord(junk[0]):02x}",
            f"Give {ACCEPTED}.",
        )
    if not text.strip():
        raise ProblemError(where, "the file is empty", "Add columns of numbers below a heading.")
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
        raise ProblemError(
            where, "the file has nothing but comments", "Add rows of numbers below a heading."
        )
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
    """Encoding of a text, by its first bytes."""
    for bom, name in _BOMS.items():
        if sample.startswith(bom):
            return name
    zeros = sample.count(0)
    if zeros:
        odd, even = sample[1::2].count(0), sample[::2].count(0)
        if max(odd, even) < 0.4 * len(sample):
            raise ProblemError(where, "the text contains zero bytes", f"Give {ACCEPTED}.")
        return "utf-16-le" if odd > even else "utf-16-be"
    try:
        codecs.getincrementaldecoder("utf-8")().decode(sample)  # may end within a character
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8"


def parting(plain: list[tuple[int, str]]) -> tuple[str, int]:
    """Separator of a text, and cells per row."""
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
    """Whether a row matches its columns' kinds and is not empty."""
    here = [kind(cell) for cell in row]
    fits = sum(a == b != TEXT for a, b in zip(here, kinds, strict=True) if a != EMPTY)
    wrong = sum(
        a == TEXT and b in (NUMBER, TIME) for a, b in zip(here, kinds, strict=True) if a != EMPTY
    )
    return fits > 0 and wrong < max(fits, 1)


def _named(
    above: list[tuple[int, str]], mark: str, kinds: tuple[str, ...], where: str, first: int
) -> tuple[list[str], list[str]]:
    """Names and units from the lines above the rows; empty without a heading."""
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
        problem = f"the heading has {len(found)} cells, this line {count}"
        raise ProblemError(f"{where}, line {first + 1}", problem, "Give as many of each.")
    if all(kind(cell) != TEXT for cell in row):
        return [], none
    units = [spelled(cell) for cell in row]
    if len(above) > 1 and sum(map(bool, units)) >= max(1, sum(map(bool, row)) / 2):
        names = _fitting(heading(above[-2][1], mark, count), kinds)
        if names is not None and any(kind(cell) == TEXT for cell in names):
            return names, units
    return row, none


def _fitting(row: list[str], kinds: tuple[str, ...]) -> list[str] | None:
    """A heading cut to the rows' number of cells, if it has an empty one at the end."""
    count = len(kinds)
    if len(row) == count:
        return row
    if len(row) == count - 1 and kinds[-1] == EMPTY:
        return [*row, ""]
    if len(row) == count + 1 and row[-1].lower() in ("", "comment"):
        return row[:-1]
    return None
