"""Contents of a measured file: columns, times, and the command to continue with."""

from __future__ import annotations

import math
import shlex
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.files.reading import is_forc, read_table
from macromicro.files.recordings import time_column
from macromicro.files.table import Table
from macromicro.identify.kinds import drive, hall, hysteresis, linear, stress, thermal
from macromicro.identify.notices import SaturationWarning
from macromicro.identify.picking import DEGREES, RUN, Role, T, find_saturated, match_columns
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
    table = read_table(path)
    numbers, columns = _look_at(table)
    try:
        time = time_column(table._replace(columns=numbers))
    except InputError:
        time = ""
    times = None
    if time:
        t = numbers[time] * convert(1.0, table.units[time] or "s", "s")
        good = np.isfinite(t)
        run = match_columns(table._replace(columns=numbers), (RUN,)).get("run")
        which = numbers[run][good] if run and len(numbers[run]) == len(t) else None
        times = _timing(t[good], which) if good.sum() > 1 else None
        if times is not None and (times.runs > 1 or times.falls):
            columns = tuple(c._replace(remarks=()) if c.name == time else c for c in columns)
    forward = onward(table, numbers)
    return Look(table.file, columns, table.constants, time, times, forward)


def _look_at(table: Table) -> tuple[dict[str, Array], tuple[Seen, ...]]:
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
            found.append(describe_column(name, unit, reason, numbers[name]))
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


_TURNS = {
    **{"deg": (360.0,), "rad": (2.0 * math.pi,), "rev": (1.0,)},
    "counts": tuple(2.0**k for k in range(8, 33)),
}
_TURNS[""] = (*_TURNS["deg"], *_TURNS["rad"], *_TURNS["counts"])
_JUMP = 0.8  # of the range: what wraps falls by so much at least
_SLOW = 0.1  # of the range: usual steps are smaller, or there is no telling
_ALIKE = 3.0  # the rate behind a wrap is within this factor of the rate before it
_CHATTER = 5  # rows
_SURE = 0.9  # of the jumps are those of one motion
_NEAR = 0.02  # of a full range: a sensor comes so near to both of its ends
_ROUGH = 1e-3  # of a usual step: smoother signals are no measurements


class Seen(NamedTuple):
    # name, unit, reason: as in the file; the unit, and where it is from
    name: str
    unit: str
    reason: str
    low: float = math.nan  # least and greatest value
    high: float = math.nan  # NaN where it holds no numbers
    missing: int = 0  # rows without a finite number
    step: float = math.nan  # smallest difference of two rows that differ; NaN where none do
    remarks: tuple[str, ...] = ()  # anomalies, in words


def describe_column(name: str, unit: str, reason: str, values: Array) -> Seen:
    good = values[np.isfinite(values)]
    missing = len(values) - len(good)
    if not len(good):
        return Seen(name, unit, reason, missing=missing, remarks=("no number in any row",))
    low, high = float(good.min()), float(good.max())
    if low == high:
        return Seen(name, unit, reason, low, high, missing, remarks=("constant",))
    steps = np.abs(np.diff(good))
    remarks = [*find_wraps(good, unit), *find_saturation(good)]
    step = float(steps[steps > 0.0].min())
    return Seen(name, unit, reason, low, high, missing, step, tuple(remarks))


def find_wraps(values: Array, unit: str) -> list[str]:
    """A counter or an angle that passes the end of its range and goes on at the other end."""
    extent, steps = float(np.ptp(values)), np.diff(values)
    jumps = np.flatnonzero(np.abs(steps) > _JUMP * extent)
    moving = np.abs(steps[steps != 0.0])
    usual = float(np.median(moving)) if len(moving) else 0.0
    if not len(jumps) or usual > _SLOW * extent:
        return []
    gaps = np.diff(jumps)  # noise at an end of the range makes jumps to and fro
    alone = np.r_[True, gaps > _CHATTER] & np.r_[gaps > _CHATTER, True]
    for turn in _turns(values, unit, np.abs(steps[jumps]) + usual):
        good = [_goes_on(steps, int(k), jumps, turn) for k in jumps[alone]]
        if good and np.mean(good) >= _SURE:
            times = f"{len(jumps)} time{'s' * (len(jumps) != 1)}"
            return [f"wraps {times} at {turn:g}, first in row {jumps[0] + 2}"]
    return []


