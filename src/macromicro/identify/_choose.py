"""Choice between models by pieces of the data that are held out in turn.

A richer model has to predict them better by a share, and by more than the pieces scatter.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.identify.engine import Pieces, Simulated, Space, fit, residual

FOLDS = 3
GAIN = 0.02  # a richer model must lower the held-out error by this part
_SURE = 2.0  # and the pieces' squares by so many standard errors of what they gain
_SEARCH = 15  # steps of a search without the pieces held out


class Judged(NamedTuple):
    structure: str  # the chosen one
    # RMS error of each in a typical held-out piece: the geometric mean of all
    scores: dict[str, float]
    reasons: dict[str, str]  # why each other one was not chosen, in words


def turn(number: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Turn in which each piece is held out."""
    # Every third piece, a different one of each three: a motion with a period of three pieces would
    # otherwise be held out in the same phase each time.
    return (number + number // FOLDS) % FOLDS


def typical(squares: Array) -> float:
    # A plain mean would be that of the one piece in which the mass sticks.
    return float(np.exp(0.5 * np.mean(np.log(squares))))


def no_better(score: float, richer: float, gained: Array, than: str, sure: float = _SURE) -> str:
    """Why a richer model is not taken; empty if it is."""
    if richer >= (1.0 - GAIN) * score:
        return f"not {100.0 * GAIN:.0f} % better than {than}"
    error = float(np.std(gained, ddof=1) / np.sqrt(len(gained))) if len(gained) > 1 else 0.0
    if float(gained.mean()) < sure * error:
        return f"better than {than}, but by less than the scatter of the blocks"
    return ""


def simplest(squares: dict[str, Array], reasons: dict[str, str] | None = None) -> Judged:
    """The simplest model, of those from poor to rich, that no richer one beats."""
    scores = {name: typical(each) for name, each in squares.items()}
    against = dict(reasons or {})
    best = ""
    for name, score in scores.items():
        if not best:
            best = name
            continue
        gained = np.log(squares[best] / squares[name])
        why = no_better(scores[best], score, gained, best)
        if why:
            against[name] = why
        else:
            against[best] = f"{name} is better"
            best = name
    return Judged(best, scores, against)


def held_out(
    simulated: Simulated,
    space: Space,
    pieces: Pieces,
    begin: Array,
    measured: Pieces | None = None,
) -> Array:
    """Mean square error of each piece by a fit without it, from its own state or a measured one."""
    turns = turn(np.arange(len(pieces.many)))
    squares = np.empty(len(turns))
    for fold in range(min(FOLDS, len(turns))):
        held = turns == fold
        kept = pieces if held.all() else pieces.some(~held)
        found = fit(simulated, space, kept, begin, most=_SEARCH, rounds=1)
        if measured is None:
            other = pieces.some(held)
            error = residual(simulated, space, other, found.values)
        else:
            other = measured.some(held)
            error = simulated(found.values, other) - other.y
        squares[held] = other.totals(error**2) / other.many
    return np.asarray(squares + 1e-30 * space.unit**2)
