"""Open-loop steps and the actuator models (Sections 5.2.2 and 5.2.3)."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.drawing.exhibit import Drawn
from macromicro.drawing.style import (
    BLACK,
    BLUE,
    GREEN,
    RED,
    finish,
    line,
    new,
    note,
    shades,
    single,
)
from macromicro.errors import InputError
from macromicro.hysteresis.table import FodTable
from macromicro.identify.heating import (
    AMBIENT,
    WIDEST_BAND,
    average,
    cooling,
    on_cooling,
    on_heating,
)
from macromicro.identify.kiln import fod_table
from macromicro.identify.notices import ConvergenceWarning
from macromicro.models import heating
from macromicro.models.heating import from_transfer, step_response, transfer
from macromicro.models.weighted_gain import Exponential, Weighted, exponential, weighted
from macromicro.thesis.chapter4.identification import nrmse
from macromicro.thesis.chapter5 import actuator_models, kiln_runs
from macromicro.thesis.chapter5.actuator_models import Models, Unfitted, full_contraction
from macromicro.thesis.chapter5.electrothermal_runs import (
    ABOVE_STOP,
    BELOW_STOP,
    CYCLES_BEFORE,
    HELD_S,
    WARM,
    StepData,
)
from macromicro.thesis.claims import (
    Claim,
    NotMeasured,
    accepts,
    judge,
    printed_value,
    state,
    within,
)
from macromicro.thesis.contents import caption
from macromicro.thesis.procedure import Lab

PRINTED_A = printed_value("S5b")  # 1/V, (5.5)

VOLTS = (1.5, 1.6, 1.7, 1.8)


def against_5_6(modes: heating.Modes) -> float:
    """NRMSE [%] of a minute's step response against (5.6) as printed."""
    t = np.arange(0.0, 60.0, 0.01)
    return nrmse(step_response(modes, t), step_response(from_transfer(*heating.PRINTED), t))


def fitted(seen: Models | Unfitted) -> Models:
    if isinstance(seen, Unfitted):
        raise NotMeasured(f"the thesis' procedure does not fit this bench's steps: {seen.why}")
    return seen


def claims(seen: Models | Unfitted) -> list[Claim]:
    """S5a, S5b, S7 and S8 from the fits, S9 from the printed equation, S10 from both."""
    return judge(
        [
            (("S5a", "S5b"), lambda: _gain(fitted(seen))),
            ("S7", lambda: _dynamics(fitted(seen))),
            ("S8", lambda: _cooling(seen.table, seen.data)),
            ("S9", printed_gain),
            ("S10", lambda: _whole(fitted(seen))),
        ]
    )


def _gain(models: Models) -> list[Claim]:
    fit, line = models.thesis.nonlinear, models.thesis.linearised
    low, high = (float(v) for v in fit.interval[1])
    a = line.model.a
    near = accepts("S5b", a) or low <= PRINTED_A <= high
    return [
        state("S5a", fit.asymptote, fit=fit),
        state("S5b", a, near, fit=fit, low=low, high=high),
    ]


def _dynamics(models: Models) -> Claim:
    found = models.thesis.heating.modes
    num, den = transfer(found)
    error = against_5_6(found)
    return state(
        "S7",
        [-found.rate1, -found.rate2, -found.rate3, float(num[-1] / den[-1])],
        within("S7", error),
        error=error,
        mls=_mls(models),
    )


def _mls(models: Models) -> str:
    """(5.6) by MLS, as Section 5.2.2 identifies it, in words."""
    try:
        record = models.traces[1.575].record
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ConvergenceWarning)  # the reason says so
            found = actuator_models.heating_mls(record, models.thesis.steady[1.575])
        made = found.simulate(np.ones(round(60.0 / found.dt)))
    except InputError as error:
        return f"MLS, which Section 5.2.2 uses, finds no such model ({error})"
    t = np.arange(len(made)) * found.dt
    apart = nrmse(made, step_response(from_transfer(*heating.PRINTED), t))
    left = "" if found.converged else " (its last values, it does not settle)"
    return f"by MLS of order three, as Section 5.2.2 has it, by {apart:.2f} %{left}"


