"""Choice of the friction structure by data that it was not fitted to."""

# Each record is cut into blocks, and a third of them is held out in turn, so that both parts show
# all directions and speeds. A richer structure has to be better by a share and by more than the
# blocks scatter.

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.identify._choose import FOLDS, Judged, no_better, simplest, turn, typical
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
_STRANGE = 3.0  # standard errors by which what nobody spoke of must gain: several are looked for
_MOST = 12  # blocks in a record
_LEAST = 40  # decimated samples in a block: its low-pass takes 20
# What stands in for a structure where a part of the record does not show it.
_POORER = {
    "coulomb": "viscous",
    "asymmetric": "coulomb",
    "stribeck": "coulomb",
    "full": "stribeck",
}
_TOO_POOR = "the motion does not determine its parameters"
_NEGATIVE = "the mass or a friction is negative"


def part(rows: Rows, where: slice) -> Rows:
    run = Run(*(column[where] for column in rows.run))
    return rows._replace(
        run=run,
        force=rows.force[where],
        v=rows.v[where],
        a=rows.a[where],
        still=rows.still[where],
    )


def divided(record: Rows, count: int) -> list[Rows]:
    ends = np.linspace(0, len(record.v), count + 1).round().astype(int)
    return [part(record, slice(a, b)) for a, b in pairwise(ends)]


def blocks(rows: list[Rows]) -> list[Rows]:
    made = []
    for record in rows:
        longest = _LEAST * record.factor
        made += divided(record, max(min(_MOST, len(record.v) // longest), 1))
    return made


def folds(rows: list[Rows]) -> Iterator[tuple[list[Rows], list[Rows]]]:
    """Blocks to fit and blocks held out, by turns."""
    pieces = blocks(rows)
    turns = turn(np.arange(len(pieces)))
    for k in range(min(FOLDS, len(pieces))):
        kept = [p for p, at in zip(pieces, turns, strict=True) if at != k]
        yield kept, [p for p, at in zip(pieces, turns, strict=True) if at == k]


def chosen(rows: list[Rows]) -> Judged:
    """The simplest structure that no richer one beats on held-out data."""
    squares: dict[str, Array] = {}
    reasons: dict[str, str] = {}
    for name in STRUCTURES:
        found = held_out(rows, name)
        if isinstance(found, str):
            reasons[name] = found
        else:
            squares[name] = found
    if squares:
        judged = simplest(squares, reasons)
        ordered = {n: judged.reasons[n] for n in STRUCTURES if n in judged.reasons}
        return judged._replace(reasons=ordered)
    if reasons["viscous"] == _NEGATIVE and fitted(rows, "viscous", told=False).axis.mass < 0.0:
        raise ProblemError(
            "record",
            "the mass is negative: the force acts against the acceleration",
            "Check the signs of u, x and gain, whether x wraps, and the sample time.",
        )
    raise ProblemError(
        "record",
        "; ".join(f"{name}: {why}" for name, why in reasons.items()),
        "Record accelerated motion in both directions at several speeds.",
    )


def held_out(rows: list[Rows], name: str) -> Array | str:
    """Squared force errors of a structure in blocks held out."""
    # If the fitted blocks do not determine what a structure adds, or give it a negative sign, the
    # next simpler structure predicts the held-out ones: these may hold the only reverse or slow
    # motion.
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
    try:
        estimate = fitted(rows, name, told=False)
    except InputError:
        return _TOO_POOR
    return estimate if plausible(estimate) else _NEGATIVE


def lowered(rows: list[Rows], other: list[Rows], structure: str) -> float | None:
    """Share by which alternative records lower the force error in held-out blocks."""
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
    if part == 1.0:
        return "alone gives a positive mass and friction"
    return f"lowers the force error by {100.0 * part:.0f} % on held-out data"
