"""The actuator model (5.2.3) from recordings, and measures of its error."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.hysteresis.table import FodTable
from macromicro.identify import _gain, thermal
from macromicro.identify._gain import GainFit
from macromicro.identify.thermal import CoolingFit, HeatingFit
from macromicro.models import actuator
from macromicro.models.actuator import Actuator, Hysteresis
from macromicro.models.weighted_gain import Weighted
from macromicro.recording import Recording

AMBIENT = 25.0
# Steps that get this close to the table's end are in saturation: no steady temperature.
NEAR_STOP = 0.97


class ThesisFit(NamedTuple):
    model: Actuator  # the model of (5.2.3) with all that was found
    steady: dict[float, float]  # temperature rise (K) by voltage (V) below the stop
    linearised: GainFit  # (5.2) by (5.3)-(5.5)
    nonlinear: GainFit  # (5.2) by non-linear least squares
    goals: dict[float, float]  # T_d (K) by voltage (V) above the stop, for (5.8)
    heating: HeatingFit  # (5.6)
    cooling: CoolingFit  # (5.9)


def hysteresis(table: FodTable) -> Hysteresis:
    """The table in the form that the kernels take, mm."""
    return Hysteresis(table.everett(), table.f_low, table.span)


def thesis(
    table: FodTable,
    steps: Mapping[float, list[Recording]],
    cooled: list[Recording],
    median: float = 1.575,
    ambient: float = AMBIENT,
) -> ThesisFit:
    """The whole model of (5.2.3) from trials of one actuator."""
    # Below the stop, the gain is (5.2) by non-linear least squares; above it, the T_d with which
    # (5.6) passes 95 % of the stroke when the actuator does.
    if median not in steps:
        raise InputError("steps", median, f"one of {sorted(steps)}")
    records = {v: thermal.inferred_step(table, trials, ambient) for v, trials in steps.items()}
    stop = table.f_low + NEAR_STOP * table.span
    below = {v: r for v, r in sorted(records.items()) if r.position.max() < stop}
    steady = {v: thermal.steady(r) for v, r in below.items()}
    volts, rise = list(steady), list(steady.values())
    if median not in below:
        raise InputError("steps, median", median, f"a step clear of the stop: {volts}")
    fit = _gain.nonlinear(volts, rise)
    dynamics = thermal.heating(records[median], steady[median])
    level = table.f_low + 0.95 * table.span
    goals = {
        v: thermal.needed_goal(table, dynamics.modes, r.t, r.position, ambient, level)
        for v, r in sorted(records.items())
        if v not in below
    }
    whole = Weighted(low=fit.model, scale=0.0)
    if len(goals) > 1:
        whole = _gain.upper(fit.model, steady, goals)
    fall = thermal.cooling(table, cooled, ambient)
    model = Actuator(whole, dynamics.modes, fall.time, ambient, hysteresis(table))
    straight = _gain.linearised(volts, rise, max(fit.asymptote, 1.002 * rise[-1]))
    return ThesisFit(model, steady, straight, fit, goals, dynamics, fall)


class Judgement(NamedTuple):
    """Error of a model, as shares of the stroke."""

    steady: float  # difference at the end
    dynamic: float  # RMS until the measured position has come to stay
    whole: float  # RMS throughout


def judged(t: Array, measured: Array, model: Array, stroke: float) -> Judgement:
    """Error of a model's position; the dynamic part is the rise and 1.5 times its time (2 %)."""
    error = (model - measured) / stroke
    last = t >= t[-1] - 0.02 * (t[-1] - t[0])
    arrived = int(np.argmax(measured >= 0.98 * measured.max()))
    moving = t <= t[0] + 1.5 * (t[arrived] - t[0])
    return Judgement(
        float(error[last].mean()),
        float(np.sqrt(np.mean(error[moving] ** 2))),
        float(np.sqrt(np.mean(error**2))),
    )


def against(model: Actuator, trials: list[Recording]) -> Judgement:
    """The thesis' model against the mean of trials of one profile."""
    t, x = thermal.averaged(trials)
    sent = np.asarray(trials[0]["ctrl"], dtype=np.float64)[: len(t)]
    made, _ = actuator.simulate(model, sent, trials[0].dt)
    return judged(t, x, made, model.hysteresis.span)
