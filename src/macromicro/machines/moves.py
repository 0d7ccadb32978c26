"""Moves of several stages: straight lines, in turn or together, and trajectories by time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.machines import planning
from macromicro.machines.composite import IN_TURN, Composite, names, places
from macromicro.machines.planning import Schedule, Way
from macromicro.motion import s_curve
from macromicro.motion.path import MEET
from macromicro.place import Place
from macromicro.programme import entries
from macromicro.programme.moves import MAX_MOVES, WHAT
from macromicro.schema import csv_rows
from macromicro.schema.keys import unknown
from macromicro.schema.text import printable, read_text, read_toml
from macromicro.units import quantity

HOLD = "0.2 s"
SHARES = (0.1, 0.5, 0.9, 0.0)  # of the travel: the usual moves
_TIMES = {"t_s": 1.0, "t_ms": 1e3}  # in a second


class Move(NamedTuple):
    name: str  # line or trajectory
    end: tuple[float, ...]  # of each stage, m or rad
    hold: float  # s
    times: Array = np.empty((1, 0))  # of a trajectory: t (s), then each stage (m or rad)


class Course(NamedTuple):
    """A programme of a machine of several stages, one leg after the other from 0 of each on."""

    title: str
    legs: tuple[Any, ...]
    source: str


def usual(machine: Composite, settings: Any) -> Course:
    """There and back over most of each travel, all stages at once."""
    high = [own.travel.high for own in machine.trees(settings)]
    ends = [tuple(share * end for end in high) for share in SHARES]
    legs = tuple(Move("line", end, 0.3) for end in ends)
    return in_order(machine, Course("there and back", legs, "the machine's usual moves"))


def load(path: Path, machine: Composite, settings: Any) -> Course:
    """The programme in a file, within the travel of each stage."""
    file = printable(path, 300)
    if path.suffix.lower() == ".csv":
        if machine.order == IN_TURN:
            told = "a trajectory moves all stages at once, and those of this machine move in turn"
            raise ProblemError(file, told, 'Write moves, or a machine with order = "together".')
        table, held = trajectory(path, names(machine), places(machine)), quantity(HOLD, "s", file)
        first, last = (tuple(table[1:, k].tolist()) for k in (0, -1))
        legs = (Move("line", first, held), Move("trajectory", last, held, table))
        made = Course(printable(path.stem, 200), legs, str(path))
    else:
        made = _read_file(path, machine)
    for number, leg in enumerate(made.legs, 1):
        each = zip(names(machine), machine.trees(settings), places(machine), leg.end, strict=True)
        for name, own, place, end in each:
            low, high = own.travel.low, own.travel.high
            if not low - MEET <= end <= high + MEET:
                accepted = f"{place.told(low)} to {place.told(high)} ({name}.travel)"
                raise InputError(f"{file}, move {number}, {name}", place.told(end), accepted)
    return in_order(machine, made)


def in_order(machine: Composite, course: Course) -> Course:
    """A programme as its machine moves: stages in turn take a move each, and hold after the last.

    A stage that stays has no move, unless none moves.
    """
    if machine.order != IN_TURN:
        return course
    here: tuple[float, ...] = (0.0,) * len(machine.stages)
    legs = []
    for leg in course.legs:
        moving = [k for k, end in enumerate(leg.end) if end != here[k]]
        for k in moving:
            here = (*here[:k], leg.end[k], *here[k + 1 :])
            legs.append(leg._replace(end=here, hold=leg.hold if k == moving[-1] else 0.0))
        if not moving:
            legs.append(leg)
    return course._replace(legs=tuple(legs))


def _read_file(path: Path, machine: Composite) -> Course:
    raw, file = read_toml(path, WHAT), printable(path, 300)
    unknown(raw, ("title", "moves"), f"{file}, ")
    title = entries.title(raw, file) or printable(path.stem, 200)
    tables = entries.tables(raw, "moves", file, "one table [[moves]] or more")
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
        legs.append(Move("line", here, entries.rest(table, HOLD, where)))
    return Course(title, tuple(legs), str(path))


def _target(raw: object, place: Place, where: str) -> float:
    if not isinstance(raw, str):
        raise InputError(where, printable(raw), f"text with a unit such as '1.5 {place.unit}'")
    return quantity(raw, place.base, where, place.unit)


def trajectory(path: Path, stages: Sequence[str], places: Sequence[Place]) -> Array:
    """A table of positions by time: rows of times, from 0 s, and of each stage's positions."""
    file = printable(path, 300)
    units = [{p.base: 1.0, p.unit: p.per, p.fine: p.fines} for p in places]
    known = {
        f"{name}_{unit}": (k, per)
        for k, (name, each) in enumerate(zip(stages, units, strict=True), 1)
        for unit, per in each.items()
    } | {name: (0, per) for name, per in _TIMES.items()}
    accepted = _heading(stages, places)

    def header(cells: list[str], where: str) -> None:
        if sorted(known[c][0] if c in known else -1 for c in cells) != list(range(len(units) + 1)):
            given = printable(", ".join(cells), 80)
            raise ProblemError(where, f"columns {given}", f"Give {accepted}.")

    rows = list(csv_rows.table(read_text(path, WHAT), file, header, accepted))
    if len(rows) < 3:
        raise ProblemError(file, f"{len(rows)} rows", "A trajectory needs three or more.")
    values = np.empty((len(units) + 1, len(rows)))
    for column in sorted(rows[0].cells, key=lambda name: known[name][0]):
        k, per = known[column]
        numbers = [csv_rows.number(row.cells[column], f"{row.where}, {column}") for row in rows]
        values[k] = np.array(numbers) / per
    for k, row in enumerate(rows):
        csv_rows.increasing(values[0, k], values[0, k - 1] if k else -math.inf, row.where)
    values[0] -= values[0, 0]
    return values


def _heading(stages: Sequence[str], places: Sequence[Place]) -> str:
    """What the first line of a table may be."""
    first, alike = places[0], len(set(places)) == 1
    units = f" in {first.base}, {first.unit} or {first.fine}" if alike else ""
    such = ",".join(f"{n}_{place.unit}" for n, place in zip(stages, places, strict=True))
    names = f"{', '.join(stages[:-1])} and {stages[-1]}"
    return f"t_s or t_ms, then {names}{units}, such as t_s,{such}"


def plan(machine: Composite, settings: Any, programme: Course) -> Schedule:
    """The profiles of all stages, with the same times."""
    trees, where = machine.trees(settings), printable(programme.source, 300)
    here: tuple[float, ...] = (0.0,) * len(trees)
    ways: list[list[Way]] = [[] for _ in trees]
    for leg in programme.legs:
        pieces = _line(here, leg.end, trees) if leg.name == "line" else _trajectory_columns(leg)
        for each, own, end in zip(ways, pieces, leg.end, strict=True):
            each.append(Way(math.nan, end, leg.hold, own))
        here = leg.end
    for name, each, own in zip(names(machine), ways, trees, strict=True):
        planning.check(each, own, f"{where}, {name}")
    plans = tuple(planning.join(each, math.nan) for each in ways)
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


def _trajectory_columns(leg: Move) -> list[Array]:
    t, *places = leg.times
    return [planning.track(t, own).pieces for own in places]
