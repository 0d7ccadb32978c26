"""Heating and cooling of a wire from steps: temperatures by position, (5.2), (5.6) and (5.9)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.hysteresis.table import FodTable
from macromicro.identify import clusters
from macromicro.identify.clusters import within
from macromicro.identify.notices import ConvergenceWarning, notice
from macromicro.identify.records import signal
from macromicro.identify.search import least_squares
from macromicro.models.heating import Ladder, Modes, ladder, step_response
from macromicro.models.weighted_gain import Exponential
from macromicro.recording import Recording

AMBIENT = 25.0  # deg C

# A temperature whose band is wider than this [K] says next to nothing.
WIDEST_BAND = 6.0
_POSITION = 0.006  # standard error of the reading and of the table, mm
# The same of the thermometer that the table was made with, as it stands for the wires, K.
_TEMPERATURE = 0.3
_BLOCKS = 6  # parts of a step, even in log time, that errors are judged by


class Inferred(NamedTuple):
    """Temperatures with a band of two standard errors."""

    temperature: Array  # deg C
    low: Array  # lower end of the band, deg C; in saturation it reaches to the end of the table
    high: Array  # upper end, deg C
    slope: Array  # slope of the branch, mm/K: what a kelvin of error is worth in position


def on_heating(table: FodTable, x: npt.ArrayLike) -> Inferred:
    """Temperatures along the rising branch of the major loop; `x` in mm."""
    grid, rising, _ = table.major_loop
    return _invert(grid, rising, table, x)


def on_cooling(table: FodTable, x: npt.ArrayLike, peak: float) -> Inferred:
    """Temperatures along the first-order curve from a peak (deg C); `x` in mm."""
    if not table.lo < peak:
        raise InputError("inference, peak", peak, f"a temperature above {table.lo:g} degC")
    top = min(peak, table.hi)
    grid = np.append(table.grid[table.grid < top], top)
    return _invert(grid, table.curve(top, grid, "descending"), table, x)


def _invert(grid: Array, branch: Array, table: FodTable, x: npt.ArrayLike) -> Inferred:
    """The inverse of a branch that rises with temperature; held at its ends."""
    place = np.asarray(x, dtype=np.float64)
    if table.span <= 0.0:
        raise ProblemError("inference, table", f"its span is {table.span:g}", "Give a rising one.")
    if not np.isfinite(place).all():
        remedy = "Give finite numbers."
        raise ProblemError("inference, position", "the values are not finite", remedy)
    # Flat stretches have no inverse: of equal outputs the upper end is kept at the bottom
    # of the branch, the lower end elsewhere, so that saturation reads as its beginning.
    f = np.maximum.accumulate(branch)
    first = int(np.flatnonzero(f <= f[0] + 1e-9 * table.span)[-1])
    keep = np.r_[first, first + 1 + np.flatnonzero(np.diff(f[first:]) > 1e-9 * table.span)]
    u, f = grid[keep], f[keep]
    if len(u) < 2:
        remedy = "Choose a branch on which the output changes."
        raise ProblemError("inference, branch", "the branch is flat", remedy)
    middle = np.interp(place, f, u)
    reach = 2.0 * _POSITION
    warmth = 2.0 * _TEMPERATURE
    low = np.where(place - reach <= f[0], grid[0], np.interp(place - reach, f, u) - warmth)
    high = np.where(place + reach >= f[-1], grid[-1], np.interp(place + reach, f, u) + warmth)
    cell = np.clip(np.searchsorted(f, place, side="right") - 1, 0, len(u) - 2)
    slope = np.diff(f)[cell] / np.diff(u)[cell]
    inside = (place > f[0]) & (place < f[-1])
    return Inferred(middle, np.minimum(low, middle), np.maximum(high, middle), slope * inside)


class StepRecord(NamedTuple):
    t: Array  # s
    position: Array  # mm
    rise: Array  # temperature above ambient, K
    error: Array  # standard error, K; inf where the position shows no temperature


def average(trials: Sequence[Recording]) -> tuple[Array, Array]:
    """Mean of trials (solid line of Figure 5.10), mm."""
    if not trials:
        raise ProblemError("trials", "there is no recording", "Give one or more.")
    n = min(len(r) for r in trials)
    if any(r.dt != trials[0].dt for r in trials):
        raise InputError("trials", [r.dt for r in trials], "one sample time")
    x = np.mean([signal(r["laser"], "laser")[:n] for r in trials], axis=0) * 1e-3
    return signal(trials[0]["t"], "t")[:n], x


def inferred_step(table: FodTable, trials: list[Recording], ambient: float) -> StepRecord:
    """Figure 5.10b: temperature rise during a step from full extension; `ambient` in deg C."""
    return step_of(table, *average(trials), ambient)


def step_of(table: FodTable, t: Array, x: Array, ambient: float) -> StepRecord:
    """The same of mean positions over time; `x` in mm."""
    found = on_heating(table, x)
    width = found.high - found.low
    usable = (width <= WIDEST_BAND) & (found.slope > 0.0)
    return StepRecord(t, x, found.temperature - ambient, np.where(usable, 0.25 * width, np.inf))


def steady(record: StepRecord, seconds: float = 2.0) -> float:
    """Mean temperature rise at the end of a step."""
    last = record.t >= record.t[-1] - seconds
    if not np.isfinite(record.error[last]).all():
        remedy = "Record a step that moves the actuator and stays clear of the stop."
        raise ProblemError("steady temperature", "the position is saturated", remedy)
    return float(record.rise[last].mean())


class HeatingFit(NamedTuple):
    modes: Modes  # Rates (1/s) and shares
    std: Modes  # their standard errors
    ladder: Ladder  # the same as three nodes
    nrmse: float  # RMS error over the range of the record's temperatures
    # coverage factors of the modes
    factors: Array = clusters.normal(6)


def heating(record: StepRecord, goal: float, points: int = 400) -> HeatingFit:
    """Third-order dynamics of a step: T / T_d of (5.6) by output error, with positive shares."""
    # Samples are even in log time, so that the first second counts as much as the last minute, and
    # have equal weights, since the table's error dominates the laser's noise.
    usable = np.flatnonzero(np.isfinite(record.error) & (record.t > 0.0))
    if len(usable) < 50 or not goal > 0.0:
        found = f"it has {len(usable)} usable samples and a goal of {goal:g} K"
        raise ProblemError("heating step", found, "Give 50 samples or more and a goal above 0.")
    t = record.t[usable]
    places = np.searchsorted(t, np.geomspace(t[0], t[-1], points))
    chosen = np.unique(np.minimum(places, len(t) - 1))
    t, y = t[chosen], record.rise[usable][chosen] / goal

    def residual(theta: Array) -> Array:
        return np.asarray(step_response(Modes(*np.exp(theta)), t) - y)

    # From a second to the length of the record, as an engineer would guess.
    rates = np.geomspace(1.5, 2.0 / t[-1], 3)
    start = np.log(np.r_[rates, 0.7, 0.2, 0.1])
    found = least_squares(residual, start, x_scale=1.0, method="trf", max_nfev=400)
    if found.status <= 0:
        notice(ConvergenceWarning, f"heating: {found.message}; last values returned")
    theta = np.exp(found.x)
    spread = clusters.spread(found.jac, found.fun, clusters.blocks(len(t), _BLOCKS))
    std = theta * np.sqrt(np.diag(spread.covariance))
    order = np.argsort(-theta[:3])
    order = np.r_[order, 3 + order]
    modes, doubt = (Modes(*each[order].tolist()) for each in (theta, std))
    nrmse = float(np.sqrt(np.mean(found.fun**2)) / np.ptp(y))
    return HeatingFit(modes, doubt, ladder(modes), nrmse, spread.factors()[:, order])


class CoolingFit(NamedTuple):
    time: float  # Until 63 % of the fall is done, s
    fitted: float  # time constant by least squares, s
    nrmse: float  # RMS error of that exponential, over the range of the fall
    peak: float  # start of the fall, deg C


def cooling(table: FodTable, trials: Sequence[Recording], ambient: float) -> CoolingFit:
    """(5.9) from a step that is held and then set to 0 V (Figure 5.16); `ambient` in deg C."""
    t, x = average(trials)
    sent = signal(trials[0]["ctrl"], "ctrl")[: len(t)]
    off = np.flatnonzero((sent[1:] <= 0.0) & (sent[:-1] > 0.0))
    if not len(off):
        remedy = "Record a step that ends at 0 V."
        raise ProblemError("cooling record, ctrl", "CTRL never returns to 0", remedy)
    return fall_of(table, t, x, int(off[0]) + 1, ambient)


def fall_of(table: FodTable, t: Array, x: Array, begin: int, ambient: float) -> CoolingFit:
    """The same of mean positions over time, from the first sample at 0 V; `x` in mm."""
    before = t >= t[begin] - 0.05
    peak = float(on_heating(table, [x[before & (t < t[begin])].mean()]).temperature[0])
    found = on_cooling(table, x[begin:], peak)
    time, rise = t[begin:] - t[begin], found.temperature - ambient
    usable = (found.slope > 0.0) & (found.high - found.low <= WIDEST_BAND)
    fit = exponential_fall(time, rise, usable, peak, ambient)
    if fit is None:
        problem = f"the position does not show the first 63 % of the fall from {peak:.1f} degC"
        raise ProblemError("cooling record", problem, "Record a longer fall, clear of the stop.")
    return fit


def exponential_fall(
    time: Array, rise: Array, usable: npt.NDArray[np.bool_], peak: float, ambient: float
) -> CoolingFit | None:
    """Cooling until 63 % of the fall is done; None if the record does not show that."""
    start = peak - ambient
    done = np.flatnonzero(rise <= start * np.exp(-1.0))
    if not start > 0.0 or not len(done) or not usable[: max(done[0], 1)].mean() > 0.5:
        return None
    last = int(done[0])
    kept = np.flatnonzero(usable[: last + 1])
    t, y = time[kept], rise[kept]
    fit = least_squares(lambda theta: start * np.exp(-t / theta[0]) - y, [time[last]])
    nrmse = float(np.sqrt(np.mean(fit.fun**2)) / np.ptp(y))
    return CoolingFit(float(time[last]), float(fit.x[0]), nrmse, peak)


class GainFit(NamedTuple):
    model: Exponential  # b (K), a (1/V), y0 (K), x0 (V)
    interval: Array  # 95 % limits of b, a, y0; NaN where the method gives none
    asymptote: float  # b + y0, K
    asymptote_interval: tuple[float, float]  # Its 95 % limits, K
    rms: float  # distance of the points, K


def checked_gain(volts: npt.ArrayLike, rise: npt.ArrayLike, least: int) -> tuple[Array, Array]:
    """Both in order of the voltage, checked for number, equality and rise."""
    x, y = signal(volts, "CTRL"), signal(rise, "steady temperature")
    if len(x) != len(y) or len(x) < least or len(np.unique(x)) < len(x):
        found = f"voltages and temperatures number {len(x)} and {len(y)}"
        raise ProblemError("static gain", found, f"Give {least} or more pairs, all different.")
    order = np.argsort(x)
    x, y = x[order], y[order]
    if np.any(np.diff(y) <= 0.0):
        raise InputError("steady temperature", list(y), "values that rise with CTRL")
    return x, y


def static_gain(volts: npt.ArrayLike, rise: npt.ArrayLike) -> GainFit:
    """b, a and y0 of (5.2) by non-linear least squares, x0 at the lowest voltage."""
    x, y = checked_gain(volts, rise, 4)
    x0 = float(x[0])

    def residual(theta: Array) -> Array:
        return np.asarray(theta[0] * -np.expm1(-theta[1] * (x - x0)) + theta[2] - y)

    start = [1.05 * np.ptp(y), 3.0 / np.ptp(x), y[0]]
    scale = [float(np.ptp(y)), 1.0 / float(np.ptp(x)), float(np.ptp(y))]
    found = least_squares(residual, start, x_scale=scale, method="lm", xtol=1e-12, ftol=1e-12)
    if found.status <= 0:
        notice(ConvergenceWarning, f"static gain: {found.message}; last values returned")
    free = len(x) - 3
    variance = float(found.fun @ found.fun) / free
    covariance = np.linalg.inv(found.jac.T @ found.jac) * variance
    factor = within(free)
    reach = factor * np.sqrt(np.diag(covariance))
    b, a, y0 = (float(v) for v in found.x)
    across = np.array([1.0, 0.0, 1.0])
    both = factor * float(np.sqrt(across @ covariance @ across))
    model = Exponential(b, a, x0, y0)
    return GainFit(
        model,
        np.column_stack([found.x - reach, found.x + reach]),
        b + y0,
        (b + y0 - both, b + y0 + both),
        gain_rms(model, x, y),
    )


def gain_rms(model: Exponential, x: Array, y: Array) -> float:
    fit = model.b * -np.expm1(-model.a * (x - model.x0)) + model.y0
    return float(np.sqrt(np.mean((fit - y) ** 2)))
