"""Rise, settling, overshoot and swings of a step of the macro-stage.

Positions `x` and targets in counts, a sample each control period.
"""

from __future__ import annotations

import math

import numpy as np

from macromicro.arrays import Array
from macromicro.nominal import PERIOD

DT = PERIOD
ARRIVED = 2.0  # counts; the tolerance of the default sequence


def rise_time(x: Array, target: float) -> float:
    """Time until a move from x[0] first covers 98 % of the distance."""
    gone = (x - x[0]) / (target - x[0])
    return float(np.argmax(gone >= 0.98)) * DT if gone.max() >= 0.98 else math.nan


def settling_time(x: Array, target: float, share: float = 0.02) -> float:
    """Time from which on the error stays within a share of the move."""
    outside = np.flatnonzero(np.abs(target - x) > share * abs(target - x[0]))
    row = int(outside[-1]) + 1 if len(outside) else 0
    return row * DT if row < len(x) else math.nan


def overshoot(x: Array, target: float) -> float:
    """Distance beyond a target in the direction of the move."""
    return max(0.0, float((np.sign(target - x[0]) * (x - target)).max()))


def swings(x: Array, target: float, band: float = ARRIVED) -> Array:
    """Sizes of the swings after arrival, one per reversal of the position."""
    near = np.abs(target - x) <= band
    if not near.any():
        return np.zeros(0)
    row = int(near.argmax())
    moved = np.diff(x[max(row - 1, 0) :])
    moved = moved[moved != 0.0]
    if not len(moved):
        return np.zeros(0)
    edges = np.flatnonzero(np.diff(np.sign(moved))) + 1
    return np.abs([float(part.sum()) for part in np.split(moved, edges)[1:]])
