"""Hysteresis in the kiln (Section 5.2.1): Figures 5.5 to 5.9 and D.5 to D.7."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.drawing.exhibit import Drawn
from macromicro.drawing.style import BLACK, BLUE, GREEN, RED, finish, line, new, shades, single
from macromicro.hysteresis.table import FodTable
from macromicro.identify import kiln as kiln_fit
from macromicro.identify.kiln import Prediction, clean, window_means, without_spikes
from macromicro.recording import Recording
from macromicro.thesis.chapter5 import kiln_runs
from macromicro.thesis.chapter5.actuator_models import full_contraction
from macromicro.thesis.chapter5.kiln_runs import KilnData
from macromicro.thesis.claims import NOT_MEASURED, Claim, judge, state, within
from macromicro.thesis.contents import caption
from macromicro.thesis.procedure import Lab

if TYPE_CHECKING:
    from matplotlib.figure import Figure


TRUTH = "true_thermocouple"
ENCODER_MM = 0.014  # a count of the kiln's encoder, Section 5.2.1


class KilnRuns(NamedTuple):
    heated: KilnData  # as recorded
    table: FodTable  # of Figure 5.8, from the heating cycles
    predictions: list[Prediction]  # by (5.1), one for each new profile


def identify(heated: KilnData) -> KilnRuns:
    table = kiln_fit.fod_table([heated.curves])
    return KilnRuns(heated, table, [kiln_fit.predict(table, r) for r in heated.tests])


class Spikes(NamedTuple):
    """Effect of the smoothing; errors against the true temperature [K], NaN if unknown."""

    spikes: int
    changed: float  # share of the samples
    largest: float  # change [K]
    raw_max: float = np.nan
    raw_rms: float = np.nan
    smooth_rms: float = np.nan


def spikes(recording: Recording) -> Spikes:
    """Smoothing of Figure 5.4; its errors are NaN where the true temperature is not known."""
    shown = recording["thermocouple"]
    smooth = without_spikes(recording["t"], shown)
    seen = Spikes(
        smooth.spikes, float(smooth.replaced.mean()), float(np.abs(smooth.values - shown).max())
    )
    if TRUTH not in recording:
        return seen
    raw, left = shown - recording[TRUTH], smooth.values - recording[TRUTH]
    return seen._replace(
        raw_max=float(np.abs(raw).max()),
        raw_rms=float(np.sqrt(np.mean(raw**2))),
        smooth_rms=float(np.sqrt(np.mean(left**2))),
    )


def claims(runs: KilnRuns) -> list[Claim]:
    return judge(
        [
            ("S1", lambda: _spikes(spikes(runs.heated.curves))),
            ("S2", lambda: _preisach(runs)),
            ("S6", lambda: _full(runs.table)),
        ]
    )


def _spikes(s: Spikes) -> Claim:
    share = 100.0 * s.changed
    if not np.isfinite(s.smooth_rms):
        return state("S1", None, NOT_MEASURED, wording="unknown", seen=s, share=share)
    verdict = within("S1", s.raw_max, s.smooth_rms)
    return state("S1", [s.raw_max, s.smooth_rms], verdict, wording="compared", seen=s, share=share)


def _preisach(runs: KilnRuns) -> Claim:
    worst = 100.0 * max(p.share for p in runs.predictions)
    return state("S2", worst, profiles=len(runs.predictions))


def _full(table: FodTable) -> Claim:
    full = full_contraction(table, ENCODER_MM / table.span)
    return state(
        "S6",
        full,
        count=1e3 * ENCODER_MM,
        share=100.0 * ENCODER_MM / table.span,
        early=full_contraction(table),
    )


HOT = "temperature [degC]"
SHORT = "contraction [mm]"
# As the table's curves are averaged: a mean closes after this many degC.
AVERAGED = 0.4
EXAMPLES = 6
# Of the test profiles, all but the last are in Figure 5.9 and the last in D.7.
IN_5_9 = 2


def first_cycle(recording: Recording) -> Recording:
    """The record up to where the heater is switched on for the second time."""
    on = np.flatnonzero(np.diff(recording["heater"] > 0, prepend=False) & (recording["heater"] > 0))
    rows = slice(0, int(on[1]) if len(on) > 1 else len(recording))
    arrays = [recording[c.name][rows] for c in recording.columns]
    return Recording.from_arrays(recording.columns, arrays, recording.dt, {})


def smoothing(runs: KilnRuns) -> Drawn:
    example = first_cycle(runs.heated.curves)
    t, shown = example["t"], example["thermocouple"]
    smooth = without_spikes(t, shown)
    figure, axes = new(5.4, 2, sharex=True, sharey=True)
    line(axes[0, 0], t, shown, BLUE, "thermocouple", linewidth=0.8)
    line(axes[1, 0], t, smooth.values, BLUE, "smoothed", linewidth=0.8)
    finish(axes[0, 0], "(a) as measured", "", HOT)
    finish(axes[1, 0], "(b) smoothed", y=HOT)
    return caption("5.5", figure, smooth=smooth)


def loop(runs: KilnRuns) -> Drawn:
    example = first_cycle(runs.heated.curves)
    t, x = example["t"], example["position"]
    smooth = without_spikes(t, example["thermocouple"]).values
    profile = clean(example)
    u, mean = window_means(profile.temperature, profile.position, len(t), AVERAGED)
    rising = int(np.argmax(u))
    middle = float(np.interp(0.5 * mean.max(), mean[: rising + 1], u[: rising + 1]))
    near = (middle - 4.0, middle + 4.0)
    inside = (smooth > near[0]) & (smooth < near[1]) & (np.arange(len(t)) < np.argmax(smooth))
    figure, axes = new(3.9, 1, 2, gridspec_kw={"width_ratios": [1.4, 1]})
    for ax, every in zip(axes[0], (4, 1), strict=True):
        ax.plot(smooth, x, color=BLUE, linewidth=0.8, label="smoothed record")
        few = {"markevery": every, "markersize": 3.5, "markerfacecolor": "none"}
        ax.plot(u, mean, "D", color=RED, label="averaged", **few)
    finish(axes[0, 0], "(a) whole loop", HOT, SHORT, legend=True)
    finish(axes[0, 1], "(b) zoom: heating", HOT, SHORT)
    axes[0, 1].set(xlim=near, ylim=(float(x[inside].min()) - 0.1, float(x[inside].max()) + 0.1))
    return caption("5.6", figure, window=AVERAGED, points=len(u), samples=len(t))


def _rising(ax: Any, table: FodTable, label: str, **options: Any) -> None:
    grid, rising, _ = table.major_loop
    ax.plot(grid, rising, color=BLACK, linewidth=1.2, label=label, **options)


def curves(runs: KilnRuns) -> Drawn:
    table = runs.table
    figure, ax = single(4.2)
    curves = sorted(table.raw, key=lambda c: float(c[0][0]))
    for (u, f), color in zip(curves, shades(len(curves)), strict=True):
        ax.plot(u, f, color=color, linewidth=0.8)
        ax.plot(u[:1], f[:1], "o", color=color, markersize=3)
    _rising(ax, table, "rising branch of the table", linestyle="--")
    full = full_contraction(table)
    ax.axvline(full, color=RED, linewidth=0.9, linestyle=":")
    ax.lines[-1].set_label(f"full contraction, {full:.1f} degC")
    finish(ax, "", HOT, SHORT, legend=True)
    return caption("5.7", figure, curves=len(curves))


def _three_d(figure: Figure, ax: Any) -> None:
    ax.set_xlabel("$M_k$ [degC]", fontsize=8.5)
    ax.set_ylabel("$m_k$ [degC]", fontsize=8.5)
    ax.set_zlabel(SHORT, fontsize=8.5)
    ax.view_init(elev=26.0, azim=-128.0)
    ax.set_box_aspect((1.25, 1.25, 0.8))
    figure.subplots_adjust(left=0.0, right=1.0, bottom=0.03, top=1.0)


def surface(runs: KilnRuns) -> Drawn:
    table = runs.table
    figure, axes = new(4.8, 1, subplot_kw={"projection": "3d"})
    every = 3
    grid, height = table.grid[::every], table.first_order[::every, ::every]
    top, low = np.meshgrid(grid, grid, indexing="ij")
    # Above the diagonal there is no m_k: its cells get the value on the diagonal, no height.
    rising = np.diag(height)
    flat = np.where(np.isnan(height), rising[:, None], height)
    axes[0, 0].plot_surface(
        top, np.minimum(low, top), flat, cmap="viridis", rcount=26, ccount=51, linewidth=0.2
    )
    _three_d(figure, axes[0, 0])
    return caption("5.8", figure, table=table)


def _pair(axes: Any, p: Prediction, letters: str, name: str, legend: bool) -> None:
    t, u, x = p.profile
    line(axes[0], t, x, BLUE, "measured", linewidth=1.6)
    line(axes[0], t, p.model, RED, "Preisach model", linestyle="--")
    every = slice(None, None, max(len(t) // 4000, 1))
    axes[1].plot(u[every], x[every], color=BLUE, linewidth=1.6, label="measured")
    axes[1].plot(u[every], p.model[every], "--", color=RED, linewidth=1.1, label="model")
    finish(axes[0], f"({letters[0]}) {name}", y=SHORT, legend=legend)
    finish(axes[1], f"({letters[1]}) {name}", HOT, SHORT)


def comparison(runs: KilnRuns) -> Drawn:
    predictions = runs.predictions[:IN_5_9]
    figure, axes = new(2.9 * len(predictions), len(predictions), 2)
    for k, p in enumerate(predictions):
        _pair(axes[k], p, "abcdefgh"[2 * k : 2 * k + 2], f"profile {k + 1}", k == 0)
    shares = " and ".join(f"{100.0 * p.share:.2f} %" for p in predictions)
    return caption("5.9", figure, shares=shares)


def _choose_curves(table: FodTable) -> list[tuple[Array, Array]]:
    """Raw curves whose maxima divide the stroke most evenly, lowest first."""
    curves = sorted(table.raw, key=lambda c: float(c[1][0]))
    starts = np.array([f[0] for _, f in curves])
    goals = np.linspace(0.08, 1.0, EXAMPLES) * starts.max()
    picked = sorted({int(np.argmin(np.abs(starts - goal))) for goal in goals})
    return [curves[k] for k in picked]


def examples(runs: KilnRuns) -> Drawn:
    table = runs.table
    chosen = _choose_curves(table)
    figure, ax = single(4.2)
    _rising(ax, table, "rising branch", linestyle="--")
    for (u, f), color in zip(chosen, shades(len(chosen)), strict=True):
        ax.plot(u[::3], f[::3], "o", color=color, markersize=2.6, label=f"$M_k$ = {u[0]:.1f} degC")
        inputs = np.linspace(u[0], u[-1], 200)
        ax.plot(inputs, table.curve(float(u[0]), inputs), color=color, linewidth=0.9)
    finish(ax, "", HOT, SHORT, legend=True)
    return caption("D.5", figure, chosen=len(chosen), curves=len(table.raw))


def points(runs: KilnRuns) -> Drawn:
    table = runs.table
    figure, axes = new(4.8, 1, subplot_kw={"projection": "3d"})
    top = np.concatenate([np.full(len(u), u[0]) for u, _ in table.raw])
    low = np.concatenate([u for u, _ in table.raw])
    f = np.concatenate([f for _, f in table.raw])
    axes[0, 0].scatter(top, low, f, c=f, cmap="viridis", s=3.0, depthshade=False)
    _three_d(figure, axes[0, 0])
    return caption("D.6", figure, points=len(f))


def another(runs: KilnRuns) -> Drawn:
    k = IN_5_9
    p = runs.predictions[k]
    figure, axes = new(5.6, 2, 2)
    _pair(axes[0], p, "ab", f"profile {k + 1}", True)
    line(axes[1, 0], p.profile.t, p.profile.temperature, GREEN, "smoothed temperature")
    finish(axes[1, 0], f"(c) profile {k + 1}", y=HOT)
    error = 1e3 * (p.model - p.profile.position)
    line(axes[1, 1], p.profile.t, error, BLACK, "model - measured", linewidth=0.6)
    finish(axes[1, 1], f"(d) profile {k + 1}", y="model - measured [um]")
    return caption("D.7", figure, error=100.0 * p.share)


def collect(lab: Lab) -> KilnRuns:
    return identify(kiln_runs.collect(lab.kiln(), lab.seed))
