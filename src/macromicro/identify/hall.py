"""Hall calibration (Section 3.2.3, Figure 3.9): sensor volts against the laser's position."""

# Slow ramps of CTRL up and down are averaged, which cancels the sensor's lag, and made monotone.

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.control.calibration import Calibration
from macromicro.errors import ProblemError


class HallFit(NamedTuple):
    """A calibration with its uncertainty; NaN beyond the runs."""

    calibration: Calibration  # the table
    volts: Array  # V
    std: Array  # standard deviation of one run from the mean of all, m
    error: Array  # that of the mean, m
    # half the difference between the mean of the rising and that of the falling runs, which is
    # lag, m
    between: Array
    runs: int  # their number


def calibrate(
    runs: Sequence[tuple[Array, Array]], low: float = 0.0, high: float = 5.0, points: int = 126
) -> Calibration:
    """Table of position over Hall voltage (Section 3.2.3, Figure 3.9).

    Lines are fitted around every grid voltage (half a grid step to both sides, two steps where the
    sensor moved fast) and averaged over runs; the ends continue with the last slope.

    Parameters
    ----------
    runs : Sequence[tuple[Array, Array]]
        Pairs of Hall voltage (V) and laser position (m), shape (n,) each. Each run goes one way;
        give as many in either direction.
    low, high : float, optional
        Voltages of the table's ends, V.
    points : int, optional
        Number of voltages in the table.

    Returns
    -------
    Calibration
        Position (m) over voltage (V).

    Raises
    ------
    InputError
        The runs cover less than half of the range.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.identify import calibrate
    >>> volts = np.linspace(0.0, 5.0, 2001)
    >>> up, down = 1e-3 * volts, 1e-3 * volts + 2e-5  # m; the sensor lags by 10 um either way
    >>> table = calibrate([(volts, up), (volts[::-1], down[::-1])], points=6)
    >>> table.position.round(6)  # m at 0, 1, ... 5 V
    array([1.00e-05, 1.01e-03, 2.01e-03, 3.01e-03, 4.01e-03, 5.01e-03])
    """
    grid = np.linspace(low, high, points)
    return _averaged(grid, _tables(runs, grid))


def calibrated(
    runs: Sequence[tuple[Array, Array]], low: float = 0.0, high: float = 5.0, points: int = 126
) -> HallFit:
    if len(runs) < 2:
        raise ProblemError("Hall calibration", "there are fewer than two runs", "Give two or more.")
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
    """Position [m] at the grid's voltages, (runs, points); NaN with too few readings."""
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
    """Mean of the runs' tables, extended at the ends and made monotone."""
    points, step = len(grid), grid[1] - grid[0]
    with np.errstate(invalid="ignore"):
        seen = np.isfinite(tables).all(axis=0)
    if seen.sum() < points // 2:
        raise ProblemError(
            "Hall calibration",
            f"only {seen.sum()} of {points} voltages are covered",
            "Record runs in both directions over at least half of the sensor's range.",
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
