"""Stiction, chatter and agreement, as Section 4.3 reads them from a run of the macro-stage."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.design.steps import DT, rise_time

RAMP = 1.0  # V


class Stuck(NamedTuple):
    """Stiction off the target while the effort ramps towards it."""

    seconds: float
    begin: float  # effort [V]
    end: float  # effort [V]
    back: bool  # it then moves towards the target, against its earlier direction


def sticking(x: Array, motor: Array, target: float, below: float) -> Stuck | None:
    """The longest stiction after the rise (98 %), or None.

    `x` stays the same count off `target` while the effort [V] ramps by `RAMP` or more in the
    direction of the error, below `below` [V].
    """
    rise = rise_time(x, target)
    if math.isnan(rise):
        return None
    first = round(rise / DT)
    edges = np.concatenate([[first], first + np.flatnonzero(np.diff(x[first:])) + 1, [len(x)]])
    found: list[Stuck] = []
    for a, b in pairwise(int(e) for e in edges):
        way = float(np.sign(target - x[a]))
        # The sample of a new count has the kick of the derivative.
        part = motor[a + 1 : b]
        if way == 0.0 or not len(part) or float(np.abs(part).max()) >= below:
            continue
        if way * (part[-1] - part[0]) < RAMP or float((way * np.diff(part)).min(initial=0.0)) < 0.0:
            continue
        turned = way * np.sign(target - x[0]) < 0.0
        moved = b < len(x) and way * (x[b] - x[a]) > 0.0
        pushed = way * part[-1] > 0.0
        back = bool(turned and moved and pushed)
        found.append(Stuck(len(part) * DT, float(part[0]), float(part[-1]), back))
    return max(found, key=lambda s: s.seconds, default=None)


def sign_changes(motor: Array) -> int:
    """Number of sign changes of the effort, without zeros."""
    signs = np.sign(motor[motor != 0.0])
    return int(np.count_nonzero(np.diff(signs)))


def nrmse(model: Array, measured: Array) -> float:
    """RMS difference over the range of `measured` [%]."""
    return 100.0 * float(np.sqrt(np.mean((model - measured) ** 2)) / np.ptp(measured))
