"""Text that pyarrow rejects: read cell by cell, or rejected with its line."""

from __future__ import annotations

import io
from array import array
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.files._cells import EMPTY, REMARKS, TIME, cells, number
from macromicro.files._layout import Layout
from macromicro.schema.text import printable


def carefully(path: Path, where: str, layout: Layout, names: Sequence[str]) -> dict[str, Array]:
    """Columns of a text with remarks between rows and any number format."""
    place = {name: layout.names.index(name) for name in names}
    times = {name for name, j in place.items() if layout.kinds[j] == TIME}
    numbers = {name: array("d") for name in names if name not in times}
    texts: dict[str, list[str]] = {name: [] for name in times}
    count = len(layout.names)
    open_ended = layout.kinds[-1] == EMPTY  # trailing marks, which a line may lack
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
            if len(row) == count - 1 and open_ended:
                row.append("")
            if len(row) == count + 1 and not row[-1]:
                row.pop()
            if len(row) != count:
                found = f"the heading has {count} cells, this line {len(row)}"
                raise ProblemError(f"{where}, line {k}", found, "Give as many of each.")
            for name, values in numbers.items():
                value = number(row[place[name]], layout.mark)
                if value is None:
                    at = f"{where}, line {k}, {printable(name)}"
                    raise InputError(at, printable(row[place[name]]), "a number, nan, or nothing")
                values.append(value)
            for name, words in texts.items():
                words.append(row[place[name]])
    made = {name: np.array(values, dtype=np.float64) for name, values in numbers.items()}
    if texts:
        import pyarrow as pa

        from macromicro.files._times import seconds

        for name, words in texts.items():
            made[name] = seconds(pa.array(words, pa.string()), f"{where}, {printable(name)}")
    return {name: made[name] for name in names}
