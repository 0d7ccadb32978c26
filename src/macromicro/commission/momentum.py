"""Where the search for an axis' model begins: the balance of momentum over each stroke."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from macromicro.arrays import Array
from macromicro.commission.stand import CommissionError, Pull, Record
from macromicro.identify.axis import Axis, late

_LAGS = 12  # whole periods of lag tried
APART = (
    "the strokes do not tell mass and friction apart: are there strokes in both directions, and "
    "does the encoder resolve them?"
)


def weakest(strokes: Sequence[Record]) -> list[Record]:
    """The third with the smallest efforts: what they show is the least touched by a limit.

    Parameters
    ----------
    strokes : Sequence[Record]
        All of them.

    Returns
    -------
    list[Record]
        In the order of their efforts.
    """
    return sorted(strokes, key=lambda s: np.abs(s.u).max())[: len(strokes) // 3]


def unloaded(strokes: Sequence[Record], pull: Pull) -> list[Record]:
    """Strokes without what held an eccentric load.

    Parameters
    ----------
    strokes : Sequence[Record]
        Their efforts with it.
    pull : Pull
        What held it, by their places.

    Returns
    -------
    list[Record]
        Their efforts beside it, V.
    """
    return [one._replace(u=one.u - pull.along(one.x)) for one in strokes]


def begun(strokes: Sequence[Record], dt: float) -> Axis:
    """Where the search begins: the momentum's balance, linear in the parameters.

    From rest, the integral of u is M v + Fv (x - x0) + (s Fc + F0) t. The lag is the whole number
    of periods under which that holds best.

    Parameters
    ----------
    strokes : Sequence[Record]
        Each from rest.
    dt : float
        Control period, s.

    Returns
    -------
    Axis
        In V and m.

    Raises
    ------
    CommissionError
        The strokes do not tell mass and friction apart.
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
    """The balance of momentum of a stroke from rest, a row per sample.

    Parameters
    ----------
    stroke : Record
        From rest.
    lag : int
        Periods by which the effort acts late.
    dt : float
        Control period, s.

    Returns
    -------
    ndarray, shape (n, 5)
        Speed, way, direction times time, time; and the integral of the effort, V s.
    """
    v = np.gradient(stroke.x, dt)
    way = math.copysign(1.0, stroke.x[-1] - stroke.x[0])
    pushed = late(stroke.u, float(lag))
    impulse = np.concatenate([[0.0], np.cumsum(pushed[:-1])]) * dt
    return np.stack([v, stroke.x - stroke.x[0], way * stroke.t, stroke.t, impulse], axis=1)
