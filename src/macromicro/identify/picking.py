"""Columns by role from a file, with units converted."""

# Rows that are not finite are left out with a warning, saturated sensors found, and records cut
# where the column `run` changes.

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.files.naming import TIMES, by_name, last, split_unit
from macromicro.files.reading import is_forc, read_table
from macromicro.files.table import Table
from macromicro.identify.notices import DataWarning, SaturationWarning, notice
from macromicro.identify.records import steps
from macromicro.identify.runs import Run, checked
from macromicro.schema.text import printable
from macromicro.units import measured

_SHORTEST = 20  # rows of a run behind a gap
# Of a temperature: the size of a degree and its zero, which differences do not have.
DEGREES = {"K": (1.0, 273.15), "degF": (5.0 / 9.0, 32.0), "°F": (5.0 / 9.0, 32.0)}
CLOCK = "\0"  # in place of a column of times: row by row at a rate
_MOST = 500


class MissingRowsWarning(DataWarning):
    """Rows with missing or infinite numbers were left out."""


class UnitWarning(DataWarning):
    """A column without a unit; the usual one was assumed."""


class Role(NamedTuple):
    name: str  # short, such as "u"
    meaning: str  # meaning in words
    # column names that are taken for it, best first, as `naming.plain` has them
    names: tuple[str, ...]
    # it is converted to the first that fits; without units it stays as it is
    units: tuple[str, ...] = ()
    optional: bool = False


class Picked(NamedTuple):
    file: str  # name, for messages
    values: dict[str, Array]  # shape (n,) by role, finite
    units: dict[str, str]  # by role
    names: dict[str, str]  # names in the file, by role
    constants: dict[str, float]  # constants of the file, by name


T = Role("t", "time", TIMES, ("s",))
RUN = Role("run", "which run a row belongs to", ("run", "record", "trial"), optional=True)


def parse_pairs(pairs: Sequence[str]) -> dict[str, str]:
    found: dict[str, str] = {}
    for pair in (part for text in pairs for part in text.split(",") if part.strip()):
        role, _, column = (piece.strip() for piece in pair.partition("="))
        if not role or not column:
            accepted = "name=column, such as x=position_mm"
            raise InputError("--columns", printable(pair), accepted)
        found[role] = column
    return found


def pick(table: Table, roles: Sequence[Role], requested: Mapping[str, str]) -> Picked:
    names = ", ".join(r.name for r in roles)
    for role_name in requested:
        if role_name not in {r.name for r in roles}:
            raise InputError("--columns", printable(role_name), f"one of {names}")
    found: dict[str, Array] = {}
    units: dict[str, str] = {}
    named: dict[str, str] = {}
    taken = {r.name: _column(table, r, requested[r.name]) for r in roles if r.name in requested}
    for role in roles:
        if role.name not in taken:
            used = {name for name, _ in taken.values()}
            taken[role.name] = _column(table, role, None, used)
    # In one go: a long file is parsed once, and only where its columns are needed.
    wanted = [name for name, _ in taken.values() if name and name != CLOCK]
    columns = table.several(list(dict.fromkeys(wanted)))
    table.forget()
    for role in roles:
        name, unit = taken[role.name]
        if not name:
            continue
        if name == CLOCK:
            rows = max(map(len, columns.values()), default=0)
            found[role.name], units[role.name] = np.arange(rows) / float(unit), "s"
            named[role.name] = f"{unit} Hz"
            continue
        found[role.name], units[role.name] = _convert(table, role, name, unit, columns[name])
        named[role.name] = name
    lengths = {role: len(v) for role, v in found.items()}
    if len(set(lengths.values())) > 1:
        remedy = "Choose columns of one length."
        raise ProblemError(table.file, f"the columns differ in length ({lengths} rows)", remedy)
    return Picked(table.file, _finite(table.file, found), units, named, table.constants)


def match_columns(table: Table, roles: Sequence[Role]) -> dict[str, str]:
    """Columns recognised by name; reads nothing."""
    found: dict[str, str] = {}
    for role in roles:
        name, _ = _column(table, role._replace(optional=True), None, found.values())
        if name:
            found[role.name] = name
    return found


