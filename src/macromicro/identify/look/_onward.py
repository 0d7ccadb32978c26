"""The next command for a file: the identification whose columns it has."""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.files.table import Table
from macromicro.identify.kinds import drive, hall, hysteresis, linear, sprung, stress, thermal
from macromicro.identify.picking import Role, T, matched
from macromicro.units import convert

_EVEN, _ODD = 0.05, 0.01  # a step this far off the median is odd; share of odd steps in a clock
_SMOOTHER = 3.0  # a position is so many times smoother than the effort that moves it


class Onward(NamedTuple):
    command: str  # to type
    reasons: tuple[str, ...]  # of the columns chosen


# Kind of identification, its roles, and those that a file must have for it; the first that fits.
_KINDS: tuple[tuple[str, Sequence[Role], str], ...] = (
    ("hysteresis", hysteresis.ROLES, "u f curve"),
    ("stress", stress.ROLES, "T x load"),
    ("drive", drive.ROLES, "t u x"),
    ("linear", linear.ROLES, "t u y"),
    ("thermal", (T, thermal.U, thermal.TEMPERATURE), "t u T"),
    ("hall", hall.ROLES, "v x"),
    ("plays", hysteresis.ROLES, "u f"),
)


def onward(table: Table, numbers: Mapping[str, Array]) -> Onward:
    for kind, roles, needed in _KINDS:
        found = matched(table._replace(columns=numbers), roles)
        clocked = math.isfinite(table.rate) and "t" not in found
        wanted = [role for role in needed.split() if role != "t" or not clocked]
        if all(role in found for role in wanted):
            columns = {role: found[role] for role in wanted}
            reasons = [f"{role}: {name}, by its name" for role, name in columns.items()]
            return _said(table, kind, roles, columns, reasons, named=True)
    columns, reasons = by_course(numbers, table.units, found_by_name(table, numbers))
    return _said(table, "drive", (*drive.ROLES, sprung.V), columns, reasons, named=False)


def found_by_name(table: Table, numbers: Mapping[str, Array]) -> dict[str, str]:
    """Roles of a drive found by name, if incomplete."""
    found = matched(table._replace(columns=numbers), drive.ROLES)
    return {role: found[role] for role in "tux" if role in found}


def by_course(
    numbers: Mapping[str, Array], units: Mapping[str, str], named: Mapping[str, str]
) -> tuple[dict[str, str], list[str]]:
    """Time, effort and position by units or by their shape, where names are not enough."""
    columns = {"t": "?", "u": "?", "x": "?"} | dict(named)
    reasons = [f"{role}: {name}, by its name" for role, name in named.items()]
    rest = {name: values for name, values in numbers.items() if name not in named.values()}
    for name, values in rest.items():
        if columns["t"] != "?":
            break
        steps = np.diff(values)
        if len(steps) < 2 or steps.min() <= 0.0:
            continue
        odd = np.abs(steps / np.median(steps) - 1.0) > _EVEN
        if odd.sum() <= _ODD * len(steps):
            columns["t"] = name
            but = f" but for row {int(odd.argmax()) + 2}" if odd.any() else ""
            reasons.append(f"t: {name}, which rises in even steps{but}")
            del rest[name]
            break
    for role in (drive.U, drive.X, sprung.V):
        fits = [name for name in rest if _converts(units.get(name, ""), role.units)]
        open_ = columns["x" if role is sprung.V else role.name] == "?"
        if open_ and len(fits) == 1:
            columns[role.name] = fits[0]
            reasons.append(f"{role.name}: {fits[0]}, the only one in {units[fits[0]]} or similar")
            del rest[fits[0]]
    if "v" in columns:  # a speed does for a position
        del columns["x"]
    if columns["u"] != "?" or columns.get("x") != "?":
        return columns, reasons
    rough = {n: _roughness(v) for n, v in rest.items() if len(v) > 2 and np.ptp(v) > 0.0}
    if len(rough) == 2:
        smooth, other = sorted(rough, key=lambda n: rough[n])
        if rough[other] > _SMOOTHER * rough[smooth]:
            columns |= {"u": other, "x": smooth}
            reasons.append(f"x: {smooth}, which is smoother than {other}")
    return columns, reasons


def _converts(unit: str, to: Sequence[str]) -> bool:
    for one in to:
        try:
            convert(1.0, unit, one)
        except ValueError:
            continue
        return True
    return False


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
    """The command, with columns that it would not find itself or that lack a unit."""
    pairs = []
    timed = columns.get("t") != "?"
    if not timed:
        columns = {role: name for role, name in columns.items() if role != "t"}
        reasons.append("t: no column holds times; put the rows per second for HZ")
    for role in roles:
        name = columns.get(role.name, "")
        if not name:
            continue
        free = name == "?" or role.name == "t" or not role.units
        bare = not free and not table.units.get(name)
        if bare:
            reasons.append(f"{role.name}: the unit is unknown; name it, such as {role.units[0]}")
        if bare or not named:
            pairs.append(f"{role.name}={name}" + (f":{role.units[0]}" if bare else ""))
    words = ["macromicro", "identify", kind, table.file]
    if not timed:
        words += ["--rate", "HZ"]
    if pairs:
        words += ["--columns", ",".join(pairs)]
    return Onward(shlex.join(words), tuple(reasons))
