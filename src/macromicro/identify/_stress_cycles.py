"""Heating and cooling branch of one load, as temperatures of shares of the stroke."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import ProblemError
from macromicro.hysteresis.diagnostics import reversals

SHARES = np.linspace(0.01, 0.99, 50)
_WHOLE = 0.8  # of a load's range of temperatures: a shorter branch is a minor one
_ENDS = 0.03  # of that range: over which the levels are taken
_BINS = 400
_SWING = 0.1  # of the range: a smaller turn is noise


class Branch(NamedTuple):
    # low, high: cold and hot level, unit of the output
    low: float
    high: float
    temperatures: Array  # at the shares `SHARES` of the way from low to high, degC


class Cycle(NamedTuple):
    load: float  # stress or force, held
    # heating, cooling: the mean of its whole branches
    heating: Branch
    cooling: Branch
    # t, y: temperature and output as measured
    t: Array
    y: Array


def cycle(load: float, t: npt.ArrayLike, y: npt.ArrayLike, where: str = "record") -> Cycle:
    """Branches of a record under one load; `t` in degC."""
    tt, yy = np.asarray(t, np.float64), np.asarray(y, np.float64)
    extent = float(np.ptp(tt))
    kept: dict[bool, list[tuple[Array, Array]]] = {True: [], False: []}
    for start, end, rising in pieces(tt):
        part = slice(start, end)
        if np.ptp(tt[part]) >= _WHOLE * extent > 0.0:
            kept[rising].append((tt[part], yy[part]))
    for rising, name in ((True, "heating"), (False, "cooling")):
        if not kept[rising]:
            raise ProblemError(
                where,
                f"there is no complete {name} at a load of {load:g}",
                "Record whole heating and cooling cycles at each load.",
            )
    lowest, highest = float(tt.min()), float(tt.max())
    whole = [*kept[True], *kept[False]]
    own, output = (np.concatenate([part[k] for part in whole]) for k in (0, 1))
    ends = [float(np.mean(output[np.abs(own - at) <= _ENDS * extent])) for at in (lowest, highest)]
    if ends[0] == ends[1]:
        raise ProblemError(
            where,
            f"the output is {ends[0]:g} both cold and hot",
            "Record an output that changes with temperature.",
        )
    sides = [_branch(kept[rising], ends, lowest, highest) for rising in (True, False)]
    return Cycle(float(load), sides[0], sides[1], tt, yy)


def pieces(t: Array) -> list[tuple[int, int, bool]]:
    """Monotone branches of a temperature record, degC."""
    turns = [0, *(int(k) for k in reversals(t, _SWING * float(np.ptp(t)))), len(t) - 1]
    found = []
    for a, b in pairwise(turns):
        if b > a:
            found.append((a, b + 1 if b == len(t) - 1 else b, bool(t[b] > t[a])))
    return found


def _branch(
    parts: Sequence[tuple[Array, Array]], ends: Sequence[float], lowest: float, highest: float
) -> Branch:
    """Mean of branches, as temperatures of its shares."""
    from scipy.optimize import isotonic_regression

    low, high = ends
    grid = np.linspace(lowest, highest, _BINS + 1)
    t, y = (np.concatenate([p[k] for p in parts]) for k in (0, 1))
    which = np.clip(np.digitize(t, grid) - 1, 0, _BINS - 1)
    count = np.bincount(which, minlength=_BINS)
    there = count > 0
    mean = np.bincount(which, y, minlength=_BINS)[there] / count[there]
    own = np.bincount(which, t, minlength=_BINS)[there] / count[there]
    share = (mean - low) / (high - low)
    rising = np.asarray(isotonic_regression(share, weights=count[there]).x, np.float64)
    # Of equal shares the middle temperature: np.interp wants them to rise.
    steps = np.flatnonzero(np.diff(rising) > 0.0) + 1
    groups = np.split(np.arange(len(rising)), steps)
    shares = np.array([rising[g[0]] for g in groups])
    places = np.array([own[g].mean() for g in groups])
    if len(shares) < 2:
        raise ProblemError(
            "branch",
            "the output has only one level",
            "Record an output that changes with temperature.",
        )
    return Branch(low, high, np.interp(SHARES, shares, places))
