"""Both actuator models (5.2) from recordings of the micro-stage and the kiln's table.

Only measured channels are used: CTRL, laser, CONTRACT, and the kiln's thermocouple and encoder
through the table.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.hysteresis.table import FodTable
from macromicro.identify import heating, wire_table
from macromicro.identify.clusters import within
from macromicro.identify.heating import AMBIENT, CoolingFit, GainFit, HeatingFit, StepRecord
from macromicro.identify.linear import LinearFit, mls
from macromicro.identify.notices import ConvergenceWarning, notice
from macromicro.identify.records import signal
from macromicro.identify.search import least_squares
from macromicro.identify.wire import WireFit
from macromicro.identify.wire_model import hysteresis
from macromicro.lab.machine import Machine
from macromicro.models import actuator
from macromicro.models import stressed as better_model
from macromicro.models.actuator import Actuator
from macromicro.models.heating import Modes, step_response
from macromicro.models.weighted_gain import Exponential, Weighted, weighted
from macromicro.recording import Recording
from macromicro.thesis.chapter5 import electrothermal_runs
from macromicro.thesis.chapter5.electrothermal_runs import StepData

# Steps that get this close to the table's end are in saturation: no steady temperature.
NEAR_STOP = 0.97


class Judgement(NamedTuple):
    """Error of a model, as shares of the stroke."""

    steady: float  # difference at the end
    dynamic: float  # RMS until the measured position has come to stay
    whole: float  # RMS throughout


def judge(t: Array, measured: Array, model: Array, stroke: float) -> Judgement:
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


class ThesisFit(NamedTuple):
    model: Actuator  # the model of (5.2.3) with all that was found
    steady: dict[float, float]  # temperature rise (K) by voltage (V) below the stop
    linearised: GainFit  # (5.2) by (5.3)-(5.5)
    nonlinear: GainFit  # (5.2) by non-linear least squares
    goals: dict[float, float]  # T_d (K) by voltage (V) above the stop, for (5.8)
    heating: HeatingFit  # (5.6)
    cooling: CoolingFit  # (5.9)


def thesis(
    table: FodTable,
    steps: Mapping[float, list[Recording]],
    cooled: list[Recording],
    median: float = 1.575,
) -> ThesisFit:
    """The whole model of (5.2.3) from trials of one actuator."""
    # Below the stop, the gain is (5.2) by non-linear least squares; above it, the T_d with which
    # (5.6) passes 95 % of the stroke when the actuator does.
    if median not in steps:
        raise InputError("steps", median, f"one of {sorted(steps)}")
    records = {v: heating.inferred_step(table, trials, AMBIENT) for v, trials in steps.items()}
    stop = table.f_low + NEAR_STOP * table.span
    below = {v: r for v, r in sorted(records.items()) if r.position.max() < stop}
    steady = {v: heating.steady(r) for v, r in below.items()}
    volts, rise = list(steady), list(steady.values())
    if median not in below:
        raise InputError("steps, median", median, f"a step clear of the stop: {volts}")
    fit = heating.static_gain(volts, rise)
    dynamics = heating.heating(records[median], steady[median])
    level = table.f_low + 0.95 * table.span
    goals = {
        v: needed_goal(table, dynamics.modes, r.t, r.position, AMBIENT, level)
        for v, r in sorted(records.items())
        if v not in below
    }
    whole = Weighted(low=fit.model, scale=0.0)
    if len(goals) > 1:
        whole = upper(fit.model, steady, goals)
    fall = heating.cooling(table, cooled, AMBIENT)
    model = Actuator(whole, dynamics.modes, fall.time, AMBIENT, hysteresis(table))
    straight = linearise(volts, rise, max(fit.asymptote, 1.002 * rise[-1]))
    return ThesisFit(model, steady, straight, fit, goals, dynamics, fall)


def against(model: Actuator, trials: list[Recording]) -> Judgement:
    """The thesis' model against the mean of trials of one profile."""
    t, x = heating.average(trials)
    sent = np.asarray(trials[0]["ctrl"], dtype=np.float64)[: len(t)]
    made, _ = actuator.simulate(model, sent, trials[0].dt)
    return judge(t, x, made, model.hysteresis.span)


def asymptote(rise: npt.ArrayLike) -> float:
    """y_inf of (5.3) from three last values at equal steps of CTRL (Aitken)."""
    y = signal(rise, "steady temperature")[-3:]
    steps = np.diff(y)
    if len(steps) != 2 or not steps[0] > steps[1] > 0.0:
        raise InputError("asymptote", list(y), "three values whose differences shrink")
    return float(y[-1] + steps[1] ** 2 / (steps[0] - steps[1]))


def linearise(volts: npt.ArrayLike, rise: npt.ArrayLike, y_inf: float | None = None) -> GainFit:
    """The thesis' method (5.3)-(5.5) for the static gain, ill-conditioned in A."""
    # x0, y0 from the lowest point, B from the asymptote, A by least squares through the origin on A
    # x' = y', y' = -ln(1 - (y - y0) / B); (5.4) is printed without its minus sign.
    x, y = heating.checked_gain(volts, rise, 3)
    if y_inf is None:
        if np.ptp(np.diff(x)[-2:]) > 1e-6:
            raise InputError("static gain", list(x), "equal steps of CTRL, or y_inf given")
        y_inf = asymptote(y)
    x0, y0 = float(x[0]), float(y[0])
    b = y_inf - y0
    if np.any(y >= y_inf):
        raise InputError("static gain, y_inf", y_inf, f"more than all temperatures ({y[-1]:.6g})")
    dx, dy = x[1:] - x0, -np.log(1.0 - (y[1:] - y0) / b)
    a = float(dx @ dy / (dx @ dx))
    deviation = dy - a * dx
    free = len(dx) - 1
    std = float(np.sqrt(deviation @ deviation / free / (dx @ dx)))

    reach = within(free) * std
    interval = np.array([[np.nan, np.nan], [a - reach, a + reach], [np.nan, np.nan]])
    model = Exponential(b, a, x0, y0)
    return GainFit(model, interval, y_inf, (np.nan, np.nan), heating.gain_rms(model, x, y))


