"""First-order reversal curves of a piezo stage beside the plays that were found.

From the top the effort falls to a turning point and rises to the top again (Mayergoyz 1986). Plays
give loops of one shape at all places: what such a curve opens depends on how deep it went alone. A
stage whose curves open otherwise has a loop that is not the same everywhere.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.commission.piezo_loops import Loops, predicted
from macromicro.commission.stand import Record

_LEVELS = 40  # efforts at which both ways are compared
_TURNED = 1e-3  # of the range: a turning point


class Curve(NamedTuple):
    """A way down from the top, and the first-order curve back up.

    Attributes
    ----------
    turn : float
        Where it turned, V.
    u, x, model : ndarray, shape (n,)
        Effort in V, position and that of the plays in m, from the top on.
    opening, modelled : float
        Greatest distance between both ways at one effort, and that of the plays, m.
    """

    turn: float
    u: Array
    x: Array
    model: Array
    opening: float
    modelled: float


def curves(swing: Record, found: Loops, dt: float) -> list[Curve]:
    """The curves of a record.

    Parameters
    ----------
    swing : Record
        Slow; it goes to both ends of the range first.
    found : Loops
        The plays.
    dt : float
        Control period, s.

    Returns
    -------
    list[Curve]
        In their order; none where the effort does not come back to the top.
    """
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
    """By how much curves open otherwise than the plays, of what the widest opens.

    Parameters
    ----------
    every : list[Curve]
        Of a record.

    Returns
    -------
    float
        0 where there are none.
    """
    widest = max((c.opening for c in every), default=0.0)
    most = max((abs(c.opening - c.modelled) for c in every), default=0.0)
    return most / widest if widest > 0.0 else 0.0


def _opening(u: Array, x: npt.NDArray[np.float64], low: int) -> float:
    """Greatest distance between the way down and the way up, at efforts between their ends."""
    at = np.linspace(u[low], u.max(), _LEVELS + 2)[1:-1]
    down = np.interp(at, u[low::-1], x[low::-1])
    return float(np.max(np.abs(down - np.interp(at, u[low:], x[low:]))))
