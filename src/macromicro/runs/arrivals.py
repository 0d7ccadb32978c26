"""Arrival of a run's moves: a line for people, a warning for programs."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from macromicro.design.response import MoveResult
from macromicro.errors import ArrivalWarning
from macromicro.place import LENGTH, Place

_FEW = 10  # moves that are named
_UNITS = {"mm": 1e-3, "um": 1e-6}


class Rest(NamedTuple):
    number: int  # as a person counts
    arrived: bool
    complete: bool  # False: a fault or an interruption cut it short
    error: float | None  # distance from the target at rest, m or rad


def of_both(moves: Iterable[MoveResult], numbers: NDArray[np.int64]) -> list[Rest]:
    return [
        Rest(
            int(numbers[m.move]),
            m.arrived_s is not None,
            m.complete,
            None if m.final_error is None else abs(m.final_error) * _UNITS[m.unit],
        )
        for m in moves
    ]


def describe_missed(moves: Iterable[Rest]) -> str:
    late = [str(m.number) for m in moves if m.complete and not m.arrived]
    if not late:
        return ""
    shown = ", ".join(late[:_FEW])
    shown += f" and {len(late) - _FEW} more" if len(late) > _FEW else ""
    return f"{'move' if len(late) == 1 else 'moves'} {shown} did not arrive"


def error(value: float, place: Place = LENGTH) -> str:
    units = (place.unit, place.per), (place.fine, place.fines), (place.finest, 1e3 * place.fines)
    unit, scale = next((one for one in units if value * one[1] >= 1.0), units[-1])
    return f"{float(f'{value * scale:.3g}'):g} {unit}"


def _worst(moves: Iterable[Rest], place: Place) -> tuple[str, int] | None:
    """The largest error at rest, and the number of its move."""
    known = [(m.error, m.number) for m in moves if m.error is not None]
    if not known:
        return None
    value, number = max(known, key=lambda one: one[0])
    return error(value, place), number


def verdict(
    moves: Sequence[Rest],
    planned: int,
    place: Place = LENGTH,
    *,
    followed: float | None = None,
    doubt: str = "",
) -> str:
    found = []
    if planned:
        found.append(f"{sum(m.arrived for m in moves)} of {planned} moves arrived{doubt}")
    if (worst := _worst(moves, place)) is not None:
        found.append(f"worst {worst[0]} (move {worst[1]})")
    if followed is not None:
        found.append(f"at most {error(followed, place)} from the moving set point")
    return "; ".join(found) or "no moves planned"


def warn(moves: Sequence[Rest], remedy: str, place: Place = LENGTH, stacklevel: int = 3) -> None:
    """Warn once about the moves of a run that did not arrive."""
    said = describe_missed(moves)
    if not said:
        return
    worst = _worst([m for m in moves if m.complete and not m.arrived], place)
    if worst is not None:
        said += f"; the worst stopped {worst[0]} from its target (move {worst[1]})"
    warnings.warn(f"{said}. {remedy}", ArrivalWarning, stacklevel=stacklevel)
