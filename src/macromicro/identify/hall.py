"""Hall calibration (Section 3.2.3, Figure 3.9): sensor volts against the laser's position."""

# Slow ramps of CTRL up and down are averaged, which cancels the sensor's lag, and made monotone.

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.ndimage import uniform_filter1d

from macromicro.arrays import Array
from macromicro.control.calibration import Calibration
from macromicro.errors import ProblemError
from macromicro.identify.clusters import within

PIECES = (2, 3, 4, 6, 8, 10, 12, 14, 16, 20, 24, 30, 40, 60)
# Steps finer than what foretells best: that one has bias too, the interval has only scatter.
FINER = 2
BINS = 2000  # of the runs' range
LEAST = 50  # bins that a run must have
SPEED = 0.001  # of a run: half the window of its speed
REST = 5.0  # standard deviations of the noise: as near to its ends a run may be at rest


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
    return _average(grid, _tables(runs, grid))


def fit_table(
    runs: Sequence[tuple[Array, Array]], low: float = 0.0, high: float = 5.0, points: int = 126
) -> HallFit:
    if len(runs) < 2:
        raise ProblemError("Hall calibration", "there are fewer than two runs", "Give two or more.")
    grid = np.linspace(low, high, points)
    tables = _tables(runs, grid)
    made = _average(grid, tables)
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


def _average(grid: Array, tables: Array) -> Calibration:
    """Mean of the runs' tables, extended at the ends and made monotone."""
    seen = np.asarray(np.isfinite(tables).all(axis=0))
    _check_covered(seen, "Hall calibration")
    return _extend(grid, seen, tables[:, seen].mean(axis=0))


def _check_covered(seen: NDArray[np.bool_], where: str) -> None:
    if seen.sum() < len(seen) // 2:
        remedy = "Record runs in both directions over at least half of the sensor's range."
        raise ProblemError(where, f"only {seen.sum()} of {len(seen)} voltages are covered", remedy)


class SplineFit(NamedTuple):
    # the table. `error` is of what differs between the runs: what they share, as the reference's
    # zero and scale, they cannot show. `std` is that of one run, and `between` half of what the
    # lag puts between a mean rising and a mean falling run
    fit: HallFit
    wide: float  # standard errors in half an interval of 95 %: Student's t for the number of runs
    lag: float  # the sensor's, in readings
    lag_error: float  # standard error, in readings
    residual: float  # of a run's bin off table and lag, RMS, m
    pieces: int  # of the spline


class _Run(NamedTuple):
    """A run in bins of voltage: means of voltage, position and speed (m a reading)."""

    volts: Array
    place: Array
    speed: Array


class _Fit(NamedTuple):
    """Coefficients and lag of a spline; `missed` are squared prediction errors."""

    knots: Array
    all: Array
    others: Array
    missed: float
    residual: float


# The mean of rising and falling runs cancels the lag only at equal speeds, which hysteresis
# prevents. The spline is smooth by having few pieces, their number chosen by cross-validation over
# runs; each run counts as one observation. A penalty on third differences gave a table worse by
# half.
def fit_spline(
    runs: Sequence[tuple[Array, Array]], low: float = 0.0, high: float = 5.0, points: int = 126
) -> SplineFit:
    """Position over sensor voltage, by a smoothing spline and a lag."""
    ways = [laser[-1] > laser[0] for _, laser in runs]
    if not 2 <= sum(ways) <= len(runs) - 2:
        counted = f"rising and falling runs number {sum(ways)} and {len(runs) - sum(ways)}"
        raise ProblemError("Hall calibration by a spline", counted, "Give two or more of each.")
    # Where one run is missing the others must still bear the table.
    rests = REST * max(_noise(v) for v, _ in runs)
    start = sorted(np.min(v) for v, _ in runs)[-2] + rests
    end = sorted(np.max(v) for v, _ in runs)[1] - rests
    binned = [_bin(v, x, start, end) for v, x in runs]
    grid = np.linspace(low, high, points)
    inside = (grid >= start) & (grid <= end)
    _check_covered(inside, "Hall calibration by a spline")
    tried = [_fit_bins(binned, _knots(start, end, pieces)) for pieces in PIECES]
    best = min(range(len(tried)), key=lambda k: tried[k].missed)
    fit = tried[min(best + FINER, len(tried) - 1)]
    found, others, knots = fit.all, fit.others, fit.knots
    off = others - others.mean(axis=0)
    share = (len(runs) - 1.0) / len(runs)
    covariance = share * off.T @ off
    at = BSpline.design_matrix(grid[inside], knots, 3).toarray()
    error = np.full(points, np.nan)
    error[inside] = np.sqrt(np.einsum("ij,jk,ik->i", at, covariance[:-1, :-1], at))
    speeds = np.array([np.interp(grid[inside], run.volts, run.speed) for run in binned])
    up = np.array(ways)
    between = np.full(points, np.nan)
    between[inside] = 0.5 * found[-1] * (speeds[up].mean(axis=0) - speeds[~up].mean(axis=0))
    table = _extend(grid, inside, at @ found[:-1])
    made = HallFit(table, grid, np.sqrt(len(runs)) * error, error, between, len(runs))
    wide, lag_error = within(len(runs) - 1), float(np.sqrt(covariance[-1, -1]))
    return SplineFit(made, wide, float(found[-1]), lag_error, fit.residual, len(knots) - 7)


