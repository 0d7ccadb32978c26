"""Programmes of two axes: moves, lines and arcs (TOML), trajectories (CSV)."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.machines.joint.settings import AXES
from macromicro.machines.moves import Course, trajectory
from macromicro.motion import path as paths
from macromicro.motion.path import Piece
from macromicro.place import LENGTH
from macromicro.programme import entries
from macromicro.programme.moves import MAX_MOVES, WHAT
from macromicro.schema.keys import only, show_value, unknown
from macromicro.schema.text import printable, read_toml
from macromicro.units import quantity

HOLD = "0.2 s"
STOP, ROUND = "stop", "round"
_KEYS = ("title", "moves", "paths")
_MOVE = ("x", "y", "speed", "hold")
_ARC = ("centre", "angle", "speed", "hold", "on")
_THROUGH = ("points", "rounding", "corners", "speed", "hold", "on")
_LINE = (*_MOVE, "on")
_TANGENT = 1e-6  # rad
_TABLES = "one table [[moves]] or more, or of [[paths]]"

Point = tuple[float, float]


class Leg(NamedTuple):
    """One move, from rest to rest, along a smooth path or by times."""

    name: str  # for people: line, arc, path or trajectory
    pieces: tuple[Piece, ...]  # of the path; none for one by times, and for one that stays
    speeds: tuple[float, ...]  # greatest speed of each piece, m/s; infinity: no own limit
    end: Point  # m
    hold: float  # s
    times: Array = np.empty((3, 0))  # t (s), x and y (m) of a trajectory; n is 0 for a path


def load(path: Path) -> Course:
    if path.suffix.lower() == ".csv":
        return _table(path)
    raw, file = read_toml(path, WHAT), printable(path, 300)
    unknown(raw, _KEYS, f"{file}, ")
    title = entries.title(raw, file) or printable(path.stem, 200)
    if "moves" in raw and "paths" in raw:
        remedy = "Use one of them, because TOML keeps no order; a path may be a line, too."
        raise ProblemError(file, "both moves and paths are given", remedy)
    key = "paths" if "paths" in raw else "moves"
    tables = entries.tables(raw, key, file, _TABLES)
    return Course(title, tuple(_legs(tables, key[:-1], file)), str(path))


def _legs(tables: list[dict[str, Any]], word: str, file: str) -> list[Leg]:
    legs: list[Leg] = []
    here: Point = (0.0, 0.0)
    open_leg: Leg | None = None  # that goes on without a stop
    for number, table in enumerate(tables, 1):
        where = f"{file}, {word} {number}"
        unknown(table, _MOVE if word == "move" else {*_LINE, *_ARC, *_THROUGH}, f"{where}, ")
        for leg in _entry(table, here, where):
            here = leg.end
            whole = leg if open_leg is None else _on(open_leg, leg, where)
            open_leg = None
            legs.append(whole)
        if _flag(table, where):
            if number == len(tables):
                raise ProblemError(f"{where}, on", f"no other {word} follows", "Leave it out.")
            open_leg = legs.pop()
        if len(legs) > MAX_MOVES:
            raise ProblemError(where, f"more than {MAX_MOVES} moves", "Shorten the programme.")
    return legs


def _flag(table: dict[str, Any], where: str) -> bool:
    on = table.get("on", False)
    if not isinstance(on, bool):
        raise InputError(f"{where}, on", printable(on), "true or false")
    return on


def _on(before: Leg, after: Leg, where: str) -> Leg:
    """Join two legs without a stop."""
    if not before.pieces or not after.pieces:
        remedy = "Give it a length, or end the path before it without `on`."
        raise ProblemError(where, "the path has no length", remedy)
    turn = paths.turning(before.pieces[-1], after.pieces[0])
    if abs(turn) > _TANGENT:
        remedy = "Begin in the direction in which the path before ends, or remove its `on`."
        raise ProblemError(where, f"a corner of {math.degrees(turn):.4g} deg", remedy)
    return Leg(
        "path",
        (*before.pieces, *after.pieces),
        (*before.speeds, *after.speeds),
        after.end,
        after.hold,
    )


def _entry(table: dict[str, Any], here: Point, where: str) -> list[Leg]:
    """The moves of one table."""
    hold = entries.rest(table, HOLD, where)
    speed = math.inf
    if "speed" in table:
        written = entries.text(table, "speed", where, "20 mm/s")
        speed = quantity(written, "m/s", f"{where}, speed", "mm/s")
        if not speed > 0.0:
            raise InputError(f"{where}, speed", table["speed"], "a speed above zero")
    if "centre" in table or "angle" in table:
        only(table, _ARC, where)
        piece, end = _arc(table, here, where)
        return [Leg("arc", (piece,), (speed,), end, hold)]
    if "points" in table:
        only(table, _THROUGH, where)
        return _through(table, here, (speed, hold), where)
    if "x" not in table and "y" not in table:
        raise ProblemError(where, "no path", "Give x, y or both; or centre and angle; or points.")
    only(table, _LINE, where)
    x, y = (
        _length(table[name], f"{where}, {name}") if name in table else at
        for name, at in zip(AXES, here, strict=True)
    )
    return [_straight(here, (x, y), speed, hold)]


def _straight(here: Point, end: Point, speed: float, hold: float) -> Leg:
    if math.dist(here, end) <= paths.MEET:
        return Leg("line", (), (), here, hold)
    return Leg("line", (paths.line(here, end),), (speed,), end, hold)


def _arc(table: dict[str, Any], here: Point, where: str) -> tuple[Piece, Point]:
    centre = _point(table.get("centre"), f"{where}, centre")
    written = entries.text(table, "angle", where, "90 deg")
    angle = quantity(written, "rad", f"{where}, angle", "deg")
    if math.dist(here, centre) <= paths.MEET:
        accepted = "a point other than the path's start"
        raise InputError(f"{where}, centre", printable(table["centre"]), accepted)
    if angle == 0.0:
        raise InputError(f"{where}, angle", written, "an angle other than 0 deg")
    piece = paths.arc(here, centre, angle)
    closed = abs(math.remainder(angle, paths.TURN)) < 1e-12
    return piece, here if closed else piece.end


def _through(table: dict[str, Any], here: Point, how: tuple[float, float], where: str) -> list[Leg]:
    raw = table["points"]
    if not isinstance(raw, list) or not raw:
        raise InputError(f"{where}, points", printable(raw), 'a list such as [["5 mm", "0 mm"]]')
    points = [here]
    points += [_point(each, f"{where}, point {k}") for k, each in enumerate(raw, 1)]
    corners = table.get("corners", ROUND if "rounding" in table else STOP)
    if corners not in (STOP, ROUND):
        raise InputError(f"{where}, corners", printable(corners), f'"{STOP}" or "{ROUND}"')
    if (corners == ROUND) != ("rounding" in table):
        accepted = f'a rounding with corners = "{ROUND}", and none with "{STOP}"'
        raise InputError(f"{where}, rounding", show_value(table.get("rounding")), accepted)
    speed, hold = how
    if corners == STOP:
        ends = itertools.pairwise(points)
        legs = [_straight(a, b, speed, 0.0) for a, b in ends]
        return [*legs[:-1], legs[-1]._replace(hold=hold)]
    radius = _length(table["rounding"], f"{where}, rounding")
    if radius <= 0.0:
        raise InputError(f"{where}, rounding", table["rounding"], "a radius above zero")
    pieces = paths.round_corners(points, radius, where)
    return [Leg("path", tuple(pieces), (speed,) * len(pieces), points[-1], hold)]


def _length(raw: object, where: str) -> float:
    if not isinstance(raw, str):
        raise InputError(where, printable(raw), "text with a unit such as '1.5 mm'")
    return quantity(raw, "m", where, "mm")


def _point(raw: object, where: str) -> Point:
    if not isinstance(raw, list) or len(raw) != 2:
        raise InputError(where, show_value(raw), 'x and y, such as ["10 mm", "5 mm"]')
    x, y = (_length(each, f"{where}, {name}") for each, name in zip(raw, AXES, strict=True))
    return x, y


def _table(path: Path) -> Course:
    """A trajectory: a move to its first place, then its times."""
    values = trajectory(path, AXES, (LENGTH, LENGTH))
    hold = quantity(HOLD, "s", printable(path, 300))
    first, last = ((float(values[1, k]), float(values[2, k])) for k in (0, -1))
    track = Leg("trajectory", (), (), last, hold, values)
    return Course(
        printable(path.stem, 200), (_straight((0.0, 0.0), first, math.inf, hold), track), str(path)
    )


def repeat(legs: tuple[Leg, ...], cycles: int) -> tuple[Leg, ...]:
    """All cycles, joined by straight moves where needed."""
    first = legs[0]
    begin = (first.pieces[0].x, first.pieces[0].y) if first.pieces else first.end
    if cycles == 1 or math.dist(begin, legs[-1].end) < 1e-12:
        return legs * cycles
    if first.name == "line":  # it goes to the same place from wherever it begins
        again = paths.line(legs[-1].end, first.end)
        rest = (first._replace(pieces=(again,)), *legs[1:])
    else:
        rest = (Leg("line", (paths.line(legs[-1].end, begin),), (math.inf,), begin, 0.0), *legs)
    return (*legs, *(rest * (cycles - 1)))


def usual(tree: Any) -> Course:
    """A square with exact stops, a circle and a diagonal."""
    span = min(tree.x.travel.high, tree.y.travel.high)
    low, high, middle, hold = 0.1 * span, 0.9 * span, 0.5 * span, quantity(HOLD, "s", "hold")
    corners = [(low, low), (high, low), (high, high), (low, high), (low, low)]
    legs, here = [], (0.0, 0.0)
    for corner in (*corners, (low, middle)):
        legs.append(_straight(here, corner, math.inf, hold))
        here = corner
    circle = paths.arc(here, (middle, middle), paths.TURN)
    legs.append(Leg("arc", (circle,), (math.inf,), here, hold))
    legs += [
        _straight(here, (low, high), math.inf, hold),
        _straight((low, high), (high, low), math.inf, hold),
        _straight((high, low), (0.0, 0.0), math.inf, hold),
    ]
    return Course("square, circle, diagonal", tuple(legs), "the machine's usual moves")
