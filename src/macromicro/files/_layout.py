"""Layout of a text of columns, from its lines: cells, headings, tables one after the other."""

from __future__ import annotations

import codecs
import csv
import re
import sys
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from macromicro.errors import InputError, ProblemError
from macromicro.files.naming import spell_unit
from macromicro.schema.text import printable

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
SAMPLE = 1 << 18  # bytes that are looked at
_MOST = 100  # rows that are judged
_LOOKED = 5000  # lines of a table that are looked at, and the last ones
_ROWS = 2  # of a table below a further heading, at least
_TABLE = 10  # rows above the first heading that are a table of their own
_JUNK = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f]")
_RULED = re.compile(r"(?=.*(?:---|===|___))[-=_+|,;:\s]+")  # a line that is drawn below a heading
_HEADER_END = "***End_of_Header***"  # of LabVIEW; one above each of its segments
_BOMS = {codecs.BOM_UTF8: "utf-8-sig", codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16"}
ACCEPTED = "text in UTF-8, UTF-16 or Latin-1"
HEADING = "a heading with the columns' names, such as t_s,u_V,x_mm"
WORDED = r"[\s\"'#%\[(<]*[^\W\d_]"  # a line that begins with a letter
_WORDED = re.compile(WORDED)


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


def number(cell: str) -> float | None:
    """A cell as a number: 1,5 is one and a half."""
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


class Part(NamedTuple):
    """Rows below one of several headings."""

    first: int  # lines before its first row
    end: int  # lines before what follows it
    names: tuple[str, ...]  # in the order of its cells
    rows: int = 0  # roughly
    before: tuple[str, ...] = ()  # the lines above its first row


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
    parts: tuple[Part, ...] = ()  # its rows, in a text of several headings; empty: all below


class Lines(NamedTuple):
    """Lines of a text, or of its beginning."""

    lines: list[str]
    encoding: str
    returns: bool  # they end with a carriage return alone
    whole: bool  # these are all of them


def split(content: bytes, whole: bool, where: str) -> Lines:
    encoding = find_encoding(content[:SAMPLE], where)
    text = content.decode(encoding, errors="replace")
    if junk := _JUNK.search(text, 0, SAMPLE):
        place = text.count("\n", 0, junk.start()) + 1
        problem = f"the text contains the control character 0x{ord(junk[0]):02x}"
        raise ProblemError(f"{where}, line {place}", problem, f"Give {ACCEPTED}.")
    if not text.strip():
        raise ProblemError(where, "the file is empty", "Add columns of numbers below a heading.")
    returns = "\n" not in text and "\r" in text.rstrip("\r")
    lines = text.split("\r" if returns else "\n")
    lines = [line.rstrip("\r") for line in (lines if whole else lines[:-1])]
    return Lines(lines, encoding, returns, whole)


def layouts(text: Lines, where: str) -> list[Layout]:
    """Layout of each table of a text, the one of most rows first."""
    lines = text.lines
    # LabVIEW says where its headers end; they hold rows of numbers, too.
    ends = [k for k, line in enumerate(lines) if line.startswith(_HEADER_END)]
    begin = ends[-1] + 1 if ends else 0
    marks, spans = _segments(lines, ends) if ends else _beginnings(lines)
    found = _tables(text, spans, marks, where) if len(spans) > 1 else []
    if not found:
        laid = _laid(lines, begin, len(lines), where, text.encoding)
        return [laid._replace(returns=text.returns, before=tuple(lines[: laid.lines]))]
    if not text.whole:  # rows go on
        for k, one in enumerate(found):
            *others, last = one.parts
            if last.end == len(lines):
                found[k] = one._replace(parts=(*others, last._replace(end=sys.maxsize)))
    found.sort(key=lambda one: -sum(part.rows for part in one.parts))
    return [one._replace(returns=text.returns) for one in found]


def _tables(
    text: Lines, spans: Sequence[tuple[int, int]], marks: Sequence[str], where: str
) -> list[Layout]:
    """Tables of a text with several headings; parts with the same columns are one table."""
    found: list[Layout] = []
    lines, above = text.lines, 0  # where the rows of the table above end
    for first, end in spans:
        try:
            laid = _laid(lines, first, end, where, text.encoding, marks)
        except InputError:  # a title alone, or words
            continue
        last = _trim(lines, laid.lines, end)
        rows = sum(bool(line.strip()) for line in lines[laid.lines : last])
        part = Part(laid.lines, last, laid.names, rows, tuple(lines[above : laid.lines]))
        before = (*(found[0].before if found else ()), *part.before)
        above = last
        laid = laid._replace(before=before, parts=(part,))
        late = bool(found) and bool(lines[first - 1].strip())
        if late and not found[-1].headed and len(found[-1].names) == len(laid.names):
            headless = found.pop().parts[-1]._replace(names=laid.names)  # the heading came late
            laid = laid._replace(parts=(headless, *laid.parts))
        same = next((k for k, one in enumerate(found) if set(one.names) == set(laid.names)), None)
        if same is None:
            found.append(laid)
        else:
            found[same] = found[same]._replace(parts=found[same].parts + laid.parts)
    return [one for one in found if sum(part.rows for part in one.parts) >= _ROWS] or found[:1]


def _trim(lines: list[str], first: int, end: int) -> int:
    """End of the rows above a further table: what is empty, or its title, is left."""
    while first < end < len(lines) and (
        not lines[end - 1].strip() or _WORDED.match(lines[end - 1])
    ):
        end -= 1
    return end


def _segments(lines: list[str], ends: list[int]) -> tuple[Sequence[str], list[tuple[int, int]]]:
    """Separators to try, and the lines between the headers of a LabVIEW file."""
    spans = [(a + 1, _trim(lines, a + 1, b)) for a, b in pairwise([*ends, len(lines)])]
    *others, last = spans
    return MARKS, [*(span for span in others if span[0] < span[1]), last]


def _beginnings(lines: list[str]) -> tuple[Sequence[str], list[tuple[int, int]]]:
    """Separator, and the lines of each table: the first one, headings below rows of numbers."""
    worded = [k for k, line in enumerate(lines) if _WORDED.match(line)]
    plain = [
        (0, line) for line in lines[-_MOST:] if line.strip() and line.lstrip()[0] not in REMARKS
    ]
    if not worded or not plain:
        return MARKS, []
    mark, _ = parting(plain)
    number_first = re.compile(rf"(?:^|{re.escape(mark)})\s*[-+.]?\d")
    begins, known, row = [0], frozenset[str](), 0  # the line behind the last heading
    for k in worded:
        if number_first.search(lines[k]) or not (names := _heading(lines, k, mark)):
            continue
        rows = [line for line in lines[row:k] if line.strip() and not _WORDED.match(line)]
        rows = [line for line in rows if line.lstrip()[0] not in REMARKS]
        if known and not rows:  # the units below a heading
            continue
        if rows and not known and len(rows) < _TABLE:  # numbers above the first heading
            rows = rows if len(cells(rows[-1], mark)) == len(names) else []
        # A remark, or words directly below a row, might be anything but names seen before.
        above = lines[k - 1] if k else ""
        apart = not above.strip() or bool(_WORDED.match(above))
        sure = lines[k].lstrip()[0] not in REMARKS and (apart or mark != BLANKS)
        if rows and (sure or known == frozenset(names)):
            begins.append(k)
        if sure or not rows:
            known, row = frozenset(names), k + 1
    return (mark,), list(pairwise([*begins, len(lines)]))


def _heading(lines: list[str], k: int, mark: str) -> list[str]:
    """Names in a line of words above a row, perhaps above a row of units; else empty."""
    below = [line for line in lines[k + 1 : k + 6] if line.strip() and not _RULED.fullmatch(line)]
    row = below[0] if below else ""
    if len(below) > 1 and _WORDED.match(row):
        units = [spell_unit(cell) for cell in heading(row, mark, 0)]
        row = below[1] if 2 * sum(map(bool, units)) >= len(units) else ""
    under = cells(row, mark)
    names = [name for name in heading(lines[k], mark, len(under)) if name]
    kinds = [kind(cell) for cell in under]
    fits = len(under) - kinds.count(EMPTY) <= len(names) <= len(under)
    good = fits and len(names) > 1 and len(set(names)) == len(names)
    words = good and all(kind(name) == TEXT for name in names)
    return names if words and 2 * (kinds.count(NUMBER) + kinds.count(TIME)) >= len(under) else []


def _laid(
    lines: list[str], begin: int, end: int, where: str, encoding: str, marks: Sequence[str] = MARKS
) -> Layout:
    """Layout of the table in some of the lines."""
    places = [
        *range(begin, min(end, begin + _LOOKED)),
        *range(max(begin + _LOOKED, end - _MOST), end),
    ]
    full = [(k, lines[k]) for k in places if lines[k].strip()]
    full = [(k, line) for k, line in full if not _RULED.fullmatch(line)]
    plain = [(k, line) for k, line in full if line.lstrip()[0] not in REMARKS]
    if not plain:
        remedy = "Add rows of numbers below a heading."
        raise ProblemError(where, "the file has nothing but comments", remedy)
    mark, count = parting(plain, marks)
    rows = [(k, row) for k, line in plain if len(row := cells(line, mark)) == count]
    kinds = tuple(majority([kind(row[j]) for _, row in rows[-_MOST:]]) for j in range(count))
    first = next((k for k, row in rows if _data(row, kinds)), None)
    if first is None or not {NUMBER, TIME} & set(kinds):
        k, line = plain[-1]
        raise InputError(f"{where}, line {k + 1}", printable(line), "rows of numbers")
    above = [(k, line) for k, line in full if k < first]
    names, units = _names_and_units(above, mark, kinds, where, first)
    seen = [cell for k, row in rows if k >= first for cell in row]
    comma = any("," in cell and kind(cell) == NUMBER for cell in seen)
    headed = bool(names)
    if headed:
        names = [name or f"column {j + 1}" for j, name in enumerate(names)]
    else:
        names = [str(j + 1) for j in range(count)]
    before = tuple(lines[begin:first])
    return Layout(encoding, mark, first, tuple(names), tuple(units), kinds, comma, headed, before)


def find_encoding(sample: bytes, where: str) -> str:
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


def parting(plain: list[tuple[int, str]], marks: Sequence[str] = MARKS) -> tuple[str, int]:
    """Separator of a text, and cells per row."""
    tail = [line for _, line in plain[-_MOST:]]
    best, chosen = 0.0, (marks[0], 1)
    for mark in marks:
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


def _names_and_units(
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
    units = [spell_unit(cell) for cell in row]
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
