"""Everything that `macromicro look` reports: columns, times, the command to go on with."""

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
from macromicro.identify.picking import RUN, matched
from macromicro.identify.records import GAP, steps
from macromicro.schema.text import printable
from macromicro.units import convert


class Timing(NamedTuple):
    rows: int
    duration: float  # from first to last, of all runs together, s
    rate: float  # rows a second by the usual step, Hz; 0 where times do not increase
    uneven: float  # largest relative deviation of steps without gaps
    # gaps, twice, falls: steps that are gaps, times that are repeated, times that fall
    gaps: int
    twice: int
    falls: int
    # first_gap, first_twice, first_fall: row of the first one, from 1; 0 where there is none
    first_gap: int
    first_twice: int
    first_fall: int
    longest: float  # the longest gap, s
    runs: int = 1  # records in the file, each with times of its own


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
            "template": self.onward.template,
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
        times = _timing(t[good], which) if good.sum() > 1 else None
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


def _timing(t: Array, run: Array | None) -> Timing:
    sizes, usual, gaps, falls = steps(t, run)
    twice = np.flatnonzero(sizes == 0.0)
    near = sizes[(sizes > 0.0) & (sizes <= GAP * usual)]
    first_gap, first_twice, first_fall = (
        int(rows[0]) + 2 if len(rows) else 0 for rows in (gaps, twice, falls)
    )
    return Timing(
        rows=len(t),
        duration=float(np.nansum(sizes)),
        rate=1.0 / usual if usual else 0.0,
        uneven=float(np.abs(near - usual).max()) / usual if len(near) else 0.0,
        gaps=len(gaps),
        twice=len(twice),
        falls=len(falls),
        first_gap=first_gap,
        first_twice=first_twice,
        first_fall=first_fall,
        longest=float(sizes[gaps].max()) if len(gaps) else 0.0,
        runs=1 if run is None else int((np.diff(run) != 0.0).sum()) + 1,
    )


def words(seen: Timing) -> list[str]:
    if not seen.rate:
        return [f"{seen.rows} rows; times do not increase"]
    said = [f"{seen.rows} rows over {seen.duration:.6g} s, {seen.rate:.6g} Hz"]
    if seen.runs > 1:
        said.append(f"{seen.runs} runs")
    if seen.uneven > 0.02:
        said.append(f"steps differ from the usual one by up to {100.0 * seen.uneven:.0f} %")
    if seen.gaps:
        said.append(
            f"{seen.gaps} gaps, the first before row {seen.first_gap}, the longest of "
            f"{seen.longest:.4g} s"
        )
    if seen.twice:
        said.append(f"{seen.twice} times repeated, the first in row {seen.first_twice}")
    if seen.falls:
        said.append(f"{seen.falls} times fall, the first in row {seen.first_fall}")
    return said
