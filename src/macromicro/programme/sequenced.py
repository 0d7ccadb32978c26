"""TOML programmes: [[moves]] tables, one after the other."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from macromicro.errors import InputError
from macromicro.programme.moves import (
    MACRO,
    MAX_HOLD,
    MAX_MOVES,
    MICRO,
    WHAT,
    Limits,
    Move,
    Programme,
    admitted,
    programme,
)
from macromicro.textfile import printable, read_toml
from macromicro.units import measured, quantity

_FILE_KEYS = ("title", "moves")
_MOVE_KEYS = ("macro", "micro", "hold", "macro_hold")
_TARGETS = "text with a unit such as '1.5 mm', or a list of such texts"
_ACCEPTED = {
    "title": "text of at most 200 characters",
    "moves": "one table [[moves]] or more, each with macro or micro, and hold",
    "macro": _TARGETS,
    "micro": _TARGETS,
    "hold": "text with a unit such as '2 s'",
    "macro_hold": "text with a unit such as '0 s'",
}


@cache
def _shape() -> Any:
    """The keys and types of the file as a pydantic model; units are read afterwards."""
    from pydantic import BaseModel, ConfigDict, Field

    class Table(BaseModel):
        model_config = ConfigDict(extra="forbid", strict=True)
        macro: str | list[str] | None = None
        micro: str | list[str] | None = None
        hold: str
        macro_hold: str | None = None

    class File(BaseModel):
        model_config = ConfigDict(extra="forbid", strict=True)
        title: str = Field("", max_length=200)
        moves: list[Table] = Field(min_length=1)

    return File


def _first_problem(problems: list[Any], file: str) -> InputError:
    """pydantic's findings as one error: an unknown key (often a slip) before all others."""
    problem = min(problems, key=lambda p: bool(p["type"] != "extra_forbidden"))
    loc, kind, value = problem["loc"], problem["type"], problem["input"]
    in_move = len(loc) > 1
    place = [file, f"move {loc[1] + 1}"] if in_move else [file]  # people count from 1
    if len(loc) > (2 if in_move else 0):
        key = str(loc[2] if in_move else loc[0])
        place.append(printable(key))
    else:
        key = "moves"
    if kind == "extra_forbidden":
        known = _MOVE_KEYS if in_move else _FILE_KEYS
        near = difflib.get_close_matches(key, known, 1)
        hint = f" (nearest: {near[0]})" if near else ""
        return InputError(", ".join(place), "unknown key", f"{', '.join(known)}{hint}")
    found = "missing" if kind == "missing" else printable(value, 40)
    return InputError(", ".join(place), found, _ACCEPTED[key])


def load_toml(path: Path, limits: Limits) -> Programme:
    """Read a sequenced programme."""
    from pydantic import ValidationError

    raw = read_toml(path, WHAT)
    file = printable(path, 300)
    try:
        shape = _shape().model_validate(raw)
    except ValidationError as error:
        problems = error.errors(include_url=False, include_context=False)
        raise _first_problem(list(problems), file) from None
    if not shape.title.isprintable():
        raise InputError(f"{file}, title", printable(shape.title), "one line of text")
    moves: list[Move] = []
    for number, table in enumerate(shape.moves, 1):
        where = f"{file}, move {number}"
        _check_keys(table, where)
        macro, micro = _texts(table.macro), _texts(table.micro)
        size = len(macro) * (1 + len(micro)) or len(micro)
        if len(moves) + size > MAX_MOVES:
            raise InputError(where, "too many moves", f"at most {MAX_MOVES} in all")
        targets = (
            [_target(text, MACRO, limits, f"{where}, macro") for text in macro],
            [_target(text, MICRO, limits, f"{where}, micro") for text in micro],
        )
        hold = _hold(table.hold, f"{where}, hold")
        wait = hold
        if macro and micro:
            wait = _hold(table.macro_hold or "0 s", f"{where}, macro_hold", zero=True)
        moves.extend(_expanded(*targets, hold, wait))
    return programme(shape.title or path.stem, moves, math.nan, path)


def _texts(value: str | list[str] | None) -> list[str]:
    return [value] if isinstance(value, str) else (value or [])


def _check_keys(table: Any, where: str) -> None:
    """One of macro and micro, or lists of both; no list is empty; macro_hold only with both."""
    given = [value for value in (table.macro, table.micro) if value is not None]
    if not given:
        raise InputError(where, "neither macro nor micro", "exactly one of them")
    if [] in given:
        raise InputError(where, "an empty list", "one target or more")
    if len(given) > 1 and not all(isinstance(value, list) for value in given):
        accepted = "exactly one of them, or a list of macro targets and a list of fine steps"
        raise InputError(where, "both macro and micro", accepted)
    if table.macro_hold is not None and len(given) == 1:
        accepted = "hold alone; macro_hold goes with lists of both macro and micro"
        raise InputError(f"{where}, macro_hold", table.macro_hold, accepted)


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
