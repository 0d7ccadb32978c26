"""TOML programmes: [[moves]] tables, one after the other."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from macromicro.errors import InputError
from macromicro.programme.moves import (
    MACRO,
    MAX_HOLD,
    MAX_MOVES,
    MAX_TITLE,
    MICRO,
    WHAT,
    Limits,
    Move,
    Programme,
    admitted,
    programme,
)
from macromicro.schema.keys import found, unknown
from macromicro.schema.text import printable, read_toml
from macromicro.units import measured, quantity

_KEYS = ("title", "moves")
_MOVE_KEYS = ("macro", "micro", "hold", "macro_hold")
_MOVES = "one table [[moves]] or more, each with macro or micro, and hold"
_TARGETS = "text with a unit such as '1.5 mm', or a list of such texts"


def load_toml(path: Path, limits: Limits) -> Programme:
    """Read a sequenced programme.

    Parameters
    ----------
    path : Path
        .toml, with tables [[moves]].
    limits : Limits
        How far the stages go.

    Returns
    -------
    Programme
        Without times.

    Raises
    ------
    InputError
        Names the file and the line or the move and its key.
    """
    raw, file = read_toml(path, WHAT), printable(path, 300)
    unknown(raw, _KEYS, f"{file}, ")
    title, tables = raw.get("title", ""), raw.get("moves")
    if not isinstance(title, str) or not title.isprintable() or len(title) > MAX_TITLE:
        accepted = f"one line of text of at most {MAX_TITLE} characters"
        raise InputError(f"{file}, title", printable(title), accepted)
    if not isinstance(tables, list) or not tables or not all(isinstance(t, dict) for t in tables):
        raise InputError(f"{file}, moves", found(tables), _MOVES)
    for number, table in enumerate(tables, 1):  # an unknown key, often a slip, before all others
        unknown(table, _MOVE_KEYS, f"{file}, move {number}, ")
    moves: list[Move] = []
    for number, table in enumerate(tables, 1):
        moves += _moves(table, limits, f"{file}, move {number}", MAX_MOVES - len(moves))
    return programme(title or path.stem, moves, math.nan, path)


def _moves(table: dict[str, Any], limits: Limits, where: str, most: int) -> Iterator[Move]:
    """The moves of one table [[moves]], at most `most`."""
    macro, micro = (_texts(table, key, where) for key in ("macro", "micro"))
    hold = _text(table, "hold", where)
    _check_keys(table, where)
    if len(macro) * (1 + len(micro)) > most or len(micro) > most:
        raise InputError(where, "too many moves", f"at most {MAX_MOVES} in all")
    targets = (
        [_target(text, MACRO, limits, f"{where}, macro") for text in macro],
        [_target(text, MICRO, limits, f"{where}, micro") for text in micro],
    )
    wait = held = _hold(hold, f"{where}, hold")
    if macro and micro:
        text = _text({"macro_hold": "0 s"} | table, "macro_hold", where)
        wait = _hold(text, f"{where}, macro_hold", zero=True)
    return _expanded(*targets, held, wait)


def _texts(table: dict[str, Any], key: str, where: str) -> list[str]:
    """The texts at `key`, which holds one or a list of them, or is not there."""
    value = table.get(key, [])
    texts = value if isinstance(value, list) else [value]
    if not all(isinstance(text, str) for text in texts):
        raise InputError(f"{where}, {key}", printable(value, 40), _TARGETS)
    return texts


def _text(table: dict[str, Any], key: str, where: str) -> str:
    value = table.get(key)
    if not isinstance(value, str):
        missing = "missing" if value is None else printable(value, 40)
        raise InputError(f"{where}, {key}", missing, "text with a unit such as '2 s'")
    return value


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


def _hold(text: str, where: str, *, zero: bool = False) -> float:
    value = quantity(text, "s", where)
    if not (0.0 < value <= MAX_HOLD or (zero and value == 0.0)):
        raise InputError(where, text, "0 s to 1 h" if zero else "more than 0 s, at most 1 h")
    return value


def _target(text: str, stage: int, limits: Limits, where: str) -> float:
    """A target in counts (macro) or m (micro)."""
    if stage == MICRO:
        return admitted(quantity(text, "m", where), stage, limits, where, text)
    value, unit = measured(text, ("m", "counts"), where)
    counts = value * limits.counts_per_metre if unit == "m" else value
    return admitted(counts, stage, limits, where, text)
