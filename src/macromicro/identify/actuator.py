"""The full actuator model (5.2.3) put together from recordings, and how models are judged."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.hysteresis.table import FodTable
from macromicro.identify import gain, thermal
from macromicro.identify.gain import GainFit
from macromicro.identify.thermal import CoolingFit, HeatingFit
from macromicro.models import actuator
from macromicro.models.actuator import Actuator, Hysteresis
from macromicro.models.weighted_gain import Weighted
from macromicro.recording import Recording

AMBIENT = 25.0
# Steps that get this close to the table's end are in saturation: no steady temperature.
NEAR_STOP = 0.97


class ThesisFit(NamedTuple):
    """What Section 5.2 identifies.

    Attributes
    ----------
    model : Actuator
        The model of (5.2.3) with all that was found.
    steady : dict[float, float]
        Temperature rise (K) by voltage (V) below the stop.
    linearised : GainFit
        (5.2) by (5.3)-(5.5).
    nonlinear : GainFit
        (5.2) by non-linear least squares.
    goals : dict[float, float]
        T_d (K) by voltage (V) above the stop, for (5.8).
    heating : HeatingFit
        (5.6).
    cooling : CoolingFit
        (5.9).
    """

    model: Actuator
    steady: dict[float, float]
    linearised: GainFit
    nonlinear: GainFit
    goals: dict[float, float]
    heating: HeatingFit
    cooling: CoolingFit


def hysteresis(table: FodTable) -> Hysteresis:
    """The table as the models' kernels take it.

    Parameters
    ----------
    table : FodTable
        Temperature (deg C) to position (mm).

    Returns
    -------
    Hysteresis
        Outputs from 0 to 1, with offset and span in mm.
    """
    return Hysteresis(table.everett(), table.f_low, table.span)


def thesis(
    table: FodTable,
    steps: Mapping[float, list[Recording]],
    cooled: list[Recording],
    median: float = 1.575,
    ambient: float = AMBIENT,
) -> ThesisFit:
    """The whole model of (5.2.3) from trials of one actuator.

    The gain below the stop is (5.2) by non-linear least squares (`linearised` is there to compare);
    above it, the T_d that makes (5.6) pass 95 % of the stroke when the actuator does.

    Parameters
    ----------
    table : FodTable
        Temperature (deg C) to position (mm), from the kiln.
    steps : Mapping[float, list[Recording]]
        Trials by voltage (V): steps from cold, with columns t, ctrl and laser.
    cooled : list[Recording]
        Trials of one voltage that end at 0 V.
    median : float, optional
        Voltage (V) whose step gives the dynamics; it must stay clear of the stop.
    ambient : float, optional
        Room temperature, deg C.

    Returns
    -------
    ThesisFit
        The model, and each fit that went into it.

    Raises
    ------
    InputError
        `median` is not among `steps` or reaches the stop, or a fit finds its data unusable.
    """
    if median not in steps:
        raise InputError("steps", median, f"one of {sorted(steps)}")
    records = {v: thermal.inferred_step(table, trials, ambient) for v, trials in steps.items()}
    stop = table.f_low + NEAR_STOP * table.span
    below = {v: r for v, r in sorted(records.items()) if r.position.max() < stop}
    steady = {v: thermal.steady(r) for v, r in below.items()}
    volts, rise = list(steady), list(steady.values())
    if median not in below:
        raise InputError("steps, median", median, f"a step clear of the stop: {volts}")
    fit = gain.nonlinear(volts, rise)
    dynamics = thermal.heating(records[median], steady[median])
    level = table.f_low + 0.95 * table.span
    goals = {
        v: thermal.needed_goal(table, dynamics.modes, r.t, r.position, ambient, level)
        for v, r in sorted(records.items())
        if v not in below
    }
    whole = Weighted(low=fit.model, scale=0.0)
    if len(goals) > 1:
        whole = gain.upper(fit.model, steady, goals)
    fall = thermal.cooling(table, cooled, ambient)
    model = Actuator(whole, dynamics.modes, fall.time, ambient, hysteresis(table))
    straight = gain.linearised(volts, rise, max(fit.asymptote, 1.002 * rise[-1]))
    return ThesisFit(model, steady, straight, fit, goals, dynamics, fall)


class Judgement(NamedTuple):
    """Model against measurement, as shares of the stroke.

    Attributes
    ----------
    steady : float
        Difference at the end.
    dynamic : float
        RMS until the measured position has come to stay.
    whole : float
        RMS throughout.
    """

    steady: float
    dynamic: float
    whole: float


def judged(t: Array, measured: Array, model: Array, stroke: float) -> Judgement:
    """How far a model's position is from the measured one.

    The dynamic part lasts from the start to 1.5 times the time at which the measured position first
    comes within 2 % of its largest value: the rise and where it settles.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Times, s.
    measured, model : ndarray, shape (n,)
        Positions, mm.
    stroke : float
        Stroke, mm.

    Returns
    -------
    Judgement
        Shares of `stroke`.
    """
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
    """The thesis' model against the mean of trials of one profile.

    Parameters
    ----------
    model : Actuator
        The model of Section 5.2.3.
    trials : list[Recording]
        Recordings of one profile, with columns t, ctrl and laser.

    Returns
    -------
    Judgement
        Shares of the table's stroke.
    """
    t, x = thermal.averaged(trials)
    sent = np.asarray(trials[0]["ctrl"], dtype=np.float64)[: len(t)]
    made, _ = actuator.simulate(model, sent, trials[0].dt)
    return judged(t, x, made, model.hysteresis.span)
