"""Text of columns, of any size: NumPy parses the requested columns, or a slow reader does."""

from __future__ import annotations

import codecs
import io
import math
import re
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from macromicro.arrays import Array
from macromicro.drawing.console import progress_bar
from macromicro.errors import InputError, ProblemError
from macromicro.files import naming
from macromicro.files._layout import (
    BLANKS,
    EMPTY,
    HEADING,
    MISSING,
    REMARKS,
    SAMPLE,
    TEXT,
    TIME,
    WORDED,
    Layout,
    Lines,
    Part,
    cells,
    layouts,
    number,
    split,
)
from macromicro.files.table import Columns, Table
from macromicro.schema.text import printable

_WHOLE = 1 << 22  # bytes: of a larger text only the lines near headings are kept
_NUMERIC = b'0123456789+-.,;:|eE"\t\r\n '  # characters of rows of numbers
_NEAR = 6000  # lines below a heading, and above the next one
_BLOCK = 1 << 20  # bytes that are parsed at a time; of larger ones more stays with the process
_SAMPLING = re.compile(r"sampl|rate|frequency|abtast", re.IGNORECASE)
_NUMBER = r"([0-9]+(?:\.[0-9]+)?(?:e[+-]?[0-9]+)?)"
_HERTZ = re.compile(rf"{_NUMBER}\s*(k?hz)|(k?hz)\W+{_NUMBER}", re.IGNORECASE)
_SIZE = {"hz": 1.0, "khz": 1e3}
_SPACES, _DOT = bytes.maketrans(b"\t\r", b"  "), bytes.maketrans(b",", b".")
_MOST_UNREAD = 0.5  # lines or cells per row
_X = "X_Value"  # LabVIEW's column of times
PART = "\n"  # asks for the number of the part that each row is of
Item = TypeVar("Item")


class UnreadLinesWarning(UserWarning):
    """Lines of a text that are no rows of its table were left out."""


def table(path: Path, where: str) -> Table:
    """The columns of a text; those of further tables as "2.name", by their order in the file."""
    with path.open("rb") as file:
        sample = file.read(_WHOLE + 1)
    whole = len(sample) <= _WHOLE
    lines = split(sample if whole else sample[:SAMPLE], whole, where)
    found = layouts(lines, where)
    if not whole and _has_words(path, found[0]):
        found = layouts(_outline(path, lines), where)
    first = _one(path, where, found[0])
    if len(found) == 1:
        return first
    order = sorted(found, key=lambda layout: layout.lines)
    tables = {"": first}
    for layout in found[1:]:
        tables[f"{order.index(layout) + 1}."] = _one(path, where, layout)
    homes = {mark + name: (mark, name) for mark, one in tables.items() for name in one.columns}

    def fetch(names: Sequence[str]) -> dict[str, Array]:
        values: dict[str, Array] = {}
        for mark, one in tables.items():
            own = {name: homes[name][1] for name in names if homes[name][0] == mark}
            read = one.several(list(own.values()))
            values |= {name: read[inner] for name, inner in own.items()}
        return values

    def joined(each: Callable[[Table], Mapping[str, Item]]) -> dict[str, Item]:
        return {m + name: item for m, one in tables.items() for name, item in each(one).items()}

    others = ", ".join(
        sorted(f"{mark}{next(iter(tables[mark].columns))}" for mark in tables if mark)
    )
    text = (
        f"{where}: {len(found)} tables with headings of their own; the longest is the one from line"
    )
    text += f" {found[0].lines + 1} on, columns of others are called {others}, ..."
    warnings.warn(text, UnreadLinesWarning, stacklevel=2)
    return first._replace(
        columns=Columns(homes, fetch),
        units=joined(lambda one: one.units),
        reasons=joined(lambda one: one.reasons),
        doubtful=joined(lambda one: one.doubtful),
        words=tuple(mark + name for mark, one in tables.items() for name in one.words),
    )


def _has_words(path: Path, layout: Layout) -> bool:
    """Whether a line behind the sample might be a heading: words without a number in a cell."""
    words = rf"[\r\n](?!\s*(?:nan|inf)){WORDED}(?!.*{re.escape(layout.mark)}\s*[-+.]?\d)"
    heading = re.compile(words, re.IGNORECASE)
    decoder = codecs.getincrementaldecoder(layout.encoding)("replace")
    with path.open("rb") as file:
        rest = decoder.decode(file.read(SAMPLE))[-1:]  # later the line that a block ends with
        while raw := file.read(_BLOCK):
            block = rest + decoder.decode(raw)
            if raw.translate(None, _NUMERIC) and heading.search(block):
                return True
            rest = block[max(block.rfind("\n"), block.rfind("\r")) :]
    return False


