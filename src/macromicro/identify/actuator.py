"""The full actuator model (5.2.3) put together from recordings, and how models are judged."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.errors import InputError
from macromicro.hysteresis.table import FodTable
from macromicro.identify import gain, thermal
from macromicro.identify.gain import GainFit
from macromicro.identify.thermal import CoolingFit, HeatingFit
from macromicro.models import actuator
from macromicro.models.actuator import Actuator, Hysteresis
from macromicro.models.weighted_gain import Weighted
from macromicro.recording import Recording

Array = npt.NDArray[np.float64]

AMBIENT = 25.0
# Steps that get this close to the table's end are in saturation: no steady temperature.
NEAR_STOP = 0.97


class ThesisFit(NamedTuple):
    """What Section 5.2 identifies. `steady`: temperature rise [K] by voltage [V] below the
    stop; `goals`: T_d [K] by voltage above it, for (5.8)."""

    model: Actuator
    steady: dict[float, float]
    linearised: GainFit
    nonlinear: GainFit
    goals: dict[float, float]
    heating: HeatingFit
    cooling: CoolingFit


def hysteresis(table: FodTable) -> Hysteresis:
    """The table as the models' kernels take it."""
    return Hysteresis(table.everett(), table.f_low, table.span)


def thesis(
    table: FodTable,
    steps: Mapping[float, list[Recording]],
    cooled: list[Recording],
    median: float = 1.575,
    ambient: float = AMBIENT,
) -> ThesisFit:
    """The whole model from trials of `steps` by voltage [V] and one voltage's `cooled` ones.

    The gain below the stop is (5.2) by non-linear least squares (`linearised` is there to
    compare); above it, the T_d that makes (5.6) pass 95 % of the stroke when the actuator
    does. Dynamics from the step of `median` [V].
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
    """Model against measurement, shares of the stroke. `steady`: difference at the end,
    `dynamic`: RMS until the measured position has come to stay, `whole`: RMS throughout."""

    steady: float
    dynamic: float
    whole: float


def judged(t: Array, measured: Array, model: Array, stroke: float) -> Judgement:
    """How far a model's position is from the measured one, both [mm] at times `t` [s].

    The dynamic part lasts from the start to 1.5 times the time at which the measured
    position first comes within 2 % of its largest value: the rise and where it settles.
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
    """The thesis' model against the mean of trials of one profile."""
    t, x = thermal.averaged(trials)
    sent = np.asarray(trials[0]["ctrl"], dtype=np.float64)[: len(t)]
    made, _ = actuator.simulate(model, sent, trials[0].dt)
    return judged(t, x, made, model.hysteresis.span)
