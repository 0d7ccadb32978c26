"""Heating (5.6) and cooling (5.9) from temperatures inferred by position (Section 5.2.2)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.hysteresis.table import FodTable
from macromicro.identify import _counts, _slow_levels, coverage
from macromicro.identify._central import central
from macromicro.identify._restored import restored
from macromicro.identify._spread import autoregression, driven, standard_errors
from macromicro.identify.inference import Doubt, on_cooling, on_heating
from macromicro.identify.linear import LinearFit, mls
from macromicro.identify.notices import ConvergenceWarning, notice
from macromicro.identify.records import signal
from macromicro.identify.search import least_squares
from macromicro.models.heating import Ladder, Modes, ladder, step_response
from macromicro.recording import Recording

# A temperature whose band is wider than this [K] says next to nothing.
WIDEST_BAND = 6.0
_NUDGE = 1e-4  # of the logarithm of a rate or a share, for slopes


class StepRecord(NamedTuple):
    t: Array  # s
    position: Array  # mm
    rise: Array  # temperature above ambient, K
    error: Array  # standard error, K; inf where the position shows no temperature


def averaged(trials: Sequence[Recording]) -> tuple[Array, Array]:
    """Mean of trials (solid line of Figure 5.10), mm."""
    if not trials:
        raise ProblemError("trials", "there is no recording", "Give one or more.")
    n = min(len(r) for r in trials)
    if any(r.dt != trials[0].dt for r in trials):
        raise InputError("trials", [r.dt for r in trials], "one sample time")
    x = np.mean([signal(r["laser"], "laser")[:n] for r in trials], axis=0) * 1e-3
    return signal(trials[0]["t"], "t")[:n], x


def inferred_step(
    table: FodTable, trials: list[Recording], ambient: float, doubt: Doubt | None = None
) -> StepRecord:
    """Figure 5.10b: temperature rise during a step from full extension; `ambient` in deg C."""
    t, x = averaged(trials)
    found = on_heating(table, x, doubt)
    width = found.high - found.low
    usable = (width <= WIDEST_BAND) & (found.slope > 0.0)
    return StepRecord(t, x, found.temperature - ambient, np.where(usable, 0.25 * width, np.inf))


def steady(record: StepRecord, seconds: float = 2.0) -> float:
    """Mean temperature rise at the end of a step."""
    last = record.t >= record.t[-1] - seconds
    if not np.isfinite(record.error[last]).all():
        raise ProblemError(
            "steady temperature",
            "the position is saturated",
            "Record a step that moves the actuator and stays clear of the stop.",
        )
    return float(record.rise[last].mean())


class HeatingFit(NamedTuple):
    modes: Modes  # Rates (1/s) and shares
    std: Modes  # their standard errors
    ladder: Ladder  # the same as three nodes
    nrmse: float  # RMS error over the range of the record's temperatures
    # coverage factors (`coverage.factors`) of the modes
    factors: Array = coverage.factors(None, np.eye(6))


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
    # Early samples lie next to each other, so errors of the record that go together count.
    errors = np.full(len(record.t), np.nan)
    model = step_response(Modes(*theta), record.t[usable])
    errors[usable] = np.asarray(model) - record.rise[usable] / goal
    step = _counts.pitch(record.rise[usable])
    rounded = None
    if step is not None and _counts.explains(errors, step / goal):
        every, solve = ([y + found.fun], [step / goal]), np.linalg.pinv(found.jac)
        told = _counts.redrawn(lambda e: solve @ e, found.jac, *every)
        rounded = told if _counts.alone(found.jac, told.covariance, [y], *every) else None
    draws = None
    if rounded is not None:
        spread, least, draws = rounded.covariance, np.zeros(len(theta)), rounded.draws
    else:
        spread, least = _by_noise(found, usable, chosen, record, errors), _least(found)
    std = theta * np.maximum(np.sqrt(np.diag(spread)), least)
    order = np.argsort(-theta[:3])
    order = np.r_[order, 3 + order]
    modes, doubt = (Modes(*each[order].tolist()) for each in (theta, std))
    nrmse = float(np.sqrt(np.mean(found.fun**2)) / np.ptp(y))
    factors = coverage.factors(draws, np.eye(len(theta)))[:, order]
    return HeatingFit(modes, doubt, ladder(modes), nrmse, factors)


def _by_noise(
    found: Any, usable: npt.NDArray[np.intp], chosen: npt.NDArray[np.intp], r: StepRecord, e: Array
) -> Array:
    """Covariance of the logarithms by the residual noise (`restored`, `slow_levels`)."""

    def run(theta: Array) -> Array:
        return np.asarray(step_response(Modes(*np.exp(theta)), r.t[usable]))

    free = np.full(len(found.x), np.inf)
    taken = central(run, found.x, np.full(len(free), _NUDGE), -free, free)
    # Few samples were fitted: what the others leave holds the slow errors of that, too.
    left = e[usable] - taken @ (np.linalg.pinv(taken) @ e[usable])
    cuts = np.flatnonzero(np.diff(usable) > 1) + 1
    every = np.split(left, cuts)
    solve = np.zeros_like(taken.T)
    solve[:, chosen] = np.linalg.pinv(found.jac)
    if not _slow_levels.is_slow(len(usable), autoregression(every)):
        backs = np.split(solve, cuts, axis=1)
        noise = autoregression(np.split(e[usable], cuts))
        return driven([b.T for b in backs], restored(noise, np.split(taken, cuts), backs))
    return _slow_levels.covariance(solve, list(map(len, every)), _slow_levels.levels(every, taken))


def _least(found: Any) -> Array:
    """Standard errors for white residuals at the samples."""
    free = max(len(found.fun) - found.jac.shape[1], 1)
    return standard_errors(found.jac) * float(np.sqrt(found.fun @ found.fun / free))


def heating_mls(record: StepRecord, goal: float, dt: float = 0.1) -> LinearFit:
    """(5.6) by `mls` of order three, as in the thesis."""
    # Before the position shows a temperature, a line from 0 stands in: a second-order numerator
    # needs the first samples. Equal weights per sample favour the long tail; `heating` is better.
    known = np.isfinite(record.error)
    t = np.arange(record.t[0], record.t[-1], dt)
    y = np.interp(t, np.r_[record.t[0], record.t[known]], np.r_[0.0, record.rise[known]])
    # Rest before the step shows where it begins.
    lead = 5
    u = np.r_[np.zeros(lead), np.full(len(t), goal)]
    return mls(u, np.r_[np.zeros(lead), y], 3, 3, dt)


def needed_goal(
    table: FodTable, fit: Modes, t: Array, x: Array, ambient: float, level: float
) -> float:
    """T_d with which the model passes `level` (mm) when the record does (tuning of (5.8))."""
    past = np.flatnonzero(x >= level)
    if not len(past) or past[0] == 0:
        found = f"it reaches {x.max():.4g} mm"
        raise ProblemError("heating step", found, f"Record one that passes {level:.4g} mm.")
    warm = float(on_heating(table, [level]).temperature[0]) - ambient
    return warm / float(step_response(fit, t[past[0]]))


class CoolingFit(NamedTuple):
    time: float  # Until 63 % of the fall is done, s
    fitted: float  # time constant by least squares, s
    nrmse: float  # RMS error of that exponential, over the range of the fall
    peak: float  # start of the fall, deg C


def cooling(table: FodTable, trials: Sequence[Recording], ambient: float) -> CoolingFit:
    """(5.9) from a step that is held and then set to 0 V (Figure 5.16); `ambient` in deg C."""
    t, x = averaged(trials)
    sent = signal(trials[0]["ctrl"], "ctrl")[: len(t)]
    off = np.flatnonzero((sent[1:] <= 0.0) & (sent[:-1] > 0.0))
    if not len(off):
        raise ProblemError(
            "cooling record, ctrl", "CTRL never returns to 0", "Record a step that ends at 0 V."
        )
    begin = int(off[0]) + 1
    before = t >= t[begin] - 0.05
    peak = float(on_heating(table, [x[before & (t < t[begin])].mean()]).temperature[0])
    found = on_cooling(table, x[begin:], peak)
    time, rise = t[begin:] - t[begin], found.temperature - ambient
    goal = (peak - ambient) * np.exp(-1.0)
    done = np.flatnonzero(rise <= goal)
    usable = (found.slope > 0.0) & (found.high - found.low <= WIDEST_BAND)
    if not len(done) or not usable[: done[0]].mean() > 0.5:
        raise ProblemError(
            "cooling record",
            f"the position does not show the first 63 % of the fall from {peak:.1f} degC",
            "Record a longer fall, clear of the stop.",
        )
    last = int(done[0])
    tt, yy = time[: last + 1][usable[: last + 1]], rise[: last + 1][usable[: last + 1]]

    def residual(theta: Array) -> Array:
        return np.asarray((peak - ambient) * np.exp(-tt / theta[0]) - yy)

    fit = least_squares(residual, [time[last]])
    nrmse = float(np.sqrt(np.mean(fit.fun**2)) / np.ptp(yy))
    return CoolingFit(float(time[last]), float(fit.x[0]), nrmse, peak)