def _outline(path: Path, text: Lines) -> Lines:
    """Lines of a large text, where rows far from a heading repeat earlier ones to save memory."""
    worded = re.compile(WORDED)
    lines: list[str] = []
    rows = 0  # since the last line of words
    end = "\r" if text.returns else "\n"
    with path.open(encoding=text.encoding, errors="replace", newline=end) as file:
        for line in file:
            lines.append(line.rstrip("\r\n"))
            rows = 0 if worded.match(line) else rows + 1
            if rows > 2 * _NEAR:
                lines[-_NEAR] = lines[-2 * _NEAR]
    return text._replace(lines=lines, whole=True)


def _one(path: Path, where: str, layout: Layout) -> Table:
    names, doubtful = list(layout.names), {}
    for name in dict.fromkeys(names):
        if names.count(name) > 1:
            doubtful[name] = f"the name {name!r} occurs twice"
    units, reasons = naming.units_in(names)
    for name, unit, kind in zip(names, layout.units, layout.kinds, strict=True):
        if unit:
            units[name], reasons[name] = unit, naming.IN_ROW
        if kind == TIME:
            units[name], reasons[name] = "s", naming.DATES
    note = "" if layout.headed else f"there is no heading ({HEADING}): columns are called 1, 2, ..."

    def read(wanted: Sequence[str]) -> dict[str, Array]:
        return columns(path, where, layout, wanted)

    words = tuple(n for n, kind in zip(names, layout.kinds, strict=True) if kind in (TEXT, EMPTY))
    rate = _rate(layout.before)
    found = Table(where, Columns(names, read), units, {}, reasons, doubtful, words, note, rate)
    return _labview(found, layout, read)


def _rate(lines: Sequence[str]) -> float:
    """Rows per second of a header such as "sampling rate [Hz]: 200"; NaN without one."""
    for line in lines:
        if _SAMPLING.search(line) and (found := _HERTZ.search(line)):
            return float(found[1] or found[4]) * _SIZE[(found[2] or found[3]).lower()]
    return math.nan


def _labview(
    table: Table, layout: Layout, read: Callable[[Sequence[str]], dict[str, Array]]
) -> Table:
    """A text's table completed by its LabVIEW headers: units, and times by their steps."""
    before = layout.before
    if not before or not before[0].startswith("LabVIEW Measurement"):
        return table
    said = _header(before)
    units, reasons = dict(table.units), dict(table.reasons)
    channels = [name for name in table.columns if name not in (_X, "Comment")]
    for name, unit in zip(channels, said.get("Y_Unit_Label", []), strict=False):
        if good := naming.spell_unit(unit):
            units[name], reasons[name] = good, naming.BESIDE
    if _X in table.columns:
        units[_X], reasons[_X] = "s", "LabVIEW's"
    segments = [_header(part.before) for part in layout.parts] or [said]
    begins, steps = (
        np.array([number(each.get(key, ["?"])[0]) or 0.0 for each in segments])
        for key in ("X0", "Delta_X")
    )
    if said.get("X_Columns", [""])[0] != "No" or not np.all(steps > 0.0):
        return table._replace(units=units, reasons=reasons)

    def fetch(names: Sequence[str]) -> dict[str, Array]:
        wanted = [name for name in names if name != _X] or channels[:1]
        found = read([*wanted, PART])
        part = found.pop(PART).astype(np.intp)
        row = np.arange(len(part)) - np.searchsorted(part, part)  # within its segment
        return {**found, _X: begins[part] + steps[part] * row}

    names = dict.fromkeys([_X, *table.columns])
    units[_X], reasons[_X] = "s", "first value and step in the header"
    return table._replace(columns=Columns(names, fetch), units=units, reasons=reasons)


def _header(lines: Sequence[str]) -> dict[str, list[str]]:
    """Values of a LabVIEW header by their key."""
    said = {}
    for line in lines:
        key, _, rest = line.partition("\t")
        said[key] = [cell.strip() for cell in rest.split("\t")]
    return said


