"""Hall calibration (Section 3.2.3, Figure 3.9): sensor volts against the laser's position.

CTRL ramps slowly up and down; readings of both directions are averaged, which cancels
the sensor's lag, and made monotone.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.control.calibration import Calibration
from macromicro.errors import InputError


class HallFit(NamedTuple):
    """A calibration with its uncertainty, at the table's voltages, NaN beyond the runs.

    Attributes
    ----------
    calibration : Calibration
        The table.
    volts : ndarray, shape (points,)
        V.
    std : ndarray, shape (points,)
        Standard deviation of one run from the mean of all, m.
    error : ndarray, shape (points,)
        That of the mean, m.
    between : ndarray, shape (points,)
        Half the difference between the mean of the rising and that of the falling runs, which is
        lag, m.
    runs : int
        Their number.
    """

    calibration: Calibration
    volts: Array
    std: Array
    error: Array
    between: Array
    runs: int


def calibrate(
    runs: Sequence[tuple[Array, Array]], low: float = 0.0, high: float = 5.0, points: int = 126
) -> Calibration:
    """Table of position over Hall voltage (Section 3.2.3, Figure 3.9).

    In each run a straight line is fitted around every grid voltage (half a grid step to both sides,
    two steps where the sensor moved fast); runs are averaged, gaps at the ends are extended with
    the last slope.

    Parameters
    ----------
    runs : Sequence[tuple[Array, Array]]
        Pairs of Hall voltage (V) and laser position (m), shape (n,) each. Each run goes one way
        only; runs of both directions should be given in equal number.
    low, high : float, optional
        Voltages of the table's ends, V.
    points : int, optional
        Number of the table's voltages.

    Returns
    -------
    Calibration
        Position (m) over voltage (V).

    Raises
    ------
    InputError
        The runs cover less than half of the range.
    """
    grid = np.linspace(low, high, points)
    return _averaged(grid, _tables(runs, grid))


def calibrated(
    runs: Sequence[tuple[Array, Array]], low: float = 0.0, high: float = 5.0, points: int = 126
) -> HallFit:
    """`calibrate`, and how far the runs agree.

    Parameters
    ----------
    runs : Sequence[tuple[Array, Array]]
        As for `calibrate`, two or more.
    low, high : float, optional
        Voltages of the table's ends, V.
    points : int, optional
        Number of the table's voltages.

    Returns
    -------
    HallFit
        The table with its uncertainty.

    Raises
    ------
    InputError
        Fewer than two runs, or as for `calibrate`.
    """
    if len(runs) < 2:
        raise InputError("Hall calibration", f"{len(runs)} runs", "two runs or more")
    grid = np.linspace(low, high, points)
    tables = _tables(runs, grid)
    made = _averaged(grid, tables)
    std = tables.std(axis=0, ddof=1)
    up = np.array([laser[-1] > laser[0] for _, laser in runs])
    between = np.full(points, np.nan)
    if up.any() and not up.all():
        between = 0.5 * (tables[up].mean(axis=0) - tables[~up].mean(axis=0))
    return HallFit(made, grid, std, std / np.sqrt(len(runs)), between, len(runs))


def _tables(runs: Sequence[tuple[Array, Array]], grid: Array) -> Array:
    """Position [m] at the grid's voltages by each run, shape (runs, points), NaN where the
    run has too few readings."""
    step = grid[1] - grid[0]
    tables = np.full((len(runs), len(grid)), np.nan)
    for row, (hall, laser) in enumerate(runs):
        order = np.argsort(hall, kind="stable")
        volts, place = np.asarray(hall)[order], np.asarray(laser)[order]
        for i, centre in enumerate(grid):
            for reach in (0.5 * step, step, 2.0 * step):
                a, b = np.searchsorted(volts, [centre - reach, centre + reach])
                inside = volts[a:b]
                if b - a >= 8 and inside[-1] > centre > inside[0]:
                    _slope, level = np.polyfit(inside - centre, place[a:b], 1)
                    tables[row, i] = level
                    break
    return tables


def _averaged(grid: Array, tables: Array) -> Calibration:
    """The mean of the runs' tables, extended at the ends and made monotone."""
    points, step = len(grid), grid[1] - grid[0]
    with np.errstate(invalid="ignore"):
        seen = np.isfinite(tables).all(axis=0)
    if seen.sum() < points // 2:
        raise InputError(
            "Hall calibration",
            f"{seen.sum()} of {points} voltages covered",
            "runs in both directions over at least half of the sensor's range",
        )
    mean = np.full(points, np.nan)
    mean[seen] = tables[:, seen].mean(axis=0)
    first, last = np.flatnonzero(seen)[[0, -1]]
    inner = np.interp(grid, grid[seen], mean[seen])
    inner[:first] = (
        inner[first] + (grid[:first] - grid[first]) * (inner[first + 1] - inner[first]) / step
    )
    inner[last + 1 :] = (
        inner[last] + (grid[last + 1 :] - grid[last]) * (inner[last] - inner[last - 1]) / step
    )
    return Calibration(float(grid[0]), float(step), np.maximum.accumulate(inner))
