"""Everything that `macromicro look` reports."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.files.reading import is_forc, read
from macromicro.files.recordings import timed
from macromicro.files.table import Table
from macromicro.identify.look._columns import Seen, seen
from macromicro.identify.look._onward import Onward, onward
from macromicro.identify.look.timing import Timing, timing
from macromicro.identify.picking import RUN, matched
from macromicro.schema.text import printable
from macromicro.units import convert


class Look(NamedTuple):
    file: str
    columns: tuple[Seen, ...]  # in the file's order
    constants: dict[str, float]  # scalars beside them
    time: str  # the column of times, "" where there is none
    timing: Timing | None
    onward: Onward  # the command to go on with

    def content(self) -> dict[str, Any]:
        return {
            "file": self.file,
            "columns": [column._asdict() for column in self.columns],
            "constants": self.constants,
            "time": self.time,
            "timing": None if self.timing is None else self.timing._asdict(),
            "command": self.onward.command,
            "reasons": self.onward.reasons,
        }


def look(path: Path) -> Look:
    if is_forc(path):
        where = printable(path, 300)
        reason = "first-order reversal curves as MicroMag writes them"
        forward = Onward(f"macromicro identify hysteresis {where}", (reason,))
        return Look(where, (), {}, "", None, forward)
    table = read(path)
    numbers, columns = _looked(table)
    try:
        time = timed(table._replace(columns=numbers))
    except InputError:
        time = ""
    times = None
    if time:
        t = numbers[time] * convert(1.0, table.units[time] or "s", "s")
        good = np.isfinite(t)
        run = matched(table._replace(columns=numbers), (RUN,)).get("run")
        which = numbers[run][good] if run and len(numbers[run]) == len(t) else None
        times = timing(t[good], which) if good.sum() > 1 else None
        if times is not None and (times.runs > 1 or times.falls):
            columns = tuple(c._replace(remarks=()) if c.name == time else c for c in columns)
    forward = onward(table, numbers)
    return Look(table.file, columns, table.constants, time, times, forward)


def _looked(table: Table) -> tuple[dict[str, Array], tuple[Seen, ...]]:
    likely = [n for n in table.columns if n not in table.words and n not in table.doubtful]
    try:
        numbers = table.several(likely)
        failed: dict[str, str] = {}
    except InputError:  # one of them; which one, each by itself tells
        numbers, failed = {}, {}
        for name in likely:
            try:
                numbers |= table.several([name])
            except InputError as error:
                place = str(error).partition(";")[0].removeprefix(f"{table.file}, ")
                failed[name] = f"cannot be read: {place}"
    found = []
    for name in table.columns:
        unit, reason = table.units.get(name, ""), table.reasons.get(name, "")
        if name in numbers:
            found.append(seen(name, unit, reason, numbers[name]))
            continue
        why = failed.get(name) or table.doubtful.get(name) or "text, or empty"
        found.append(Seen(name, unit, reason, remarks=(why,)))
    return numbers, tuple(found)
