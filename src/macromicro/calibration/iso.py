"""Figures of ISO 230-2: accuracy and repeatability of positioning."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array


class Means(NamedTuple):
    """Deviations at each position: mean and standard deviation, from below and from above."""

    place: Array  # m
    up: Array  # m
    down: Array
    up_scatter: Array
    down_scatter: Array


class Figures(NamedTuple):
    """In the standard's symbols, m (or rad)."""

    A: float  # bidirectional accuracy
    A_up: float  # unidirectional accuracy from below
    A_down: float
    E: float  # bidirectional systematic deviation
    M: float  # range of the mean bidirectional deviation
    R: float  # bidirectional repeatability
    R_up: float  # unidirectional repeatability from below
    R_down: float
    B: float  # reversal value
    B_mean: float  # mean reversal value


MEANINGS = {
    "A": "bidirectional accuracy",
    "A_up": "accuracy from below",
    "A_down": "accuracy from above",
    "E": "bidirectional systematic deviation",
    "M": "range of the mean bidirectional deviation",
    "R": "bidirectional repeatability",
    "R_up": "repeatability from below",
    "R_down": "repeatability from above",
    "B": "reversal value",
    "B_mean": "mean reversal value",
}
SYMBOLS = {"A_up": "A↑", "A_down": "A↓", "R_up": "R↑", "R_down": "R↓", "B_mean": "B̄"}


def means(target: Array, direction: Array, deviation: Array) -> Means:
    """Means over the runs at each position."""
    places = np.unique(target)
    rows = []
    for place in places:
        row = [float(place)]
        for way in (1.0, -1.0):
            own = deviation[(target == place) & (direction == way)]
            row += [float(own.mean()), float(own.std(ddof=1)) if len(own) > 1 else 0.0]
        rows.append(row)
    place, up, up_scatter, down, down_scatter = np.array(rows).T
    return Means(place, up, down, up_scatter, down_scatter)


def figures(found: Means) -> Figures:
    """The figures, by the standard's formulas with a coverage factor of 2."""
    _, up, down, s_up, s_down = found
    both, reversal = 0.5 * (up + down), up - down
    highest = np.maximum(up + 2.0 * s_up, down + 2.0 * s_down)
    lowest = np.minimum(up - 2.0 * s_up, down - 2.0 * s_down)
    repeats = np.maximum(2.0 * s_up + 2.0 * s_down + np.abs(reversal), 4.0 * s_up)
    return Figures(
        A=float(highest.max() - lowest.min()),
        A_up=float((up + 2.0 * s_up).max() - (up - 2.0 * s_up).min()),
        A_down=float((down + 2.0 * s_down).max() - (down - 2.0 * s_down).min()),
        E=float(np.maximum(up, down).max() - np.minimum(up, down).min()),
        M=float(both.max() - both.min()),
        R=float(np.maximum(repeats, 4.0 * s_down).max()),
        R_up=float(4.0 * s_up.max()),
        R_down=float(4.0 * s_down.max()),
        B=float(np.abs(reversal).max()),
        B_mean=float(reversal.mean()),
    )