def _column(
    table: Table, role: Role, requested: str | None, used: Collection[str] = ()
) -> tuple[str, str]:
    """Name and unit of the column for a role; no name for a missing optional one."""
    if requested is not None:
        if (
            role.names == TIMES
            and requested not in table.columns
            and (per_second := hertz(requested))
        ):
            return CLOCK, f"{per_second:.17g}"
        name, mark, unit = requested.rpartition(":")
        if not mark or requested in table.columns:
            name, unit = requested, ""
        if name in table.columns:
            return name, unit or table.units[name]
        near = [
            n for n in table.columns if name in (split_unit(n)[0], split_unit(last(n))[0], last(n))
        ]
        if len(near) == 1:
            return near[0], unit or table.units[near[0]]
        raise InputError(
            f"{table.file}, --columns {role.name}", printable(name), _list_columns(table)
        )
    numbers = [n for n in table.columns if n not in (*used, *table.words, *table.doubtful)]
    found = by_name(numbers, role.names) or by_name(
        [n for n in table.columns if n not in used], role.names
    )
    if not found and role.names == TIMES:
        found = table.times(used)
    if found:
        return found, table.units[found]
    if role.optional:
        return "", ""
    if role.names == TIMES and math.isfinite(table.rate):
        text = f"no column of times; the {table.rate:g} Hz of its header are taken"
        notice(UnitWarning, f"{table.file}: {text}")
        return CLOCK, f"{table.rate:.17g}"
    clock = " or give the rows per second with --rate HZ" if role.names == TIMES else ""
    raise ProblemError(
        table.file,
        f"there is no column for {role.name} ({role.meaning})",
        f"Name one with --columns {role.name}=COLUMN{clock}. Columns: {_names(table)}. "
        "`macromicro look` suggests columns by their data."
        + (f" Note: {table.note}." if table.note else ""),
    )


def hertz(text: str) -> float:
    """Rows per second from a text such as "200 Hz"; 0 for another text."""
    try:
        value, _ = measured(text, ("Hz",), "t")
    except InputError:
        return 0.0
    return value if value > 0.0 else 0.0


def _list_columns(table: Table) -> str:
    return f"one of its columns: {_names(table)}"


def _names(table: Table) -> str:
    return ", ".join(printable(name) for name in table.columns)


def _convert(table: Table, role: Role, name: str, unit: str, values: Array) -> tuple[Array, str]:
    """The column in the first unit of the role that its own converts to."""
    from macromicro.units import convert

    if not role.units:
        return values, unit
    if not unit:
        if len(role.units) > 1:
            return values, ""
        if role.units[0] != "s":
            text = f"{table.file}: {printable(name)} has no unit; taken as {role.units[0]}"
            notice(UnitWarning, text)
        return values, role.units[0]
    if "degC" in role.units and unit in DEGREES:
        size, zero = DEGREES[unit]
        return (values - zero) * size, "degC"
    for to in role.units:
        try:
            factor = convert(1.0, unit, to)
        except ValueError:
            continue
        # Counts and degC are their own base, so a factor does for all of them.
        return values if factor == 1.0 else values * factor, to
    accepted = " or ".join(role.units)
    raise InputError(f"{table.file}, {printable(name)}", printable(unit) or "no unit", accepted)


def _finite(file: str, found: dict[str, Array]) -> dict[str, Array]:
    good = np.logical_and.reduce([np.isfinite(v) for v in found.values()])
    bad = np.flatnonzero(~good)
    if not len(bad):
        return found
    if len(bad) == len(good):
        remedy = "Repair these columns or choose others."
        raise ProblemError(file, "every row has a missing number", remedy)
    text = f"{file}: {len(bad)} of {len(good)} rows not finite, the first is row {bad[0] + 1}"
    notice(MissingRowsWarning, f"{text}; left out")
    return {role: v[good] for role, v in found.items()}