def _turns(values: Array, unit: str, sizes: Array) -> list[float]:
    """Full ranges that the values nearly fill; of a counter without a usual one, its own."""
    extent = float(np.ptp(values))
    found = [turn for turn in _TURNS.get(unit, ()) if (1.0 - _NEAR) * turn <= extent <= turn]
    whole = unit in ("", "counts") and bool(np.all(values == np.round(values)))
    if not found and whole and len(sizes) > 2 and values.min() == 0.0 and extent > 50.0:
        found = [float(round(float(np.median(sizes))))]
    return found


def _goes_on(steps: Array, k: int, jumps: npt.NDArray[np.int64], turn: float) -> bool:
    """Whether the speeds before and behind a jump, and the step across, are of one motion."""
    width = max(_CHATTER, len(steps) // 50)
    place = int(np.searchsorted(jumps, k))
    first = max(k - width, jumps[place - 1] + 1 if place else 0)
    last = min(k + width + 1, jumps[place + 1] if place + 1 < len(jumps) else len(steps))
    if first == k or last == k + 1:
        return False
    before, after = float(np.mean(steps[first:k])), float(np.mean(steps[k + 1 : last]))
    low, high = sorted((abs(before), abs(after)))
    across = steps[k] - math.copysign(turn, steps[k]) - 0.5 * (before + after)
    usual = max(float(np.abs(steps[first:k]).max()), float(np.abs(steps[k + 1 : last]).max()))
    against = before * steps[k] < 0.0 and after * steps[k] < 0.0
    return bool(against and high <= _ALIKE * low and abs(across) <= 2.0 * usual)


def find_saturation(values: Array) -> list[str]:
    """A sensor that stays at an end of its range where its signal, not a smooth one, goes on."""
    bends, steps = np.abs(np.diff(values, 2)), np.abs(np.diff(values))
    moving = bends[(steps[1:] > 0.0) & (steps[:-1] > 0.0)]
    if not len(moving) or np.median(moving) <= _ROUGH * float(np.median(steps[steps > 0.0])):
        return []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", SaturationWarning)
        try:
            find_saturated(values, "", "")
        except InputError as error:
            return [str(error.value)]
    texts = [str(w.message) for w in caught]
    return [text.removeprefix(": ").partition(", as those")[0] + ": saturated" for text in texts]


_LEAST = 20  # rows that any identification takes
_EVEN, _ODD = 0.05, 0.01  # a step this far off the median is odd; share of odd steps in a clock


class Onward(NamedTuple):
    command: str  # to type; "" where the columns are not certain
    reasons: tuple[str, ...]  # of the columns chosen
    template: str = ""  # the command with "?" or HZ in place of what has to be named


# Kind of identification, its roles, those that a file must have for it, and those of them whose
# units must be known; the first that fits.
_KINDS: tuple[tuple[str, Sequence[Role], str, str], ...] = (
    ("hysteresis", hysteresis.ROLES, "u f curve", ""),
    ("stress", stress.ROLES, "T x load", "T load"),
    ("drive", drive.ROLES, "t u x", ""),
    ("linear", linear.ROLES, "t u y", ""),
    ("thermal", (T, thermal.U, thermal.TEMPERATURE), "t u T", "T"),
    ("hall", hall.ROLES, "v x", "v x"),
    ("plays", hysteresis.ROLES, "u f", ""),
)


def onward(table: Table, numbers: Mapping[str, Array]) -> Onward:
    good = {name: values[np.isfinite(values)] for name, values in numbers.items()}
    moving = {n: v for n, v in numbers.items() if len(good[n]) and np.ptp(good[n]) > 0.0}
    known = table._replace(columns=moving)
    if not any(len(values) >= _LEAST for values in moving.values()):
        return Onward("", (f"fewer than {_LEAST} rows of numbers that change: too few",))
    for kind, roles, needed, with_units in _KINDS:
        found = match_columns(known, roles)
        clocked = math.isfinite(table.rate) and "t" not in found
        wanted = [role for role in needed.split() if role != "t" or not clocked]
        fits = all(
            role.name in found and _fits(table.units.get(found[role.name], ""), role, with_units)
            for role in roles
            if role.name in wanted
        )
        if fits and len({len(moving[found[role]]) for role in wanted}) == 1:
            reasons = [f"{role}: {found[role]}, by its name" for role in wanted]
            return Onward(_command(kind, table.file), tuple(reasons))
    if output := _output(known):
        reasons = ["t and u, by their names", f"y: {output}, the only other column"]
        return Onward(_command("linear", table.file, "", {"y": output}), tuple(reasons))
    columns, reasons = by_units(known)
    if columns["t"] == "?" and math.isfinite(table.rate):
        del columns["t"]
    rate = "HZ" if columns.get("t") == "?" else ""
    if rate:
        del columns["t"]
        reasons.append("t: no column holds times; put the rows per second for HZ")
    line = _command("drive", table.file, rate, columns)
    if rate or "?" in columns.values():
        return Onward("", tuple(reasons), line)
    return Onward(line, tuple(reasons))


def _output(table: Table) -> str:
    """The only column beside a time and an input, if it is neither a position nor a speed."""
    found = match_columns(table, (T, linear.U))
    others = [name for name in table.columns if name not in found.values()]
    unit = table.units.get(others[0], "") if len(others) == 1 and len(found) == 2 else ""
    moves = not unit or _converts(unit, (*drive.X.units, *drive.V.units))
    return "" if moves else others[0]


def _command(kind: str, file: str, rate: str = "", columns: Mapping[str, str] | None = None) -> str:
    pairs = ",".join(f"{role}={name}" for role, name in (columns or {}).items())
    words = ["macromicro", "identify", kind, file]
    words += ["--rate", rate] if rate else []
    return shlex.join(words + (["--columns", pairs] if pairs else []))


def _fits(unit: str, role: Role, with_units: str) -> bool:
    """Whether a column of this unit can have a role."""
    if not unit:
        return role.name not in with_units.split()
    degrees = "degC" in role.units and unit in DEGREES
    return not role.units or degrees or _converts(unit, role.units)


def by_units(table: Table) -> tuple[dict[str, str], list[str]]:
    """Time, effort and position of a drive, by name, by units or by even steps; "?" if unsure."""
    roles = (*drive.ROLES[:3], drive.V)
    named = {
        role.name: name
        for role in roles
        if (name := match_columns(table, (role,)).get(role.name, ""))
        and _fits(table.units.get(name, ""), role, "")
    }
    if "x" in named or table.units.get(named.get("v", ""), "") == "":
        named.pop("v", None)
    columns = {"t": "?", "u": "?", "x": "?"} | named
    reasons = [f"{role}: {name}, by its name" for role, name in named.items()]
    rest = {n: v for n, v in table.columns.items() if n not in named.values()}
    if columns["t"] == "?":
        for name, values in rest.items():
            if but := _clock(values):
                columns["t"] = name
                reasons.append(f"t: {name}, which rises in even steps{but.rstrip('.')}")
                del rest[name]
                break
    for role in roles[1:]:
        fits = [name for name in rest if _converts(table.units.get(name, ""), role.units)]
        free = columns["x" if role is drive.V else role.name] == "?"
        if free and len(fits) == 1:
            columns[role.name] = fits[0]
            reasons.append(f"{role.name}: {fits[0]}, the only one in {table.units[fits[0]]}")
            del rest[fits[0]]
    if "v" in columns:  # a speed does for a position
        del columns["x"]
    return columns, reasons


def _clock(values: Array) -> str:
    """Whether values rise in even steps: "." or the row of the first odd step; "" if not."""
    steps = np.diff(values)
    if len(steps) < 2 or not steps.min() > 0.0:
        return ""
    odd = np.abs(steps / np.median(steps) - 1.0) > _EVEN
    if odd.sum() > _ODD * len(steps):
        return ""
    return f" but for row {int(odd.argmax()) + 2}" if odd.any() else "."


def _converts(unit: str, to: Sequence[str]) -> bool:
    for one in to:
        try:
            convert(1.0, unit, one)
        except ValueError:
            continue
        return True
    return False
