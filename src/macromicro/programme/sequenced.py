"""TOML programmes: [[moves]], one after the other, or [[profiles]] by the clock."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from macromicro.errors import InputError
from macromicro.programme import entries
from macromicro.programme.moves import (
    MACRO,
    MAX_MOVES,
    MAX_TITLE,
    MICRO,
    WHAT,
    Limits,
    Move,
    Programme,
    programme,
)
from macromicro.programme.profiled import PROFILES, expanded
from macromicro.schema.keys import found, unknown
from macromicro.schema.text import printable, read_toml

_KEYS = ("title", "moves", "profiles")
_MOVE_KEYS = ("macro", "micro", "hold", "macro_hold")
_MOVES = "one table [[moves]] or more, each with macro or micro, and hold"


def load_toml(path: Path, limits: Limits) -> Programme:
    """Read a sequenced programme, or one of motion profiles.

    Parameters
    ----------
    path : Path
        .toml, with tables [[moves]] or [[profiles]].
    limits : Limits
        How far the stages go.

    Returns
    -------
    Programme
        Of moves without times, of profiles with times.

    Raises
    ------
    InputError
        Names the file and the line or the move or profile and its key.
    """
    raw, file = read_toml(path, WHAT), printable(path, 300)
    unknown(raw, _KEYS, f"{file}, ")
    title = raw.get("title", "")
    if not isinstance(title, str) or not title.isprintable() or len(title) > MAX_TITLE:
        accepted = f"one line of text of at most {MAX_TITLE} characters"
        raise InputError(f"{file}, title", printable(title), accepted)
    if "profiles" in raw:
        if "moves" in raw:
            accepted = "one of them: profiles go by the clock, moves one after the other"
            raise InputError(file, "moves and profiles", accepted)
        return expanded(_tables(raw, "profiles", file), limits, path, title or path.stem)
    tables = _tables(raw, "moves", file)
    for number, table in enumerate(tables, 1):  # an unknown key, often a slip, before all others
        unknown(table, _MOVE_KEYS, f"{file}, move {number}, ")
    moves: list[Move] = []
    for number, table in enumerate(tables, 1):
        moves += _moves(table, limits, f"{file}, move {number}", MAX_MOVES - len(moves))
    return programme(title or path.stem, moves, math.nan, path)


def _tables(raw: dict[str, Any], key: str, file: str) -> list[dict[str, Any]]:
    tables = raw.get(key)
    if isinstance(tables, list) and tables and all(isinstance(t, dict) for t in tables):
        return tables
    raise InputError(f"{file}, {key}", found(tables), _MOVES if key == "moves" else PROFILES)


def _moves(table: dict[str, Any], limits: Limits, where: str, most: int) -> Iterator[Move]:
    """The moves of one table [[moves]], at most `most`."""
    macro, micro = (entries.texts(table, key, where) for key in ("macro", "micro"))
    hold = entries.text(table, "hold", where)
    _check_keys(table, where)
    if len(macro) * (1 + len(micro)) > most or len(micro) > most:
        raise InputError(where, "too many moves", f"at most {MAX_MOVES} in all")
    targets = (
        [entries.target(text, MACRO, limits, f"{where}, macro") for text in macro],
        [entries.target(text, MICRO, limits, f"{where}, micro") for text in micro],
    )
    wait = held = entries.hold(hold, f"{where}, hold")
    if macro and micro:
        text = entries.text({"macro_hold": "0 s"} | table, "macro_hold", where)
        wait = entries.hold(text, f"{where}, macro_hold", zero=True)
    return _expanded(*targets, held, wait)


def _check_keys(table: dict[str, Any], where: str) -> None:
    """One of macro and micro, or lists of both; no list is empty; macro_hold only with both."""
    given = [table[key] for key in ("macro", "micro") if key in table]
    if not given:
        raise InputError(where, "neither macro nor micro", "exactly one of them")
    if [] in given:
        raise InputError(where, "an empty list", "one target or more")
    if len(given) > 1 and not all(isinstance(value, list) for value in given):
        accepted = "exactly one of them, or a list of macro targets and a list of fine steps"
        raise InputError(where, "both macro and micro", accepted)
    if "macro_hold" in table and len(given) == 1:
        accepted = "hold alone; macro_hold goes with lists of both macro and micro"
        raise InputError(f"{where}, macro_hold", printable(table["macro_hold"]), accepted)


def _expanded(
    macro: list[float], micro: list[float], hold: float, macro_hold: float
) -> Iterator[Move]:
    """Every macro target, and after each every fine step; or the fine steps alone."""
    fine = [Move(math.nan, MICRO, target, hold) for target in micro]
    if not macro:
        yield from fine
    for target in macro:
        yield Move(math.nan, MACRO, target, macro_hold)
        yield from fine
