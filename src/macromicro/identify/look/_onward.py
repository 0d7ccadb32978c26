"""The next command for a file: the identification whose columns it has."""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.files.table import Table
from macromicro.identify.kinds import drive, hall, hysteresis, linear, stress, thermal
from macromicro.identify.picking import DEGREES, Role, T, matched
from macromicro.units import convert

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
        found = matched(known, roles)
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
    found = matched(table, (T, linear.U))
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
        if (name := matched(table, (role,)).get(role.name, ""))
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