def _cooling(table: FodTable, data: StepData) -> Claim:
    """S8 as in Section 5.2.2, for an actuator cycled a few times; also from cold."""
    warm = cooling(table, data.warm, AMBIENT)
    return state("S8", warm.time, cycles=CYCLES_BEFORE, cold=_cold(table, data), warm=warm)


def _cold(table: FodTable, data: StepData) -> str:
    try:
        return f"{cooling(table, data.cooled[WARM], AMBIENT).time:.2f} s from cold"
    except InputError as error:
        return f"from cold it is not known ({error})"


def _whole(models: Models) -> Claim:
    steady, low, high = _shares(models)
    ratio = models.steps[1.8].dynamic / models.steps[1.575].dynamic
    return state("S10", [steady, ratio], steady=steady, ratio=ratio, high=high, low=low)


def _shares(models: Models) -> tuple[float, float, float]:
    """Largest steady error below the stop, dynamic errors at 1.575 V and 1.8 V [% of stroke]."""
    steps = models.steps
    steady = max(abs(steps[v].steady) for v in BELOW_STOP)
    return 100.0 * steady, 100.0 * steps[1.575].dynamic, 100.0 * steps[1.8].dynamic


def curve(low: float = 1.4, high: float = 1.9, points: int = 251) -> tuple[Array, Array]:
    """CTRL [V] and steady temperature [K above ambient], shape (points,) each."""
    volts = np.linspace(low, high, points)
    return volts, np.array([weighted(Weighted(), float(v)) for v in volts])


def exponentials(volts: Array) -> tuple[Array, Array]:
    """The lower (at least 0) and the upper exponential of (5.8) [K above ambient]."""
    p = Weighted()
    lower = [max(0.0, exponential(p.low, float(v))) for v in volts]
    return np.array(lower), p.scale * np.exp(p.rate * (volts - p.start)) + p.offset


def printed_gain() -> list[Claim]:
    found = [weighted(Weighted(), v) for v in VOLTS]
    _, everywhere = curve(0.0, 5.0, 5001)
    volts, rise = curve(1.3, 1.6, 3001)
    good = accepts("S9", *found) and bool((everywhere >= 0.0).all())
    silent = float(volts[rise < 0.05][-1])
    high = weighted(Weighted(), 1.9)
    return [state("S9", found, good, silent=silent, high=high)]


HOT = "temperature [degC]"
SHORT = "contraction [mm]"
SHOWN_VOLTS = (*BELOW_STOP, *ABOVE_STOP)
SHOWN_S = 20.0
# Steps that reach the stop are over within this.
FAST_S = 6.0
LONG_S = 60.0
POINTS = 500


