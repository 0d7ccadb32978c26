"""Moves of several stages that begin and end together: straight lines, and trajectories by time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.machines import planning
from macromicro.machines.composite import Composite, names
from macromicro.machines.planning import Schedule, Way
from macromicro.motion import s_curve
from macromicro.place import Place
from macromicro.programme.entries import hold, text
from macromicro.programme.moves import MAX_MOVES, MAX_TITLE, WHAT
from macromicro.schema import csv_rows
from macromicro.schema.keys import found, unknown
from macromicro.schema.text import printable, read_text, read_toml
from macromicro.units import convert, quantity

HOLD = "0.2 s"
SHARES = (0.1, 0.5, 0.9, 0.0)  # of the travel: the usual moves
_TIMES = {"t_s": 1.0, "t_ms": 1e-3}


class Move(NamedTuple):
    name: str  # line or trajectory
    end: tuple[float, ...]  # of each stage, m or rad
    hold: float  # s
    times: Array = np.empty(0)  # s; of a trajectory
    places: Array = np.empty((0, 0))  # of each stage at these times


class Moves(NamedTuple):
    """A programme of a machine of several stages, from 0 of each on."""

    title: str
    legs: tuple[Move, ...]
    source: str


def places(machine: Composite) -> list[Place]:
    return [one.kind.place for _, one in machine.stages]


def usual(machine: Composite, settings: Any) -> Moves:
    """There and back over most of each travel, all stages at once."""
    high = [own.travel.high for own in machine.trees(settings)]
    ends = [tuple(share * end for end in high) for share in SHARES]
    legs = tuple(Move("line", end, 0.3) for end in ends)
    return Moves("there and back", legs, "the machine's usual moves")


def load(path: Path, machine: Composite, settings: Any) -> Moves:
    """The programme in a file, within the travel of each stage."""
    file = printable(path, 300)
    if path.suffix.lower() == ".csv":
        made = Moves(printable(path.stem, 200), _trajectory(path, machine), str(path))
    else:
        made = _written(path, machine)
    for number, leg in enumerate(made.legs, 1):
        each = zip(names(machine), machine.trees(settings), places(machine), leg.end, strict=True)
        for name, own, place, end in each:
            low, high = own.travel.low, own.travel.high
            if not low <= end <= high:
                accepted = f"{place.told(low)} to {place.told(high)} ({name}.travel)"
                raise InputError(f"{file}, move {number}, {name}", place.told(end), accepted)
    return made


def _written(path: Path, machine: Composite) -> Moves:
    raw, file = read_toml(path, WHAT), printable(path, 300)
    unknown(raw, ("title", "moves"), f"{file}, ")
    title = raw.get("title", "")
    if not isinstance(title, str) or not title.isprintable() or len(title) > MAX_TITLE:
        accepted = f"one line of text of at most {MAX_TITLE} characters"
        raise InputError(f"{file}, title", printable(title), accepted)
    tables = raw.get("moves")
    if not isinstance(tables, list) or not tables or not all(isinstance(t, dict) for t in tables):
        raise InputError(f"{file}, moves", found(tables), "one table [[moves]] or more")
    if len(tables) > MAX_MOVES:
        raise ProblemError(file, f"more than {MAX_MOVES} moves", "Shorten the programme.")
    stages = names(machine)
    legs, here = [], (0.0,) * len(stages)
    for number, table in enumerate(tables, 1):
        where = f"{file}, move {number}"
        unknown(table, (*stages, "hold"), f"{where}, ")
        if not set(table) & set(stages):
            raise ProblemError(where, "no target", f"Give one of {', '.join(stages)}, or several.")
        here = tuple(
            _target(table[name], place, f"{where}, {name}") if name in table else at
            for name, place, at in zip(stages, places(machine), here, strict=True)
        )
        held = hold(text({"hold": HOLD} | table, "hold", where), f"{where}, hold", zero=True)
        legs.append(Move("line", here, held))
    return Moves(title or printable(path.stem, 200), tuple(legs), str(path))


def _target(raw: object, place: Place, where: str) -> float:
    if not isinstance(raw, str):
        raise InputError(where, printable(raw), f"text with a unit such as '1.5 {place.unit}'")
    return quantity(raw, place.base, where, place.unit)


def _trajectory(path: Path, machine: Composite) -> tuple[Move, ...]:
    """A line to the first point of a table, then its points by time."""
    file = printable(path, 300)
    units = [(place.base, place.unit, place.fine) for place in places(machine)]
    stages = names(machine)
    columns = ", ".join(f"{n}_{unit[1]}" for n, unit in zip(stages, units, strict=True))
    accepted = f"t_s or t_ms, then {columns}"

    def header(cells: list[str], where: str) -> None:
        there = [name for name, _, _ in (cell.rpartition("_") for cell in cells)]
        if sorted(there) != sorted(("t", *stages)):
            given = printable(", ".join(cells), 80)
            raise ProblemError(where, f"columns {given}", f"Give {accepted}.")

    rows = list(csv_rows.table(read_text(path, WHAT), file, header, accepted))
    if len(rows) < 3:
        raise ProblemError(file, f"{len(rows)} rows", "A trajectory needs three or more.")
    known = {cell.rpartition("_")[0]: cell for cell in rows[0].cells}
    scales = {known["t"]: _TIMES.get(known["t"])}
    for name, unit in zip(stages, units, strict=True):
        _, _, written = known[name].rpartition("_")
        scales[known[name]] = convert(1.0, written, unit[0]) if written in unit else None
    for column, scale in scales.items():
        if scale is None:
            raise InputError(f"{file}, column {printable(column, 40)}", "its unit", accepted)
    values = {
        column: np.array(
            [csv_rows.number(row.cells[column], f"{row.where}, {column}") for row in rows]
        )
        * scale
        for column, scale in scales.items()
    }
    t = values[known["t"]]
    for k, row in enumerate(rows):
        csv_rows.increasing(t[k], t[k - 1] if k else -math.inf, row.where)
    points = np.array([values[known[name]] for name in stages])
    first, last = (tuple(points[:, k].tolist()) for k in (0, -1))
    held = quantity(HOLD, "s", file)
    return Move("line", first, held), Move("trajectory", last, held, t - t[0], points)


def plan(machine: Composite, settings: Any, programme: Moves) -> Schedule:
    """The profiles of all stages, with the same times."""
    trees, where = machine.trees(settings), printable(programme.source, 300)
    here: tuple[float, ...] = (0.0,) * len(trees)
    ways: list[list[Way]] = [[] for _ in trees]
    for leg in programme.legs:
        pieces = _line(here, leg.end, trees) if leg.name == "line" else _tracked(leg)
        for each, own, end in zip(ways, pieces, leg.end, strict=True):
            each.append(Way(math.nan, end, leg.hold, own))
        here = leg.end
    for name, each, own in zip(names(machine), ways, trees, strict=True):
        planning.check(each, own, f"{where}, {name}")
    plans = tuple(planning.joined(each, math.nan) for each in ways)
    return Schedule(plans, programme.legs)


def _line(here: Sequence[float], end: Sequence[float], trees: Sequence[Any]) -> list[Array]:
    """The quickest straight line within the limits of every stage, as pieces of each."""
    far = [b - a for a, b in zip(here, end, strict=True)]
    limits = [
        [limit / abs(distance) for limit in own.motion]
        for own, distance in zip(trees, far, strict=True)
        if distance != 0.0
    ]
    if not limits:
        return [np.empty((0, 5)) for _ in trees]
    profile = s_curve(1.0, *(min(each) for each in zip(*limits, strict=True)))  # of its share
    share = np.array(profile.segments).reshape(-1, 5)
    made = []
    for begin, distance in zip(here, far, strict=True):
        pieces = share * np.array([1.0, *(distance,) * 4])
        pieces[:, 1] += begin
        made.append(pieces)
    return made


def _tracked(leg: Move) -> list[Array]:
    return [planning.track(leg.times, own).pieces for own in leg.places]
