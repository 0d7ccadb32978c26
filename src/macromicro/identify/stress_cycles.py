"""What one load shows: heating and cooling branch, as temperatures at which shares are done."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.hysteresis.diagnostics import reversals

SHARES = np.linspace(0.01, 0.99, 50)
_WHOLE = 0.8  # of a load's range of temperatures: a shorter branch is a minor one
_ENDS = 0.03  # of that range: over which the levels are taken
_BINS = 400
_SWING = 0.1  # of the range: a smaller turn is noise


class Branch(NamedTuple):
    """One load's way up or down.

    Attributes
    ----------
    low, high : float
        Cold and hot level, unit of the output.
    temperatures : ndarray, shape (q,)
        Where the shares `SHARES` of the way from low to high are done, degC.
    """

    low: float
    high: float
    temperatures: Array


class Cycle(NamedTuple):
    """What one load showed.

    Attributes
    ----------
    load : float
        Stress or force, held.
    heating, cooling : Branch
        The mean of its whole branches.
    t, y : ndarray, shape (n,)
        Temperature and output as measured.
    """

    load: float
    heating: Branch
    cooling: Branch
    t: Array
    y: Array


def cycle(load: float, t: npt.ArrayLike, y: npt.ArrayLike, where: str = "record") -> Cycle:
    """Branches of a record under one load.

    Parameters
    ----------
    load : float
        Held.
    t : array_like, shape (n,)
        Temperatures in time order, degC.
    y : array_like, shape (n,)
        Strain or position.
    where : str, optional
        Name, for messages.

    Returns
    -------
    Cycle
        The mean of its whole branches each way.

    Raises
    ------
    InputError
        It lacks a whole branch of either way, or its output does not change.
    """
    tt, yy = np.asarray(t, np.float64), np.asarray(y, np.float64)
    extent = float(np.ptp(tt))
    kept: dict[bool, list[tuple[Array, Array]]] = {True: [], False: []}
    for start, end, rising in pieces(tt):
        part = slice(start, end)
        if np.ptp(tt[part]) >= _WHOLE * extent > 0.0:
            kept[rising].append((tt[part], yy[part]))
    for rising, name in ((True, "heating"), (False, "cooling")):
        if not kept[rising]:
            accepted = "whole heating and cooling at each load, from end to end of its temperatures"
            raise InputError(where, f"no whole {name} at a load of {load:g}", accepted)
    lowest, highest = float(tt.min()), float(tt.max())
    whole = [*kept[True], *kept[False]]
    own, output = (np.concatenate([part[k] for part in whole]) for k in (0, 1))
    ends = [float(np.mean(output[np.abs(own - at) <= _ENDS * extent])) for at in (lowest, highest)]
    if ends[0] == ends[1]:
        raise InputError(where, f"{ends[0]:g} cold and hot", "an output that changes with heat")
    sides = [_branch(kept[rising], ends, lowest, highest) for rising in (True, False)]
    return Cycle(float(load), sides[0], sides[1], tt, yy)


def pieces(t: Array) -> list[tuple[int, int, bool]]:
    """Branches of a way.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Temperatures in time order, degC.

    Returns
    -------
    list[tuple[int, int, bool]]
        First sample, the one behind the last, and whether the temperature rises.
    """
    turns = [0, *(int(k) for k in reversals(t, _SWING * float(np.ptp(t)))), len(t) - 1]
    found = []
    for a, b in pairwise(turns):
        if b > a:
            found.append((a, b + 1 if b == len(t) - 1 else b, bool(t[b] > t[a])))
    return found


def _branch(
    parts: Sequence[tuple[Array, Array]], ends: Sequence[float], lowest: float, highest: float
) -> Branch:
    """The mean of some branches, as temperatures of its shares."""
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
        raise InputError("branch", "one level alone", "an output that changes with temperature")
    return Branch(low, high, np.interp(SHARES, shares, places))
