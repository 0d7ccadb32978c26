"""Which structure of the friction a record asks for: judged on data that it was not fitted to.

Each record is cut into blocks, and a third of them is held out in turn, so that what is fitted
and what it is judged by both see all that the record shows: both directions, all speeds. A richer
structure has to be better by a share and by more than the blocks differ among themselves.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify.axis_inverse import (
    STRUCTURES,
    Estimate,
    Rows,
    fitted,
    force_residuals,
    plausible,
)
from macromicro.identify.runs import Run

Index = npt.NDArray[np.int64]
FOLDS = 3
_GAIN = 0.02  # a richer structure must lower the held-out error by this part
_SURE = 2.0  # and the blocks' squares by so many standard errors of what they gain
_STRANGE = 3.0  # likewise, of what nobody spoke of: several such things are looked for
_MOST = 12  # blocks in a record
_LEAST = 40  # decimated samples in a block: its low-pass takes 20
# What stands in for a structure where a part of the record does not show it.
_POORER = {
    "coulomb": "viscous",
    "asymmetric": "coulomb",
    "stribeck": "coulomb",
    "full": "stribeck",
}
_TOO_POOR = "the motion does not tell its parameters apart"
_NEGATIVE = "no mass above 0, or a friction below 0"


class Judged(NamedTuple):
    """What became of the structures.

    Attributes
    ----------
    structure : str
        The chosen one.
    scores : dict[str, float]
        RMS force error of each in a typical held-out block: the geometric mean of all.
    reasons : dict[str, str]
        Why each other one was not chosen, in words.
    """

    structure: str
    scores: dict[str, float]
    reasons: dict[str, str]


def part(rows: Rows, where: slice) -> Rows:
    """A stretch of a record.

    Parameters
    ----------
    rows : Rows
        The record.
    where : slice
        Of its samples.

    Returns
    -------
    Rows
        These alone.
    """
    run = Run(*(column[where] for column in rows.run))
    return rows._replace(
        run=run,
        force=rows.force[where],
        v=rows.v[where],
        a=rows.a[where],
        still=rows.still[where],
    )


def divided(record: Rows, count: int) -> list[Rows]:
    """A record in so many parts of one length or nearly so.

    Parameters
    ----------
    record : Rows
        The record.
    count : int
        From 1.

    Returns
    -------
    list[Rows]
        All samples in their order.
    """
    ends = np.linspace(0, len(record.v), count + 1).round().astype(int)
    return [part(record, slice(a, b)) for a, b in pairwise(ends)]


def blocks(rows: list[Rows]) -> list[Rows]:
    """All records in blocks of one length or nearly so, in their order.

    Parameters
    ----------
    rows : list[Rows]
        The records.

    Returns
    -------
    list[Rows]
        Up to twelve of each record, long enough to be decimated.
    """
    made = []
    for record in rows:
        longest = _LEAST * record.factor
        made += divided(record, max(min(_MOST, len(record.v) // longest), 1))
    return made


def turn(number: Index) -> Index:
    """In which turn a block is held out.

    Every third, a different one of each three: a motion that repeats itself every three blocks
    would else be held out in the same part of it each time.

    Parameters
    ----------
    number : ndarray, shape (n,)
        Of the block, from 0.

    Returns
    -------
    ndarray, shape (n,)
        From 0 to 2.
    """
    return (number + number // FOLDS) % FOLDS


def folds(rows: list[Rows]) -> Iterator[tuple[list[Rows], list[Rows]]]:
    """What is fitted and what is held out, in turn: a third of the blocks (`turn`).

    Parameters
    ----------
    rows : list[Rows]
        The records.

    Yields
    ------
    tuple[list[Rows], list[Rows]]
        Blocks to fit, and blocks to judge by.
    """
    pieces = blocks(rows)
    turns = turn(np.arange(len(pieces)))
    for k in range(min(FOLDS, len(pieces))):
        kept = [p for p, at in zip(pieces, turns, strict=True) if at != k]
        yield kept, [p for p, at in zip(pieces, turns, strict=True) if at == k]


def chosen(rows: list[Rows]) -> Judged:
    """The poorest structure that no richer one beats on held-out data.

    Parameters
    ----------
    rows : list[Rows]
        The records.

    Returns
    -------
    Judged
        With what became of the others.

    Raises
    ------
    InputError
        No structure gives a mass and friction above 0, or the motion is too poor for any.
    """
    squares: dict[str, Array] = {}
    reasons: dict[str, str] = {}
    for name in STRUCTURES:
        found = held_out(rows, name)
        if isinstance(found, str):
            reasons[name] = found
        else:
            squares[name] = found
    # Of a typical block: one in which the axis sticks would outweigh all others in a plain mean.
    scores = {n: typical(each) for n, each in squares.items()}
    best = ""
    for name, score in scores.items():
        if not best:
            best = name
            continue
        reason = no_better(scores[best], score, np.log(squares[best] / squares[name]), best)
        if reason:
            reasons[name] = reason
        else:
            reasons[best] = f"{name} is better"
            best = name
    if best:
        return Judged(best, scores, {n: reasons[n] for n in STRUCTURES if n in reasons})
    if reasons["viscous"] == _NEGATIVE and fitted(rows, "viscous", told=False).axis.mass < 0.0:
        raise InputError(
            "record",
            "a mass below 0: the force acts against the acceleration",
            "a force that drives the motion: check the signs of u, x and gain, that x does not "
            "wrap, and that samples are not too far apart",
        )
    raise InputError(
        "record",
        "; ".join(f"{name}: {why}" for name, why in reasons.items()),
        "accelerated motion in both directions at several speeds",
    )


def held_out(rows: list[Rows], name: str) -> Array | str:
    """How well a structure foretells the force.

    Where what is fitted does not show what a structure adds, or gives it a negative sign, the
    nearest poorer structure foretells the blocks held out: the only reverse motion, or the only
    slow one, may be in them.

    Parameters
    ----------
    rows : list[Rows]
        The records.
    name : str
        Of the structure.

    Returns
    -------
    ndarray, shape (k,), or str
        Mean square of the force error in each held-out block, or why there is none.
    """
    whole = _fit(rows, name)
    if isinstance(whole, str):
        return whole
    squares = []
    for train, test in folds(rows):
        estimate: Estimate | str = _fit(train, name)
        at = name
        while isinstance(estimate, str) and at in _POORER:
            at = _POORER[at]
            estimate = _fit(train, at)
        if isinstance(estimate, str):
            return estimate
        missed = [r for r in force_residuals(test, estimate) if len(r)]
        squares += [float(np.mean(r**2)) for r in missed]
    return np.array(squares) if squares else _TOO_POOR


def _fit(rows: list[Rows], name: str) -> Estimate | str:
    """The fit of a structure, or why it cannot be."""
    try:
        estimate = fitted(rows, name, told=False)
    except InputError:
        return _TOO_POOR
    return estimate if plausible(estimate) else _NEGATIVE


def lowered(rows: list[Rows], other: list[Rows], structure: str) -> float | None:
    """By how much records taken another way lower the force error in blocks held out.

    Parameters
    ----------
    rows : list[Rows]
        The records.
    other : list[Rows]
        The same, with another force or other parameters; errors count as parts of the force.
    structure : str
        Of the friction.

    Returns
    -------
    float | None
        Part of the error; 1 where only the other way gives a mass and friction above 0. None: not
        by enough, or the motion does not tell.
    """
    one, another = held_out(rows, structure), held_out(other, structure)
    if isinstance(another, str):
        return None
    if isinstance(one, str):
        return 1.0 if one == _NEGATIVE else None
    power = [sum(float(r.force @ r.force) for r in each) for each in (rows, other)]
    another = another * (power[0] / power[1])
    score, richer = typical(one), typical(another)
    why_not = no_better(score, richer, np.log(one / another), structure, _STRANGE)
    return None if why_not else 1.0 - richer / score


def told(part: float) -> str:
    """What `lowered` found, in words.

    Parameters
    ----------
    part : float
        Of the error.

    Returns
    -------
    str
        What the other way does.
    """
    if part == 1.0:
        return "alone gives a mass and friction above 0"
    return f"lowers the force error by {100.0 * part:.0f} % on data held out"


def typical(squares: Array) -> float:
    """RMS in a typical block.

    Parameters
    ----------
    squares : ndarray, shape (k,)
        Mean square in each block.

    Returns
    -------
    float
        Root of their geometric mean.
    """
    return float(np.exp(0.5 * np.mean(np.log(squares))))


def no_better(score: float, richer: float, gained: Array, than: str, sure: float = _SURE) -> str:
    """Why a richer structure is not taken.

    Parameters
    ----------
    score, richer : float
        Error of the poorer and of the richer one.
    gained : ndarray, shape (k,)
        Logarithm of the ratio of squares in each block, so that a block where both are poor does
        not decide.
    than : str
        Name of the poorer one.
    sure : float, optional
        Standard errors of the mean gain that it must be above.

    Returns
    -------
    str
        "" where it is taken.
    """
    if richer >= (1.0 - _GAIN) * score:
        return f"not {100.0 * _GAIN:.0f} % better than {than}"
    error = float(np.std(gained, ddof=1) / np.sqrt(len(gained))) if len(gained) > 1 else 0.0
    if float(gained.mean()) < sure * error:
        return f"better than {than}, but by less than its blocks differ"
    return ""
