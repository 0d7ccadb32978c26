"""Text that pyarrow rejects: read cell by cell, without the lines that are no rows."""

from __future__ import annotations

import io
import math
import warnings
from array import array
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.files._cells import EMPTY, REMARKS, TIME, cells, number
from macromicro.files._layout import Layout
from macromicro.schema.text import printable

MOST = 0.5  # unread lines or cells per row


class UnreadLinesWarning(UserWarning):
    """Lines of a text that are no rows of its table were left out."""


def carefully(path: Path, where: str, layout: Layout, names: Sequence[str]) -> dict[str, Array]:
    """Columns of a text with remarks between rows and any number format."""
    # A line with another number of cells is left out; a cell that is no number is NaN.
    place = {name: layout.names.index(name) for name in names}
    times = {name for name, j in place.items() if layout.kinds[j] == TIME}
    numbers = {name: array("d") for name in names if name not in times}
    texts: dict[str, list[str]] = {name: [] for name in times}
    wrong: dict[str, list[tuple[int, str]]] = {}  # by column: line and cell
    count = len(layout.names)
    open_ended = layout.kinds[-1] == EMPTY  # trailing marks, which a line may lack
    heads = [name for j, name in enumerate(layout.names, 1) if name != f"column {j}"]
    unread: list[tuple[int, str]] = []  # line and reason
    rows = 0
    with path.open("rb") as file:
        decoded = io.TextIOWrapper(
            file,
            encoding=layout.encoding,
            errors="replace",
            newline="\r" if layout.returns else "\n",
        )
        for k, raw in enumerate(decoded, 1):
            line = raw.rstrip("\r\n")
            if k <= layout.lines or not line.strip() or line.lstrip()[0] in REMARKS:
                continue
            row = cells(line, layout.mark)
            if layout.headed and [cell for cell in row if cell] == heads:
                continue  # the next table of a file with several
            if len(row) == count - 1 and open_ended:
                row.append("")
            if len(row) == count + 1 and not row[-1]:
                row.pop()
            if len(row) != count:
                unread.append((k, f"{len(row)} cell{'s' * (len(row) != 1)} instead of {count}"))
                continue
            rows += 1
            for name, values in numbers.items():
                value = number(row[place[name]], layout.mark)
                if value is None:
                    value = math.nan
                    wrong.setdefault(name, []).append((k, printable(row[place[name]], 40)))
                values.append(value)
            for name, words in texts.items():
                words.append(row[place[name]])
    _judge(where, rows, unread, wrong)
    made = {name: np.array(values, dtype=np.float64) for name, values in numbers.items()}
    if texts:
        import pyarrow as pa

        from macromicro.files._times import seconds

        for name, words in texts.items():
            made[name] = seconds(pa.array(words, pa.string()), f"{where}, {printable(name)}")
    return {name: made[name] for name in names}


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
        if len(bad) > MOST * rows:
            raise InputError(at, cell, "a number, nan, or nothing")
        warnings.warn(f"{at}: {cell!r} is no number{_more(bad)}", UnreadLinesWarning, stacklevel=2)
    if not unread:
        return
    line, reason = unread[0]
    if len(unread) > MOST * rows:
        problem = f"the heading and this line differ: {reason}"
        raise ProblemError(f"{where}, line {line}", problem, "Give as many of each.")
    text = f"{where}, line {line}: {reason}{_more(unread)}; left out"
    warnings.warn(text, UnreadLinesWarning, stacklevel=2)


def _more(lines: Sequence[object]) -> str:
    """What a message adds that names the first of these lines."""
    count = len(lines) - 1
    return f", and {count} more line{'s' * (count != 1)}" if count else ""