def runs(picked: Picked) -> list[dict[str, Array]]:
    """Columns cut where the role "run" changes, where rows are missing, and where time restarts."""
    values = dict(picked.values)
    run = values.pop("run", None)
    changes = np.flatnonzero(np.diff(run)) + 1 if run is not None else np.empty(0, np.int64)
    breaks = _breaks(picked.file, values["t"], run) if "t" in values else changes[:0]
    cuts = np.union1d(changes, breaks).astype(np.int64)
    parts = {role: np.split(v, cuts) for role, v in values.items()}
    found = [{role: v[k] for role, v in parts.items()} for k in range(len(cuts) + 1)]
    if not len(breaks):
        return found
    long = [part for part in found if len(part["t"]) >= _SHORTEST]
    return long or found


def even_runs(table: Picked, output: str, least: int = 20) -> list[Run]:
    """Evenly sampled runs of an output and its input, which is 0 where there is none."""
    found = []
    for part in runs(table):
        find_saturated(part[output], f"{table.file}, {output}")
        u = part.get("u", np.zeros(len(part["t"])))
        found.append(checked(part["t"], u, part[output], table.file, least))
    return found


def _breaks(file: str, t: Array, run: Array | None) -> npt.NDArray[np.int64]:
    """Rows at which a record goes on after a gap or restarts, with a warning."""
    sizes, _, gaps, falls = steps(t, run)
    found = np.union1d(gaps, falls)
    if not len(found) or (len(found) + 1) * _SHORTEST > len(t):  # no time at all, or a broken one
        return found[:0]
    first = int(found[0])
    what = f"a gap of {sizes[first]:.6g} s" if sizes[first] > 0.0 else "time restarts"
    more = f" and {len(found) - 1} more" if len(found) > 1 else ""
    notice(
        MissingRowsWarning,
        f"{file}: {what} after {t[first]:.6g} s (row {first + 1}){more}: the record is cut there "
        f"into runs, and those of fewer than {_SHORTEST} rows are left out",
    )
    return found + 1


def find_saturated(
    values: Array, where: str, done: str = "nothing was changed"
) -> npt.NDArray[np.bool_]:
    """Samples at which a sensor saturates (`SaturationWarning`)."""
    # The signal changes from sample to sample elsewhere, yet repeats its extreme in runs of 5 or
    # more, 1 % of the record in all, and enters and leaves at its usual pace; an axis at rest does
    # so slowly, and rests in other places too.
    ends = np.zeros(len(values), dtype=np.bool_)
    if len(values) < 20:
        return ends
    paces = np.abs(np.diff(values))
    repeats = _held_samples(paces == 0.0)
    within = (values > values.min()) & (values < values.max())
    elsewhere = int((repeats & within).sum())
    moving = paces[within[1:] & within[:-1]]
    usual = float(np.median(moving)) if len(moving) else 0.0
    for extreme in (values.min(), values.max()):
        at = values == extreme
        held = repeats & at
        if held.sum() < max(0.01 * len(values), 5) or elsewhere > 0.1 * held.sum():
            continue
        # The second step of each stay away: the first one is cut by the rail.
        away = _held_samples(~at[1:] & ~at[:-1])
        edges = np.diff(away.astype(np.int8))
        begin, end = np.flatnonzero(edges > 0) + 1, np.flatnonzero(edges < 0)
        beyond = np.r_[paces[begin], paces[end - 1]]
        if not len(beyond) or usual <= 0.0 or float(np.mean(beyond)) < 0.3 * usual:
            continue
        ends |= at
        notice(
            SaturationWarning,
            f"{where}: {int(at.sum())} of {len(values)} samples stay at {extreme:g}, as those "
            f"of a saturated sensor do; {done}",
        )
    if ends.mean() > 0.5:
        found = f"the sensor is saturated in {int(ends.sum())} of {len(ends)} samples"
        raise ProblemError(where, found, "Record within the sensor's range.")
    return ends


