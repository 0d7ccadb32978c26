"""The files that an identification was given, and the columns in them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from macromicro.errors import InputError
from macromicro.files.reading import is_forc, read
from macromicro.identify.picking import Picked, Role, chosen, pick
from macromicro.schema.text import printable

_MOST = 500


class Picking(NamedTuple):
    """What a command line names.

    Attributes
    ----------
    files : list[Path]
        To read.
    columns : dict[str, str]
        Role to the name of a column.
    """

    files: list[Path]
    columns: dict[str, str]


def picking(arguments: Sequence[str], columns: Sequence[str]) -> Picking:
    """Files and columns of a command line.

    ``--columns t=time u=volts FILE`` is understood too: an argument name=column that is no file
    counts as one more column.

    Parameters
    ----------
    arguments : Sequence[str]
        Files.
    columns : Sequence[str]
        What ``--columns`` gave, each time.

    Returns
    -------
    Picking
        Files that are there, and role to column.

    Raises
    ------
    InputError
        No file, too many, one that is not there, or a slip in the columns.
    """
    files, pairs = [], list(columns)
    for argument in arguments:
        place = Path(argument)
        if "=" in argument and columns and not _there(place):
            pairs.append(argument)
        else:
            files.append(place)
    return Picking(there(files), chosen(pairs))


def there(names: Sequence[str | Path]) -> list[Path]:
    """The files of some names.

    Parameters
    ----------
    names : Sequence[str | Path]
        Paths.

    Returns
    -------
    list[Path]
        As paths.

    Raises
    ------
    InputError
        No name, too many, or a file that is not there.
    """
    if not names:
        raise InputError("FILE", "none", "one file or more to identify from")
    if len(names) > _MOST:
        raise InputError("FILE", f"{len(names)} files", f"at most {_MOST}")
    for name in names:
        if "\0" in str(name) or not _there(Path(name)):
            raise InputError(printable(name, 300), "no such file", "a file that is there")
    return [Path(name) for name in names]


def _there(path: Path) -> bool:
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def loaded(what: Picking, roles: Sequence[Role]) -> list[Picked]:
    """The columns of all files, which must agree in their units.

    Parameters
    ----------
    what : Picking
        Files and columns.
    roles : Sequence[Role]
        What the kind needs.

    Returns
    -------
    list[Picked]
        One per file.

    Raises
    ------
    InputError
        A file cannot be read, a column is missing, or units differ.
    """
    tables = []
    for file in what.files:
        if is_forc(file):
            raise InputError(
                printable(file, 300),
                "first-order reversal curves (MicroMag)",
                "a file of columns; such curves are for `identify hysteresis`",
            )
        tables.append(pick(read(file), roles, what.columns))
    for table in tables[1:]:
        alike(table, tables[0])
    return tables


def alike(table: Picked, first: Picked) -> None:
    """Refuse a file whose units are not another's; a column that one of them lacks has none.

    Parameters
    ----------
    table : Picked
        Columns of the file.
    first : Picked
        Of the other one.

    Raises
    ------
    InputError
        A column of both has two units.
    """
    shared = [name for name in first.units if name in table.units]
    own, others = ({n: each.units[n] for n in shared} for each in (table, first))
    if own != others:
        raise InputError(table.file, f"units {own}", f"those of {first.file}: {others}")
