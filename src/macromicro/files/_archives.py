"""NumPy (.npz, .npy) and Parquet files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import ProblemError
from macromicro.files._gathered import Gathered
from macromicro.files._matlab import told
from macromicro.files.naming import BESIDE, DATES, spelled, units_in
from macromicro.files.table import Columns, Table
from macromicro.schema.text import printable


def numpy_table(path: Path, where: str, accepted: str) -> Table:
    found = Gathered()
    try:
        content = np.load(path, allow_pickle=False)
        named = {"": content} if isinstance(content, np.ndarray) else content
        for name in named:
            found.add(name, named[name])
    except Exception as error:  # whatever a damaged file does to the reader
        text = "the file cannot be read: " + printable(error, 80)
        raise ProblemError(
            where, text, "Give arrays of numbers, without pickled objects."
        ) from None
    return told(found, where, accepted)


def parquet_table(path: Path, where: str, accepted: str) -> Table:
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        schema = pq.read_schema(path)
    except (OSError, pa.ArrowInvalid) as error:
        text = "the file cannot be read: " + printable(error, 80)
        raise ProblemError(where, text, "Give a Parquet file.") from None
    names, times = [], []
    for field in schema:
        number = pa.types.is_integer(field.type) or pa.types.is_floating(field.type)
        timed = pa.types.is_timestamp(field.type) or pa.types.is_duration(field.type)
        if number or timed or pa.types.is_boolean(field.type):
            names.append(field.name)
            times += [field.name] if timed else []
    if not names:
        raise ProblemError(where, "the file has no column of numbers", f"Name {accepted}.")
    units, reasons = units_in(names)
    for name in names:
        beside = {k.decode().lower(): v for k, v in (schema.field(name).metadata or {}).items()}
        said = beside.get("units", beside.get("unit", b"")).decode("utf-8", "replace")
        if unit := spelled(said):
            units[name], reasons[name] = unit, BESIDE
        if name in times:
            units[name], reasons[name] = "s", DATES

    def fetch(wanted: Sequence[str]) -> dict[str, Array]:
        made = {}
        for name in wanted:  # one after the other, so that each is held once
            made[name] = _values(pq.read_table(path, columns=[name])[name], name in times)
        return made

    return Table(where, Columns(names, fetch), units, {}, reasons)


def _values(column: Any, timed: bool) -> Array:
    """A column as floats, NaN for null; times in s since the first."""
    import pyarrow as pa

    if timed:
        stamps = np.asarray(column.to_numpy())
        if stamps.dtype.kind == "M":
            stamps = stamps - stamps[:1]
        return np.asarray(stamps / np.timedelta64(1, "s"), dtype=np.float64)
    return np.asarray(column.cast(pa.float64(), safe=False).to_numpy(), dtype=np.float64)
