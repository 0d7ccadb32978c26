"""TOML programmes: [[moves]], [[profiles]], or both in turn."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import ProblemError
from macromicro.nominal import PERIOD
from macromicro.programme import _profiled, _sequenced, entries
from macromicro.programme._profiled import Leg
from macromicro.programme.moves import (
    CLOCKED,
    MACRO,
    MAX_MOVES,
    MICRO,
    TO,
    WHAT,
    Limits,
    Move,
    Programme,
    Span,
    programme,
)
from macromicro.schema.keys import unknown
from macromicro.schema.text import printable, read_text, read_toml

_KEYS = ("title", "moves", "profiles")
_READERS: dict[str, Any] = {"moves": _sequenced, "profiles": _profiled}
_HEADER = re.compile(r"""^[ \t]*\[\[[ \t]*["']?(moves|profiles)["']?[ \t]*\]\]""", re.MULTILINE)


class _Entry(NamedTuple):
    """A table of the file: "moves" or "profiles", its place, and its content."""

    kind: str
    where: str
    table: dict[str, Any]


def load_toml(path: Path, limits: Limits) -> Programme:
    """Read a sequenced programme, one of motion profiles, or a mixed one."""
    raw, file = _with_stage_names(read_toml(path, WHAT), limits), printable(path, 300)
    unknown(raw, _KEYS, f"{file}, ")
    name = entries.title(raw, file) or printable(path.stem, 200)
    if "profiles" not in raw:
        moves: list[Move] = []
        for entry in _entries(raw, "moves", limits, file):
            moves += _moves(entry, limits, len(moves))
        return programme(name, moves, math.nan, path)
    if "moves" not in raw:
        return _profiled.expand(_tables(raw, "profiles", limits, file), limits, path, name)
    each = {kind: _entries(raw, kind, limits, file) for kind in ("moves", "profiles")}
    order = _HEADER.findall(read_text(path, WHAT))
    if any(order.count(kind) != len(tables) for kind, tables in each.items()):
        accepted = "Write each under a header [[moves]] or [[profiles]], in their order."
        raise ProblemError(file, "the order of moves and profiles is not clear", accepted)
    rest = {kind: iter(tables) for kind, tables in each.items()}
    return _moves_and_profiles([next(rest[kind]) for kind in order], limits, path, name)


def _with_stage_names(raw: dict[str, Any], limits: Limits) -> dict[str, Any]:
    """A file in which the only stage of a machine may have the name of the coarse one of two."""
    if not limits.alone:
        return raw
    found = dict(raw)
    for kind in _READERS:
        tables = raw.get(kind)
        if isinstance(tables, list) and all(isinstance(each, dict) for each in tables):
            found[kind] = [_without_stage_name(each) for each in tables]
    return found


def _without_stage_name(table: dict[str, Any]) -> dict[str, Any]:
    if TO in table:
        return table
    return {TO if key == "macro" else key: value for key, value in table.items()}


def _tables(raw: dict[str, Any], key: str, limits: Limits, file: str) -> list[dict[str, Any]]:
    return entries.tables(raw, key, file, _READERS[key].tables(limits))


def _entries(raw: dict[str, Any], key: str, limits: Limits, file: str) -> list[_Entry]:
    """The tables of a key; an unknown key is reported before all other errors."""
    keys = _READERS[key].keys(limits)
    made = []
    for number, table in enumerate(_tables(raw, key, limits, file), 1):
        where = f"{file}, {key.removesuffix('s')} {number}"
        unknown(table, keys, f"{where}, ")
        made.append(_Entry(key, where, table))
    return made


def _moves(entry: _Entry, limits: Limits, before: int) -> list[Move]:
    return list(_sequenced.steps(entry.table, limits, entry.where, MAX_MOVES - before))


def _moves_and_profiles(entries: list[_Entry], limits: Limits, path: Path, title: str) -> Programme:
    """Moves and profiles in the order of the file, from both stages at 0."""
    rows: list[Array] = []
    spans: list[Span] = []
    count, places = 0, [0.0, 0.0]  # m
    for entry in entries:
        if entry.kind == "moves":
            made = _moves(entry, limits, count)
            for move in made:
                _go(places, move.stage, move.target, limits)
            rows.append(np.array([move[:4] for move in made]))
            count += len(made)
            continue
        for leg in _profiled.ways(entry.table, places, limits, entry.where):
            spans.append(leg.span.moved(math.nan, count))
            rows.append(_set_points(leg))
            count = spans[-1].behind
            if count > MAX_MOVES:
                accepted = f"At most {MAX_MOVES} moves and set points, one each {PERIOD:g} s."
                raise ProblemError(entry.where, "too long", accepted)
    start, stage, target, hold = np.concatenate(rows).T
    return Programme(
        title, start, stage.astype(np.int64), target, hold, math.nan, str(path), tuple(spans)
    )


def _go(places: list[float], stage: int, target: float, limits: Limits) -> None:
    """Positions of both stages after a move; a macro move releases the micro-stage."""
    places[stage] = target / limits.counts_per_metre if stage == MACRO else target
    if stage == MACRO:
        places[MICRO] = 0.0


def _set_points(leg: Leg) -> Array:
    """A profile's rows, timed by the clock; its last waits for the arrival, as a move does."""
    n = len(leg.place)
    start, hold = np.full(n, CLOCKED), np.full(n, PERIOD)
    start[0], hold[-1] = math.nan, leg.hold
    target = leg.place * leg.span.scale
    return np.column_stack((start, np.full(n, leg.span.stage), target, hold))
