"""Which command goes on with a file: the kind of identification whose columns it has."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.files.table import Table
from macromicro.identify.kinds import drive, hall, hysteresis, linear, thermal
from macromicro.identify.picking import Role, matched

_SMOOTHER = 3.0  # a position is so many times smoother than the effort that moves it


class Onward(NamedTuple):
    """What to go on with.

    Attributes
    ----------
    command : str
        To type.
    reasons : tuple[str, ...]
        Which column was taken for what, and why, in words.
    """

    command: str
    reasons: tuple[str, ...]


# Kind of identification, its roles, and those that a file must have for it; the first that fits.
_KINDS: tuple[tuple[str, Sequence[Role], str], ...] = (
    ("hysteresis", hysteresis.ROLES, "u f curve"),
    ("drive", drive.ROLES, "t u x"),
    ("linear", linear.ROLES, "t u y"),
    ("thermal", (thermal.T, thermal.U, thermal.TEMPERATURE), "t u T"),
    ("hall", hall.ROLES, "v x"),
    ("plays", hysteresis.ROLES, "u f"),
)


def onward(table: Table, numbers: Mapping[str, Array]) -> Onward:
    """The command that goes on with a file.

    Parameters
    ----------
    table : Table
        Of the file.
    numbers : Mapping[str, Array]
        Its columns of numbers.

    Returns
    -------
    Onward
        Command and reasons; roles that nothing fits are left open as "?".
    """
    for kind, roles, needed in _KINDS:
        found = matched(table._replace(columns=numbers), roles)
        if all(role in found for role in needed.split()):
            columns = {role: found[role] for role in needed.split()}
            reasons = [f"{role}: {name}, by its name" for role, name in columns.items()]
            return _said(table, kind, roles, columns, reasons, named=True)
    columns, reasons = by_course(numbers)
    return _said(table, "drive", drive.ROLES, columns, reasons, named=False)


def by_course(numbers: Mapping[str, Array]) -> tuple[dict[str, str], list[str]]:
    """Time, effort and position by the course of columns whose names say nothing.

    Parameters
    ----------
    numbers : Mapping[str, Array]
        Columns of numbers.

    Returns
    -------
    columns : dict[str, str]
        Column by role, "?" where nothing fits.
    reasons : list[str]
        Why, in words.
    """
    columns, reasons = {"t": "?", "u": "?", "x": "?"}, []
    rest = dict(numbers)
    for name, values in numbers.items():
        steps = np.diff(values)
        if len(steps) > 1 and steps.min() > 0.0 and np.ptp(steps) < 0.1 * steps.mean():
            columns["t"] = name
            reasons.append(f"t: {name}, which rises by even steps")
            del rest[name]
            break
    rough = {n: _roughness(v) for n, v in rest.items() if len(v) > 2 and np.ptp(v) > 0.0}
    if len(rough) == 2:
        smooth, other = sorted(rough, key=lambda n: rough[n])
        if rough[other] > _SMOOTHER * rough[smooth]:
            columns |= {"u": other, "x": smooth}
            reasons.append(f"x: {smooth}, which is smoother than {other}")
    return columns, reasons


def _roughness(values: Array) -> float:
    return float(np.std(np.diff(values)) / np.std(values))


def _said(
    table: Table,
    kind: str,
    roles: Sequence[Role],
    columns: dict[str, str],
    reasons: list[str],
    *,
    named: bool,
) -> Onward:
    """The command, with the columns where it would not find them itself or lacks a unit."""
    pairs = []
    for role in roles:
        name = columns.get(role.name, "")
        if not name:
            continue
        free = name == "?" or role.name == "t" or not role.units
        bare = not free and not table.units.get(name)
        if bare:
            reasons.append(f"{role.name}: no unit is named; say it, as {role.units[0]}")
        if bare or not named:
            pairs.append(f"{role.name}={name}" + (f":{role.units[0]}" if bare else ""))
    words = ["macromicro", "identify", kind, table.file]
    if pairs:
        words += ["--columns", ",".join(pairs)]
    return Onward(shlex.join(words), tuple(reasons))
