"""Contour error in the plane."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.machines.joint.planning import Trace


class Off(NamedTuple):
    distance: Array  # from the nearest point of the path, m
    # x, y: that point, m
    x: Array
    y: Array


def contour_error(trace: Trace, x: Array, y: Array) -> Off:
    """Contour error of places, one each control period, near the set point's part of the path."""
    n = len(x)
    s = trace.s[np.minimum(np.arange(n), len(trace.s) - 1)]
    best, near_x, near_y = np.full(n, np.inf), np.empty(n), np.empty(n)
    window = _window(trace, x, y, s)
    low, high = trace.border[:-1] - window, trace.border[1:] + window
    first, last = np.searchsorted(s, low, side="left"), np.searchsorted(s, high, side="right")
    for piece, a, b in zip(trace.pieces, first.tolist(), last.tolist(), strict=True):
        px, py = piece.at(piece.nearest(x[a:b], y[a:b]))
        far = np.hypot(x[a:b] - px, y[a:b] - py)
        nearer = far < best[a:b]
        best[a:b][nearer] = far[nearer]
        near_x[a:b][nearer], near_y[a:b][nearer] = px[nearer], py[nearer]
    return Off(best, near_x, near_y)


def _window(trace: Trace, x: Array, y: Array, s: Array) -> float:
    """Range of the path in which to search: twice the largest distance from the set point."""
    k = np.clip(np.searchsorted(trace.border, s, side="right") - 1, 0, len(trace.pieces) - 1)
    farthest = 0.0
    for number in np.unique(k):
        rows = k == number
        px, py = trace.pieces[number].at(s[rows] - trace.border[number])
        farthest = max(farthest, float(np.max(np.hypot(x[rows] - px, y[rows] - py))))
    return 2.0 * farthest
