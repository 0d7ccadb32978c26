"""Files and columns for an identification."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from macromicro.errors import ProblemError
from macromicro.files.reading import is_forc, read
from macromicro.files.table import Table
from macromicro.identify.picking import Picked, Role, T, chosen, pick
from macromicro.schema.text import printable

_MOST = 500


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
    return Picking(there(files), chosen(pairs))


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


def loaded(what: Picking, roles: Sequence[Role]) -> list[Picked]:
    if what.join:
        return [joined([read(file) for file in what.files], roles, what.columns)]
    tables = []
    for file in what.files:
        if is_forc(file):
            raise ProblemError(
                printable(file, 300),
                "the file holds first-order reversal curves (MicroMag)",
                "Give a file of columns, or use `identify hysteresis`.",
            )
        tables.append(pick(read(file), roles, what.columns))
    for table in tables[1:]:
        alike(table, tables[0].units, tables[0].file)
    return tables


def joined(tables: Sequence[Table], roles: Sequence[Role], columns: Mapping[str, str]) -> Picked:
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