def columns(path: Path, where: str, layout: Layout, names: Sequence[str]) -> dict[str, Array]:
    """Some columns, and the part that each row is of: by NumPy, or line by line."""
    own = [name for name in names if name != PART]
    found = None if layout.parts else _parse(path, layout, own)
    if found is None:
        found = _slow(path, where, layout, own)
    from macromicro.files._times import seconds

    for name in own:
        if layout.kinds[layout.names.index(name)] == TIME:
            found[name] = seconds(found[name], f"{where}, {printable(name)}")
    rows = len(found[own[0]])
    if not rows:
        raise ProblemError(where, "the file has no rows", "Add rows of numbers below the heading.")
    found.setdefault(PART, np.zeros(rows))
    return {name: found[name] for name in names}


def _parse(path: Path, layout: Layout, names: Sequence[str]) -> dict[str, Any] | None:
    """`columns` by NumPy, block by block, times as text; None if a row is not as the others."""
    place = {name: layout.names.index(name) for name in names}
    times = [name for name in names if layout.kinds[place[name]] == TIME]
    texts: dict[str, list[str]] = {name: [] for name in times}
    made = {name: np.empty(0) for name in names if name not in times}
    total = path.stat().st_size
    rows = read = 0
    with bar(path.name, total) as shown:

        def so_far(done: int) -> None:
            nonlocal read
            read = done
            shown(done)

        for piece in pieces(path, layout, so_far):
            block = piece.rstrip(b"\r\n") + b"\n"
            if not _even(block, layout):
                return None
            text = block.decode("latin-1")
            try:
                words = _block(text, layout.mark, [place[name] for name in texts], str)
                values = _block(text, layout.mark, [place[name] for name in made], float)
            except ValueError:
                return None
            until = rows + max(words.shape[1], values.shape[1])
            for name, cells_of in zip(texts, words, strict=True):
                texts[name] += cells_of.tolist()
            for name, column in zip(made, values, strict=True):
                if until > len(made[name]):
                    made[name] = _longer(made[name], rows, until, total / max(read, 1))
                made[name][rows:until] = column
            rows = until
    for column in made.values():
        column.resize(rows, refcheck=False)  # gives the room back that was too much
    return {**made, **texts}


def _even(block: bytes, layout: Layout) -> bool:
    """Whether each line has a cell for each column, and no decimal comma that is quoted."""
    if layout.comma and layout.mark == ",":
        return False
    codes = np.frombuffer(block, np.uint8)
    marks = np.cumsum(codes == ord(layout.mark))[codes == ord("\n")]
    return bool(np.all(np.diff(marks, prepend=0) == len(layout.names) - 1))


def _block(text: str, mark: str, columns: Sequence[int], dtype: type) -> Array:
    """Some columns of whole lines, a row for each."""
    if not columns:
        return np.empty((0, 0))

    def parsed(text: str) -> Array:
        how: dict[str, Any] = {"usecols": columns, "unpack": True, "ndmin": 2, "quotechar": '"'}
        return np.asarray(np.loadtxt(io.StringIO(text), dtype, None, mark, **how))

    if not text.strip():
        return np.empty((len(columns), 0))
    try:
        return parsed(text)
    except ValueError:
        words = "|".join(re.escape(word) for word in MISSING if word)
        optional = "" if mark == BLANKS else "?"
        gap = rf"(?<![^{mark}\n]) *(?:{words}){optional} *(?=[{mark}\r\n])"
        return parsed(re.sub(gap, "nan", text))


def _longer(values: Array, used: int, needed: int, part: float) -> Array:
    """An array with room for the expected rows, of which `needed` are read."""
    new = np.empty(int(needed * min(max(1.1 * part, 1.3), 1e3)) + 1000)
    new[:used] = values[:used]
    return new


def pieces(
    path: Path, layout: Layout, progress: Callable[[int], None], size: int = _BLOCK
) -> Iterator[bytes]:
    """Whole rows in UTF-8, with one separator between cells and a dot in numbers."""
    decoder = None
    if layout.encoding.startswith("utf-16"):
        decoder = codecs.getincrementaldecoder(layout.encoding)()
    skip, rest = layout.lines, b""
    with path.open("rb") as file:
        while True:
            raw = file.read(size)
            piece = rest + (decoder.decode(raw, not raw).encode() if decoder else raw)
            if layout.returns:
                piece = piece.replace(b"\r", b"\n")
            end = piece.rfind(b"\n") + 1 if raw else len(piece)
            piece, rest = piece[:end], piece[end:]
            while skip and piece:
                piece = piece[piece.find(b"\n") + 1 or len(piece) :]
                skip -= 1
            if layout.comma and layout.mark != ",":
                piece = piece.translate(_DOT)
            if layout.mark == BLANKS:
                piece = _single(piece)
            if piece:
                yield piece
            if not raw:
                return
            progress(file.tell())


