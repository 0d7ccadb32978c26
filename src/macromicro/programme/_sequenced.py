"""The moves of a TOML programme: one after the other."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from macromicro.errors import ProblemError
from macromicro.programme import entries
from macromicro.programme.moves import MACRO, MAX_MOVES, MICRO, Limits, Move


def keys(limits: Limits) -> tuple[str, ...]:
    """What a table [[moves]] may have."""
    return (*limits.names, "hold") if limits.alone else (*limits.names, "hold", "macro_hold")


def tables(limits: Limits) -> str:
    """What is accepted for [[moves]], in words."""
    return f"one table [[moves]] or more, each with {limits.either}, and hold"


def steps(table: dict[str, Any], limits: Limits, where: str, most: int) -> Iterator[Move]:
    names = {stage: key for key, stage in limits.names.items()}
    coarse, fine = names[MACRO], names.get(MICRO, "")
    macro, micro = (entries.texts(table, key, where) for key in (coarse, fine))
    hold = entries.text(table, "hold", where)
    _check_keys(table, limits, where)
    if len(macro) * (1 + len(micro)) > most or len(micro) > most:
        raise ProblemError(where, "too many moves", f"A programme has at most {MAX_MOVES}.")
    targets = (
        [entries.target(text, MACRO, limits, f"{where}, {coarse}") for text in macro],
        [entries.target(text, MICRO, limits, f"{where}, {fine}") for text in micro],
    )
    wait = held = entries.hold(hold, f"{where}, hold")
    if macro and micro:
        text = entries.text({"macro_hold": "0 s"} | table, "macro_hold", where)
        wait = entries.hold(text, f"{where}, macro_hold", zero=True)
    return _expand(*targets, held, wait)


def _check_keys(table: dict[str, Any], limits: Limits, where: str) -> None:
    """One of macro and micro, or lists of both; no list is empty; macro_hold only with both."""
    given = [table[key] for key in limits.names if key in table]
    if not given:
        raise entries.no_target(limits, where)
    if [] in given:
        raise ProblemError(where, "the list is empty", "Give one target or more.")
    if len(given) > 1 and not all(isinstance(value, list) for value in given):
        accepted = "Give one of them, or a list of macro targets and a list of fine steps."
        raise ProblemError(where, "both macro and micro", accepted)
    if "macro_hold" in table and len(given) == 1:
        raise ProblemError(
            f"{where}, macro_hold", "only with lists of both macro and micro", "Use hold."
        )


def _expand(
    macro: list[float], micro: list[float], hold: float, macro_hold: float
) -> Iterator[Move]:
    """Every macro target, and after each every fine step; or the fine steps alone."""
    fine = [Move(math.nan, MICRO, target, hold) for target in micro]
    if not macro:
        yield from fine
    for target in macro:
        yield Move(math.nan, MACRO, target, macro_hold)
        yield from fine
