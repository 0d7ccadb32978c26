"""Starting point of an axis' model: the momentum balance of each stroke."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from macromicro.arrays import Array
from macromicro.commission.stand import CommissionError, Pull, Record
from macromicro.identify.axis import Axis, late

_LAGS = 12  # whole periods of lag tried
APART = (
    "the strokes do not separate mass and friction. Check that there are strokes in both "
    "directions and that the encoder resolves them"
)


def weakest(strokes: Sequence[Record]) -> list[Record]:
    """The third with the smallest efforts, least affected by a limit."""
    return sorted(strokes, key=lambda s: np.abs(s.u).max())[: len(strokes) // 3]


def unloaded(strokes: Sequence[Record], pull: Pull) -> list[Record]:
    """Strokes less the effort that held an eccentric load."""
    return [one._replace(u=one.u - pull.along(one.x)) for one in strokes]


def begun(strokes: Sequence[Record], dt: float) -> Axis:
    """Starting point by the momentum balance, linear in the parameters.

    From rest, the integral of u is M v + Fv (x - x0) + (s Fc + F0) t; the lag is the best whole
    number of periods.
    """
    best, least = None, math.inf
    for lag in range(_LAGS + 1):
        rows = [momentum(s, lag, dt) for s in strokes]
        table = np.concatenate(rows)
        left, right = table[:, :-1], table[:, -1]
        scale = np.linalg.norm(left, axis=0)
        if not (scale > 0.0).all() or np.linalg.cond(left / scale) > 1e7:
            break
        theta = np.linalg.lstsq(left / scale, right, rcond=None)[0] / scale
        error = float(np.linalg.norm(right - left @ theta))
        if error < least:
            best, least = (theta, lag), error
    if best is None or (best[0][0] <= 0.0 and best[0][1] <= 0.0):
        raise CommissionError(APART)
    (mass, viscous, coulomb, offset), lag = best[0].tolist(), best[1]
    if mass <= 0.0:
        # So strongly damped that the encoder's steps hide its momentum: its lag is much the same.
        mass = viscous * dt
    # A lag that is no whole number of periods is found by the search that begins here.
    return Axis(mass, max(viscous, 0.0), max(coulomb, 0.0), offset, lag=max(lag, 0.1) * dt)


def momentum(stroke: Record, lag: int, dt: float) -> Array:
    """The momentum balance of a stroke from rest, a row per sample."""
    v = np.gradient(stroke.x, dt)
    way = math.copysign(1.0, stroke.x[-1] - stroke.x[0])
    pushed = late(stroke.u, float(lag))
    impulse = np.concatenate([[0.0], np.cumsum(pushed[:-1])]) * dt
    return np.stack([v, stroke.x - stroke.x[0], way * stroke.t, stroke.t, impulse], axis=1)