def _single(piece: bytes) -> bytes:
    """Rows with single spaces between cells."""
    codes = np.frombuffer(piece.translate(_SPACES), np.uint8)
    space = codes == ord(" ")
    kept = ~space
    kept[1:] |= ~(space | (codes == ord("\n")))[:-1]  # the first of several
    return bytes(codes[kept].tobytes()).replace(b" \n", b"\n").rstrip(b" ")


def _slow(path: Path, where: str, layout: Layout, names: Sequence[str]) -> dict[str, Any]:
    """`columns` of a text with remarks between rows, several headings and any number format."""
    # A line with another number of cells is left out; a cell that is no number is NaN.
    count = len(layout.names)
    kinds = dict(zip(layout.names, layout.kinds, strict=True))
    open_ended = layout.kinds[-1] == EMPTY  # trailing marks, which a line may lack
    heads = [name for j, name in enumerate(layout.names, 1) if name != f"column {j}"]
    found: dict[str, list[Any]] = {name: [] for name in names}
    wrong: dict[str, list[tuple[int, str]]] = {}  # by column: line and cell
    unread: list[tuple[int, str]] = []  # line and reason
    parts = []
    for k, part, order, line in _lines(path, layout):
        row = cells(line, layout.mark)
        filled = [cell for cell in row if cell]
        if layout.headed and filled == heads:
            continue  # the next table of a file with several
        if len(row) == count - 1 and open_ended:
            row.append("")
        if len(row) == count + 1 and not row[-1]:
            row.pop()
        if len(row) != count:
            unread.append((k, f"{len(row)} cell{'s' * (len(row) != 1)} instead of {count}"))
            continue
        parts.append(part)
        for name, values in found.items():
            cell = row[order.index(name)]
            value = cell if kinds[name] == TIME else number(cell)
            if value is None:
                value = math.nan
                wrong.setdefault(name, []).append((k, printable(cell, 40)))
            values.append(value)
    _judge(where, len(parts), unread, wrong)
    read = {
        name: values if kinds[name] == TIME else np.array(values, float)
        for name, values in found.items()
    }
    return {**read, PART: np.array(parts, float)}


def _lines(path: Path, layout: Layout) -> Iterator[tuple[int, int, tuple[str, ...], str]]:
    """Lines that should be rows: number, that of the part, columns in their order, text."""
    parts = layout.parts or (Part(layout.lines, 0, layout.names),)
    end = "\r" if layout.returns else "\n"
    with path.open(encoding=layout.encoding, errors="replace", newline=end) as file:
        present, *later = parts
        for k, raw in enumerate(file, 1):
            line = raw.rstrip("\r\n")
            if later and k > later[0].first:
                present, *later = later
            inside = k > present.first and (not present.end or k <= present.end)
            if inside and line.strip() and line.lstrip()[0] not in REMARKS:
                yield k, len(parts) - len(later) - 1, present.names, line


def _judge(
    where: str,
    rows: int,
    unread: Sequence[tuple[int, str]],
    wrong: Mapping[str, Sequence[tuple[int, str]]],
) -> None:
    """Report what was left out; an error where most of the text is no table of numbers."""
    for name, bad in wrong.items():
        line, cell = bad[0]
        at = f"{where}, line {line}, {printable(name)}"
        if len(bad) > _MOST_UNREAD * rows:
            raise InputError(at, cell, "a number, nan, or nothing")
        warnings.warn(
            f"{at}: {cell!r} is not a number{_more(bad)}", UnreadLinesWarning, stacklevel=2
        )
    if not unread:
        return
    line, reason = unread[0]
    if len(unread) > _MOST_UNREAD * rows:
        problem = f"the heading and this line differ: {reason}"
        raise ProblemError(f"{where}, line {line}", problem, "Give as many of each.")
    text = f"{where}, line {line}: {reason}{_more(unread)}; left out"
    warnings.warn(text, UnreadLinesWarning, stacklevel=2)


def _more(lines: Sequence[object]) -> str:
    """What a message adds that names the first of these lines."""
    count = len(lines) - 1
    return f", and {count} more line{'s' * (count != 1)}" if count else ""


LONG = 50_000_000  # bytes


@contextmanager
def bar(name: str, total: int) -> Iterator[Callable[[int], None]]:
    """Show progress for a long file, if stderr is a terminal."""
    if total < LONG or not sys.stderr.isatty():
        yield lambda _: None
        return
    with progress_bar() as shown:
        task = shown.add_task(f"reading {name}", total=total)
        yield lambda done: shown.update(task, completed=done)
