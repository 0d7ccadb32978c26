"""First-order reversal curves of a piezo stage against the play operators (Mayergoyz 1986)."""

# With plays, the width of a curve depends on its depth only. Other widths mean a loop that varies
# with position.

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.commission._piezo_loops import Loops, predicted
from macromicro.commission.stand import Record

_LEVELS = 40  # efforts at which both ways are compared
_TURNED = 1e-3  # of the range: a turning point


class Curve(NamedTuple):
    """A branch down from the top, and the first-order curve back up."""

    turn: float  # turning point, V
    # u, x, model: effort in V, position and that of the plays in m, from the top on
    u: Array
    x: Array
    model: Array
    # opening, modelled: greatest distance between both ways at one effort, and that of the plays,
    # m
    opening: float
    modelled: float


def curves(swing: Record, found: Loops, dt: float) -> list[Curve]:
    u, x, left = predicted(found, swing, dt)
    near = _TURNED * np.ptp(u)
    tops = np.flatnonzero(u >= u.max() - near)
    breaks = np.flatnonzero(np.diff(tops) > 1)
    made = []
    for k in breaks.tolist():
        part = slice(int(tops[k]), int(tops[k + 1]) + 1)
        low = int(np.argmin(u[part]))
        own, model = x[part], (x - left)[part]
        there = [_opening(u[part], values, low) for values in (own, model)]
        made.append(Curve(float(u[part][low]), u[part], own, model, *there))
    return made


def apart(every: list[Curve]) -> float:
    """Deviation of the curves' widths from the plays', over the widest."""
    widest = max((c.opening for c in every), default=0.0)
    most = max((abs(c.opening - c.modelled) for c in every), default=0.0)
    return most / widest if widest > 0.0 else 0.0


def _opening(u: Array, x: npt.NDArray[np.float64], low: int) -> float:
    """Greatest distance between the two branches, at efforts between their ends."""
    at = np.linspace(u[low], u.max(), _LEVELS + 2)[1:-1]
    down = np.interp(at, u[low::-1], x[low::-1])
    return float(np.max(np.abs(down - np.interp(at, u[low:], x[low:]))))
