"""Files and columns for an identification."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from macromicro.errors import ProblemError
from macromicro.files.reading import is_forc, read
from macromicro.identify.picking import Picked, Role, chosen, pick
from macromicro.schema.text import printable

_MOST = 500


class Picking(NamedTuple):
    files: list[Path]  # to read
    columns: dict[str, str]  # role to the name of a column


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


def alike(table: Picked, units: Mapping[str, str], first: str) -> None:
    """Reject a file whose units differ; a missing column has none."""
    for name, unit in units.items():
        if (own := table.units.get(name, unit)) != unit:
            found = f"{name} is in {own or 'no unit'}, in {first} in {unit or 'no unit'}"
            raise ProblemError(table.file, found, "Give files with the same units.")
