"""Any measured file as a recording, for plots and comparisons."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from macromicro.arrays import Array
from macromicro.columns import Column
from macromicro.errors import ProblemError
from macromicro.files.naming import split_unit
from macromicro.files.reading import is_recording, read_table
from macromicro.files.table import Table
from macromicro.recording import Recording
from macromicro.recording_format import TIME
from macromicro.schema.text import printable
from macromicro.units import convert

_ODD = re.compile(r"[^A-Za-z0-9_]+")


def recording(path: Path, columns: Sequence[str] = ()) -> Recording:
    """A recording of this package, or another file's columns over time as one."""
    # Names lose units and special characters; times become s.
    if not path.is_file() or is_recording(path):  # `load` says what is wrong with no file
        return Recording.load(path)
    table = read_table(path)
    time = time_column(table)
    names = recording_names(table)
    wanted = [n for n in names if n != time and (not columns or names[n] in columns)]
    if columns:
        found, kept = table.several([time, *wanted]), [time, *wanted]
    else:
        found, kept = _numbers(table, [time, *wanted])
    table.forget()
    t = found.pop(time) * convert(1.0, table.units[time] or "s", "s")
    rows = len(t)
    kept = [n for n in kept if n != time and len(found[n]) == rows]
    good = np.isfinite(t)
    if not good.all():
        t, found = t[good], {n: found[n][good] for n in kept}
    steps = np.diff(t)
    dt = float(np.median(steps)) if len(steps) else 1.0
    if not dt > 0.0:
        where = f"{table.file}, {printable(time)}"
        raise ProblemError(where, "the times do not increase", "Sort the rows by time.")
    made = [Column(TIME, "s", "time"), *(Column(names[n], table.units[n] or "-", n) for n in kept)]
    return Recording.from_arrays(made, [t, *(found[n] for n in kept)], dt, {"file": path.name})


def time_column(table: Table) -> str:
    """The column of times."""
    if name := table.times():
        return name
    listed = ", ".join(printable(name) for name in table.columns)
    remedy = f"Call one t or time; there are {listed}."
    raise ProblemError(table.file, "there is no column of times", remedy)


def recording_names(table: Table) -> dict[str, str]:
    """Recording names of a file's columns."""
    names: dict[str, str] = {}
    for name in table.columns:
        bare = split_unit(name)[0] if table.units.get(name) else name
        stem = _ODD.sub("_", bare).strip("_") or "column"
        stem = f"column_{stem}" if stem[0].isdigit() or stem == TIME else stem
        used, k = set(names.values()), 2
        names[name] = stem
        while names[name] in used:
            names[name], k = f"{stem}_{k}", k + 1
    return names


def _numbers(table: Table, names: list[str]) -> tuple[dict[str, Array], list[str]]:
    """Numeric columns among some; text is left out, except a time, which must be numeric."""
    kept = [name for name in names if name not in table.doubtful and name not in table.words]
    return table.several(kept), kept