def upper(
    low: Exponential,
    steady: Mapping[float, float],
    goals: Mapping[float, float],
    start: float = 1.625,
) -> Weighted:
    """The whole (5.8): the second exponential and the transition (5.7) to it."""
    # The offset is the lower curve at 1.6 V, as in the thesis (82.58). The rest by least squares,
    # softly held at the printed values where the data do not determine it.
    if len(goals) < 2:
        raise InputError("upper gain, goals", len(goals), "2 voltages above the stop, or more")
    offset = _at(low, 1.6)
    printed = np.array([np.log(10.0), np.log(10.0), np.log(40.0), 1.7])

    def model(theta: Array) -> Weighted:
        scale, rate, sharpness = (float(v) for v in np.exp(theta[:3]))
        return Weighted(low, scale, rate, start, offset, sharpness, float(theta[3]))

    def residual(theta: Array) -> Array:
        p = model(theta)
        below = [(weighted(p, v) - _at(low, v)) / 0.1 for v in steady]
        above = [(weighted(p, v) / y - 1.0) / 0.01 for v, y in goals.items()]
        return np.concatenate([below, above, 0.1 * (theta - printed)])

    reach = np.array([4.0, 3.0, 1.5, 0.1])
    found = least_squares(residual, printed, bounds=(printed - reach, printed + reach))
    if found.status <= 0:
        notice(ConvergenceWarning, f"upper gain: {found.message}; last values returned")
    return model(found.x)


def _at(p: Exponential, volts: float) -> float:
    return p.b * -float(np.expm1(-p.a * (volts - p.x0))) + p.y0


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
    warm = float(heating.on_heating(table, [level]).temperature[0]) - ambient
    return warm / float(step_response(fit, t[past[0]]))


def full_contraction(table: FodTable, within: float = 0.05) -> float:
    """Temperature at which the rising branch has nearly ended (S6), deg C."""
    _, rising, _ = table.major_loop
    level = rising[-1] - within * table.span
    return float(heating.on_heating(table, [level]).temperature[0])


class Compared(NamedTuple):
    thesis: Judgement  # with the identified gain
    printed: Judgement  # with the gain of (5.8)
    better: Judgement


class Trace(NamedTuple):
    """Mean of a step's trials and both models' response to its CTRL; contraction [mm], (n,)."""

    record: StepRecord
    thesis: Array
    better: Array


class Models(NamedTuple):
    table: FodTable  # Figure 5.8
    data: StepData
    thesis: ThesisFit
    better: WireFit
    traces: dict[float, Trace]  # by voltage [V]
    steps: dict[float, Judgement]  # the thesis' model on the data of its fit (S10)
    unseen: dict[str, Compared]  # all models on other runs, by name


class Unfitted(NamedTuple):
    """Table and data for which the models of Section 5.2 could not be fitted."""

    table: FodTable
    data: StepData
    why: str


def attempt(table: FodTable, plant: Machine, seed: int) -> Models | Unfitted:
    """All open-loop runs and the fits to them, unless the procedure cannot use the runs."""
    data = electrothermal_runs.collect(plant, seed)
    try:
        return _models(table, data, plant, seed)
    except InputError as error:
        return Unfitted(table, data, str(error))


def _models(table: FodTable, data: StepData, plant: Machine, seed: int) -> Models:
    first = thesis(table, data.steps, data.cooled[1.575])
    better = wire_table.with_table(table, electrothermal_runs.for_fit(plant, seed + 10_000))
    printed = first.model._replace(gain=Weighted())
    unseen = {
        name: Compared(against(first.model, [r]), against(printed, [r]), _judge(better, r))
        for name, r in electrothermal_runs.for_judgement(plant, seed + 20_000).items()
    }
    traces = {v: _trace(table, first, better, trials) for v, trials in data.steps.items()}
    steps = {
        v: judge(c.record.t, c.record.position, c.thesis, table.span) for v, c in traces.items()
    }
    return Models(table, data, first, better, traces, steps, unseen)


def _trace(table: FodTable, first: ThesisFit, better: WireFit, trials: list[Recording]) -> Trace:
    record = heating.inferred_step(table, trials, AMBIENT)
    sent, dt = trials[0]["ctrl"][: len(record.t)], trials[0].dt
    return Trace(
        record,
        actuator.simulate(first.model, sent, dt)[0],
        better_model.simulate(better.model.wires, sent, dt)[0],
    )


def _judge(better: WireFit, recording: Recording) -> Judgement:
    """The improved model's free simulation against a recording from cold."""
    wires = better.model.wires
    made = better_model.simulate(wires, recording["ctrl"], recording.dt)[0]
    return judge(recording["t"], 1e-3 * recording["laser"], made, wires.hysteresis.span)