def _held_samples(same: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    run = np.convolve(same, np.ones(4), "valid") == 4.0
    held = np.zeros(len(same) + 1, dtype=np.bool_)
    for k in range(5):
        held[k : k + len(run)] |= run
    return held


class Picking(NamedTuple):
    files: list[Path]  # to read
    columns: dict[str, str]  # role to the name of a column
    join: bool = False  # the files are one record, with a clock each


def picking(arguments: Sequence[str], columns: Sequence[str]) -> Picking:
    """Files and columns of a command line; accepts ``--columns t=time u=volts FILE``."""
    files, pairs = [], list(columns)
    for argument in arguments:
        place = Path(argument)
        if "=" in argument and columns and not _there(place):
            pairs.append(argument)
        else:
            files.append(place)
    return Picking(there(files), parse_pairs(pairs))


def there(names: Sequence[str | Path]) -> list[Path]:
    if not names:
        raise ProblemError("FILE", "no file is given", "Name one or more to identify from.")
    if len(names) > _MOST:
        found = f"{len(names)} files were given"
        raise ProblemError("FILE", found, f"At most {_MOST} can be read at once.")
    for name in names:
        if "\0" in str(name) or not _there(Path(name)):
            raise ProblemError(printable(name, 300), "no such file", "Check the path.")
    return [Path(name) for name in names]


def _there(path: Path) -> bool:
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def load(what: Picking, roles: Sequence[Role]) -> list[Picked]:
    if what.join:
        return [join_files([read_table(file) for file in what.files], roles, what.columns)]
    tables = []
    for file in what.files:
        if is_forc(file):
            problem = "the file holds first-order reversal curves (MicroMag)"
            remedy = "Give a file of columns, or use `identify hysteresis`."
            raise ProblemError(printable(file, 300), problem, remedy)
        tables.append(pick(read_table(file), roles, what.columns))
    for table in tables[1:]:
        alike(table, tables[0].units, tables[0].file)
    return tables


def join_files(
    tables: Sequence[Table], roles: Sequence[Role], columns: Mapping[str, str]
) -> Picked:
    """One record of several files on the slowest clock."""
    # The input is averaged over each step, since it acts over all of it; others are interpolated.
    loose = [role if role is T else role._replace(optional=True) for role in roles]
    parts = [
        pick(table, loose, {r: c for r, c in columns.items() if r == T.name or c in table.columns})
        for table in tables
    ]
    steps = [float(np.median(np.diff(part.values["t"]))) for part in parts]
    slow, dt = parts[int(np.argmax(steps))], max(steps)
    begin, end = (
        max(part.values["t"][0] for part in parts),
        min(part.values["t"][-1] + step for part, step in zip(parts, steps, strict=True)),
    )
    at = slow.values["t"]
    at = at[(at >= begin) & (at + dt <= end + 0.5 * min(steps))]
    found, units, names = {"t": at}, {"t": "s"}, {"t": slow.names["t"]}
    for part in parts:
        t = part.values["t"]
        edges = np.searchsorted(t, np.r_[at, at[-1:] + dt] - 1e-6 * dt)
        for role, values in part.values.items():
            if role in found:
                continue
            units[role], names[role] = part.units[role], part.names[role]
            if role == "u" and part is not slow:
                total = np.r_[0.0, np.cumsum(values)]
                found[role] = np.diff(total[edges]) / np.diff(edges)
            else:
                found[role] = np.interp(at, t, values)
    file = " and ".join(part.file for part in parts)
    lacking = [role for role in roles if not role.optional and role.name not in found]
    if lacking or not len(at):
        problem = f"there is no column for {lacking[0].name}" if lacking else "no time is shared"
        raise ProblemError(file, problem, "Join files of one record, with a column of times each.")
    return Picked(file, found, units, names, parts[0].constants)


def alike(table: Picked, units: Mapping[str, str], first: str) -> None:
    """Reject a file whose units differ; a missing column has none."""
    for name, unit in units.items():
        if (own := table.units.get(name, unit)) != unit:
            found = f"{name} is in {own or 'no unit'}, in {first} in {unit or 'no unit'}"
            raise ProblemError(table.file, found, "Give files with the same units.")
