"""Delimited text of any size; pyarrow parses only the requested columns."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import ProblemError
from macromicro.files import _labview, naming
from macromicro.files._cells import EMPTY, MISSING, TEXT, TIME
from macromicro.files._layout import HEADING, SAMPLE, Layout, told
from macromicro.files._progress import bar
from macromicro.files._stream import Rows
from macromicro.files.table import Columns, Table

_BLOCK = 1 << 20  # bytes that are parsed at a time; of larger ones more stays with the process
_SAMPLING = re.compile(r"sampl|rate|frequency|abtast", re.IGNORECASE)
_NUMBER = r"([0-9]+(?:\.[0-9]+)?(?:e[+-]?[0-9]+)?)"
_HERTZ = re.compile(rf"{_NUMBER}\s*(k?hz)|(k?hz)\W+{_NUMBER}", re.IGNORECASE)
_SIZE = {"hz": 1.0, "khz": 1e3}
_EMPTY = (*MISSING, *(" " * k for k in range(1, 9)))


def table(path: Path, where: str) -> Table:
    with path.open("rb") as file:
        sample = file.read(SAMPLE)
        whole = not file.read(1)
    layout = told(sample, whole, where)
    names, doubtful = list(layout.names), {}
    for name in dict.fromkeys(names):
        if names.count(name) > 1:
            doubtful[name] = f"the name {name!r} occurs twice"
    units, reasons = naming.units_in(names)
    for name, unit in zip(names, layout.units, strict=True):
        if unit:
            units[name], reasons[name] = unit, naming.IN_ROW
    for name, kind in zip(names, layout.kinds, strict=True):
        if kind == TIME:
            units[name], reasons[name] = "s", naming.DATES
    note = "" if layout.headed else f"there is no heading ({HEADING}): columns are called 1, 2, ..."
    made = Columns(names, lambda wanted: columns(path, where, layout, wanted))
    words = tuple(n for n, kind in zip(names, layout.kinds, strict=True) if kind in (TEXT, EMPTY))
    rate = _rate(layout.before)
    found = Table(where, made, units, {}, reasons, doubtful, words, note, rate)
    return _labview.completed(found, layout.before)


def _rate(lines: Sequence[str]) -> float:
    """Rows per second of a header such as "sampling rate [Hz]: 200"; NaN without one."""
    for line in lines:
        if _SAMPLING.search(line) and (number := _HERTZ.search(line)):
            return float(number[1] or number[4]) * _SIZE[(number[2] or number[3]).lower()]
    return math.nan


def columns(path: Path, where: str, layout: Layout, names: Sequence[str]) -> dict[str, Array]:
    import pyarrow as pa

    try:
        return _parsed(path, where, layout, names)
    except pa.ArrowInvalid:
        from macromicro.files._faults import carefully

        return carefully(path, where, layout, names)


def _parsed(path: Path, where: str, layout: Layout, names: Sequence[str]) -> dict[str, Array]:
    """`columns` by pyarrow, block by block into arrays of their final length."""
    import pyarrow as pa
    from pyarrow import csv

    place = {name: layout.names.index(name) for name in names}
    times = {n for n, j in place.items() if layout.kinds[j] == TIME}
    own = [str(j) for j in range(len(layout.names))]  # names that cannot be ambiguous
    wanted = [own[j] for j in place.values()]
    kinds = [pa.string() if name in times else pa.float64() for name in names]
    options = {
        "read_options": csv.ReadOptions(column_names=own, block_size=_BLOCK),
        "parse_options": csv.ParseOptions(delimiter=layout.mark),
        "convert_options": csv.ConvertOptions(
            include_columns=wanted,
            column_types=dict(zip(wanted, kinds, strict=True)),
            null_values=_EMPTY,
            decimal_point="," if layout.comma and layout.mark == "," else ".",
            check_utf8=False,
        ),
    }
    total = path.stat().st_size
    texts: dict[str, list[Any]] = {name: [] for name in times}
    made = {name: np.empty(0) for name in names if name not in times}
    rows = 0
    with bar(path.name, total) as shown:
        read = 0

        def so_far(done: int) -> None:
            nonlocal read
            read = done
            shown(done)

        with (
            closing(Rows(path, layout, so_far)) as source,
            csv.open_csv(pa.PythonFile(source, mode="r"), **options) as batches,
        ):
            for batch in batches:
                until = rows + batch.num_rows
                for k, name in enumerate(names):
                    if name in times:
                        texts[name].append(batch.column(k))
                        continue
                    if until > len(made[name]):
                        made[name] = _longer(made[name], rows, until, total / max(read, 1))
                    made[name][rows:until] = batch.column(k).to_numpy(zero_copy_only=False)
                rows = until
    from macromicro.files._times import seconds

    for values in made.values():
        values.resize(rows, refcheck=False)  # gives the room back that was too much
    stamps = {
        name: seconds(pa.chunked_array(parts).combine_chunks(), f"{where}, {name}")
        for name, parts in texts.items()
    }
    if not rows:
        raise ProblemError(where, "the file has no rows", "Add rows of numbers below the heading.")
    return {name: stamps[name] if name in times else made[name] for name in names}


def _longer(values: Array, used: int, needed: int, part: float) -> Array:
    """An array with room for the expected rows, of which `needed` are read."""
    new = np.empty(int(needed * min(max(1.1 * part, 1.3), 1e3)) + 1000)
    new[:used] = values[:used]
    return new