def _until(t: Array, seconds: float) -> slice:
    end = int(np.searchsorted(t, seconds))
    return slice(0, end, max(end // POINTS, 1))


def responses(seen: Models | Unfitted) -> Drawn:
    models = fitted(seen)
    figure, axes = new(4.2, 1, 2)
    apart = []
    for v, color in zip(SHOWN_VOLTS, shades(len(SHOWN_VOLTS)), strict=True):
        record = models.traces[v].record
        rows = _until(record.t, SHOWN_S)
        t = record.t[rows]
        line(axes[0, 0], t, record.position[rows], color, f"{v:g} V", linewidth=2.4)
        line(axes[0, 1], t, record.rise[rows] + AMBIENT, color, f"{v:g} V", linewidth=2.4)
        for trial in models.data.steps[v]:
            x = trial["laser"][rows] * 1e-3
            warm = on_heating(models.table, x).temperature
            apart.append(float(np.std(x - record.position[rows])) * 1e3)
            axes[0, 0].plot(t, x, color=BLACK, linewidth=0.6, linestyle=(0, (1, 7)))
            axes[0, 1].plot(t, warm, color=BLACK, linewidth=0.6, linestyle=(0, (1, 7)))
    _name_steps(axes[0, 0], BELOW_STOP)
    finish(axes[0, 0], "(a) position by the laser", y=SHORT)
    finish(axes[0, 1], "(b) temperature inferred from it", y=HOT, legend="lower right", ncols=2)
    axes[0, 0].set_xlim(right=1.16 * SHOWN_S)  # room for the names
    return caption("5.10", figure, apart=max(apart), seconds=HELD_S)


def _name_steps(ax: Any, volts: Sequence[float]) -> None:
    """Write the CTRL of `volts` at the ends of their curves; the last two lie close together."""
    curves = {c.get_label(): c for c in ax.lines}
    for k, v in enumerate(volts):
        curve = curves[f"{v:g} V"]
        shift = 3 * (k == len(volts) - 1) - 3 * (k == len(volts) - 2)
        end = (curve.get_xdata()[-1], curve.get_ydata()[-1])
        note(ax, f"{v:g} V", end, (4, shift - 3), fontsize=7.5, color=curve.get_color())


def steady(seen: Models | Unfitted) -> Drawn:
    models = fitted(seen)
    fit = models.thesis
    volts = np.linspace(BELOW_STOP[0], 1.65, 120)
    figure, ax = single(3.8)
    curves: tuple[tuple[Exponential, str, str, str], ...] = (
        (fit.nonlinear.model, RED, "-", "non-linear least squares"),
        (fit.linearised.model, BLUE, "--", "linearised, as in the thesis"),
        (Exponential(), BLACK, ":", "(5.5) as printed"),
    )
    for model, color, style, label in curves:
        rise = np.array([exponential(model, float(v)) for v in volts])
        line(ax, volts, rise, color, label, linestyle=style)
    ax.axhline(fit.nonlinear.asymptote, color=RED, linewidth=0.7, linestyle=(0, (1, 3)))
    ax.plot(list(fit.steady), list(fit.steady.values()), "o", color=BLACK, label="measured")
    finish(ax, "", "CTRL [V]", "steady rise above ambient [K]", legend=True)
    return caption("5.11", figure, ambient=AMBIENT, fit=fit)


def _against_heating(models: Models, axes: Any, goal: Callable[[float], float]) -> None:
    """Panels (a), (b): inferred temperature (solid), (5.6) towards `goal` [K] (broken)."""
    full = full_contraction(models.table)
    shown = ((BELOW_STOP, LONG_S, "(a) 1.5-1.6 V"), (ABOVE_STOP, FAST_S, "(b) 1.65-1.8 V"))
    for ax, (volts, seconds, title) in zip(axes, shown, strict=True):
        for v, color in zip(volts, shades(len(volts)), strict=True):
            record = models.traces[v].record
            rows = _until(record.t, seconds)
            t = record.t[rows]
            made = goal(v) * step_response(models.thesis.heating.modes, t)
            known = np.isfinite(record.error[rows])
            line(ax, t, np.where(known, record.rise[rows] + AMBIENT, np.nan), color, f"{v:g} V")
            line(ax, t, made + AMBIENT, color, "", linestyle="--")
        ax.axhline(full, color=BLACK, linewidth=0.7, linestyle=":")
        ax.set_ylim(AMBIENT, full + 17.5)
        finish(ax, title, y=HOT if ax is axes[0] else "", legend="lower right")


def linear(seen: Models | Unfitted) -> Drawn:
    models = fitted(seen)
    fit = models.thesis
    figure, axes = new(3.9, 1, 3)
    _against_heating(models, axes[0, :2], lambda v: exponential(fit.nonlinear.model, v))
    t = np.linspace(0.0, 60.0, 600)
    printed = step_response(from_transfer(*heating.PRINTED), t)
    figure.subplots_adjust(wspace=0.24)
    line(axes[0, 2], t, printed, BLACK, "(5.6)")
    line(axes[0, 2], t, step_response(fit.heating.modes, t), RED, "identified", linestyle="--")
    finish(axes[0, 2], "(c)", y="$T / T_d$", legend=True)
    return caption("5.13", figure)


def draw_gain(_: Models | Unfitted) -> Drawn:
    volts, rise = curve(1.4, 1.85)
    lower, upper = exponentials(volts)
    figure, ax = single(3.6)
    line(ax, volts, lower, BLUE, "lower exponential", linestyle="--")
    line(ax, volts, upper, GREEN, "upper exponential", linestyle="-.")
    line(ax, volts, rise, BLACK, "weighted gain (5.8)", linewidth=1.8)
    finish(ax, "", "CTRL [V]", "$T_d$ above ambient [K]", legend=True)
    return caption("5.14", figure)


def weighted_gain(seen: Models | Unfitted) -> Drawn:
    models = fitted(seen)
    figure, axes = new(3.9, 1, 2)
    gain = models.thesis.model.gain
    _against_heating(models, axes[0], lambda v: weighted(gain, v))
    return caption("5.15", figure)


def draw_cooling(seen: Models | Unfitted) -> Drawn:
    models = fitted(seen)
    figure, ax = single(3.8)
    seconds = 2.5
    table, fit = models.table, cooling(models.table, models.data.warm, AMBIENT)
    times = []
    cold = [(f"{v:g} V to 0 V", trials) for v, trials in models.data.cooled.items()]
    warm = (f"{WARM:g} V to 0 V, cycled", models.data.warm)
    for (name, trials), color in zip((*cold, warm), (*shades(len(cold)), BLUE), strict=True):
        found = cooling(table, trials, AMBIENT)
        times.append(found.time)
        t, x = average(trials)
        begin = int(np.flatnonzero(trials[0]["ctrl"] > 0.0)[-1]) + 1
        rows = slice(begin, begin + round(seconds / trials[0].dt), 5)
        fall = on_cooling(table, x[rows], found.peak)
        known = (fall.slope > 0.0) & (fall.high - fall.low <= WIDEST_BAND)
        shown = np.where(known, fall.temperature, np.nan)
        line(ax, t[rows] - t[begin], shown, color, name)
    t = np.linspace(0.0, seconds, 200)
    for time, color, label in ((1.0, BLACK, "(5.9)"), (fit.time, RED, "first order, identified")):
        model = AMBIENT + (fit.peak - AMBIENT) * np.exp(-t / time)
        line(ax, t, model, color, label, linestyle="--")
    level = AMBIENT + (fit.peak - AMBIENT) * np.exp(-1.0)
    ax.plot([fit.time], [level], "o", color=RED, label=f"63 %: {fit.time:.2f} s")
    finish(ax, "", y=HOT, legend=True)
    return caption("5.16", figure, cycles=CYCLES_BEFORE, least=min(times), most=max(times))


def draw_whole(seen: Models | Unfitted) -> Drawn:
    models = fitted(seen)
    figure, axes = new(6.4, 2, 2)
    shown = ((BELOW_STOP, HELD_S, "1.5-1.6 V"), (ABOVE_STOP, FAST_S, "1.65-1.8 V"))
    for column, (volts, seconds, title) in enumerate(shown):
        for v, color in zip(volts, shades(len(volts)), strict=True):
            c = models.traces[v]
            rows = _until(c.record.t, seconds)
            for ax, model in zip(axes[:, column], (c.thesis, c.better), strict=True):
                line(ax, c.record.t[rows], c.record.position[rows], color, f"{v:g} V")
                line(ax, c.record.t[rows], model[rows], color, "", linestyle="--")
        key: Any = {"legend": "lower right"} if column else {"legend": "upper left", "ncols": 3}
        finish(axes[0, column], f"({'ab'[column]}) {title}", y=SHORT, **key)
        finish(axes[1, column], f"({'cd'[column]}) {title}, beyond the thesis", y=SHORT, **key)
        for ax in axes[:, column]:
            ax.set_ylim(-0.15, 4.3)
    others = [c for name, c in models.unseen.items() if name.endswith(" V")]
    thesis = 100.0 * max(c.thesis.dynamic for c in others)
    better = 100.0 * max(c.better.dynamic for c in others)
    steady, low, high = _shares(models)
    return caption("5.17", figure, steady=steady, low=low, high=high, thesis=thesis, better=better)


def collect(lab: Lab) -> Models | Unfitted:
    curves = kiln_runs.run(lab.kiln(), kiln_runs.cycles(), lab.seed)
    return actuator_models.attempt(fod_table([curves]), lab.bench(), lab.seed)


arithmetic = printed_gain