def _noise(volts: Array) -> float:
    """Standard deviation of the readings' noise, by second differences."""
    return float(np.std(np.diff(volts, 2)) / np.sqrt(6.0))


def _bin(volts: Array, place: Array, start: float, end: float) -> _Run:
    """Means of a run in bins of voltage, so that slow parts do not outweigh fast ones."""
    half = max(round(SPEED * len(volts)), 1)
    later = np.minimum(np.arange(len(place)) + half, len(place) - 1)
    sooner = np.maximum(np.arange(len(place)) - half, 0)
    # Means of both sides' readings, not two single ones: the reference's noise is in them.
    smooth = uniform_filter1d(place, 2 * half + 1, mode="nearest")
    speed = (smooth[later] - smooth[sooner]) / (later - sooner)
    # Near the ends the means stand still: the nearest whole window's speed.
    whole = slice(2 * half, max(len(place) - 2 * half, 2 * half + 1))
    speed[: whole.start], speed[whole.stop :] = speed[whole][0], speed[whole][-1]
    kept = (volts >= start) & (volts <= end)
    which = np.floor((volts[kept] - start) / max(end - start, 1e-9) * BINS)
    _, place_of, n = np.unique(which, return_inverse=True, return_counts=True)
    if len(n) < LEAST:
        found = f"a run has {len(n)} of at least {LEAST} voltages in the range that all share"
        raise ProblemError("Hall calibration by a spline", found, "Record slower runs.")
    means = (np.bincount(place_of, x[kept]) / n for x in (volts, place, speed))
    return _Run(*means)


def _knots(start: float, end: float, pieces: int) -> Array:
    return np.concatenate([[start] * 3, np.linspace(start, end, pieces + 1), [end] * 3])


def _fit_bins(runs: list[_Run], knots: Array) -> _Fit:
    """Least squares over the bins of all runs, and of all but one."""
    rows = [
        np.column_stack([BSpline.design_matrix(run.volts, knots, 3).toarray(), run.speed])
        for run in runs
    ]
    # A speed is some 1e-7 m a reading: with a unit of its own the matrix is well conditioned.
    unit = np.ones(rows[0].shape[1])
    unit[-1] = max(np.sqrt(np.mean([np.mean(run.speed**2) for run in runs])), 1e-300)
    scaled = [row / unit for row in rows]
    matrices = np.array([row.T @ row for row in scaled])
    rights = np.array([row.T @ run.place for row, run in zip(scaled, runs, strict=True)])
    matrix, right = matrices.sum(axis=0), rights.sum(axis=0)
    found = _solve(matrix, right) / unit
    others = np.array(
        [_solve(matrix - m, right - r) / unit for m, r in zip(matrices, rights, strict=True)]
    )
    missed = sum(
        float(np.mean((run.place - row @ other) ** 2))
        for run, row, other in zip(runs, rows, others, strict=True)
    )
    rest = np.concatenate([run.place - row @ found for run, row in zip(runs, rows, strict=True)])
    return _Fit(knots, found, others, missed, float(np.sqrt(np.mean(rest**2))))


def _solve(matrix: Array, right: Array) -> Array:
    """Minimum-norm least squares, for pieces without readings."""
    return np.asarray(np.linalg.lstsq(matrix, right, rcond=1e-12)[0], np.float64)


def _extend(grid: Array, inside: NDArray[np.bool_], place: Array) -> Calibration:
    """The table, extended at the ends with its last slope and made monotone."""
    step = grid[1] - grid[0]
    first, last = np.flatnonzero(inside)[[0, -1]]
    full = np.interp(grid, grid[inside], place)
    full[:first] += (grid[:first] - grid[first]) * (full[first + 1] - full[first]) / step
    full[last + 1 :] += (grid[last + 1 :] - grid[last]) * (full[last] - full[last - 1]) / step
    return Calibration(float(grid[0]), float(step), np.maximum.accumulate(full))
