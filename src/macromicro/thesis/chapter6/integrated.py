"""The integrated test (Chapter 6): both stages in turn, ten cycles. Claims I1 to I4 and I6."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from macromicro.arrays import Array, spans
from macromicro.control.supervisor import MICRO as FINE
from macromicro.control.supervisor import SETTLING
from macromicro.design.extension import RETURNED, Extension, extension
from macromicro.design.response import MICRO_BAND, smoothed
from macromicro.design.vibration import DECAYED, Vibration
from macromicro.drawing.exhibit import Drawn
from macromicro.drawing.style import BLUE, GREEN, ORANGE, PURPLE, RED, dots, finish, line, new, note
from macromicro.programme import MACRO, Programme
from macromicro.recording import Recording
from macromicro.thesis.chapter6 import integrated_runs as integrated
from macromicro.thesis.chapter6.integrated_runs import Bias, IntegratedRuns
from macromicro.thesis.contents import caption
from macromicro.thesis.procedure import Lab

if TYPE_CHECKING:
    from matplotlib.axes import Axes


# Of a cycle's sequences the second: the first that has a return to zero before it.
SHOWN = 1
GOAL_UM, HALF_ZOOM_UM = 5.0, 25.0
WINDOW_S = 0.05


class Part(NamedTuple):
    """Rows of a sequence of micro steps, and the return to zero before it, or None."""

    rows: slice
    before: Extension | None


def part(recording: Recording, single: Programme, cycle: int) -> Part:
    macros = np.flatnonzero(single.stage == MACRO)
    size, first = len(single.target), int(macros[SHOWN])
    after = int(macros[SHOWN + 1])
    index = recording["move"] - cycle * size
    fine = np.flatnonzero((index >= first) & (index < after) & (recording["phase"] == FINE))
    # The row of the reset still shows the reading from the reset before.
    rows = slice(int(fine[0]) + 1, int(fine[-1]) + 1) if len(fine) else slice(0, 0)
    number = cycle * size + first - 1
    own = [e for e in extension(recording) if e.move == number]
    return Part(rows, own[0] if own else None)


def cycling(runs: IntegratedRuns, number: str) -> Drawn:
    fan = number == "6.5"
    recording = runs.cooled if fan else runs.warm
    bias = integrated.cycle_bias(runs, recording)
    parts = [part(recording, runs.single, k) for k in (0, len(bias.cycles) - 1)]
    names = [f"cycle {k}" for k in (1, len(bias.cycles))]
    figure, axes = new(6.2, 2, 2)
    figure.subplots_adjust(right=0.94, wspace=0.25)
    full, near, back = axes[0, 0], axes[0, 1], axes[1, 0]
    near.axhspan(-GOAL_UM, GOAL_UM, color=GREEN, alpha=0.2, linewidth=0)
    for own, colour, name in zip(parts, ("0.6", BLUE), names, strict=True):
        since, reference, laser = _since(recording, own)
        line(full, since, 1e-3 * laser, colour, name)
        error = smoothed(laser - reference, round(WINDOW_S / recording.dt) | 1)
        line(near, since, error, colour, name)
        _return(back, recording, own, colour, name)
    since, reference, _ = _since(recording, parts[-1])
    line(full, since, 1e-3 * reference, ORANGE, "reference", linestyle="--")
    rows = parts[-1].rows
    hall = 1e3 * recording["hall_position"][rows] - reference
    hall = smoothed(hall, round(WINDOW_S / recording.dt) | 1)
    line(near, since, hall, RED, "Hall sensor", linewidth=0.8)
    near.set_ylim(-HALF_ZOOM_UM, HALF_ZOOM_UM)
    reset = "time since the laser's reset [s]"
    finish(full, "(a) full", reset, "laser [mm]", legend=True)
    finish(near, "(b) zoom", reset, "reading - reference [um]", legend=True)
    if not fan:
        _label(near, since, laser=recording["laser"][rows] - reference, bias=bias)
    back.axhline(RETURNED, color=GREEN, linestyle="--", linewidth=1.0)
    off = "time since switched off [s]"
    key: Any = {"legend": "upper right", "frameon": True, "framealpha": 0.85}
    finish(back, "(c) return to zero before it", off, "Hall [um]", **key)
    _by_cycle(axes[1, 1], bias)
    if not fan:
        return caption(number, figure, window=1e3 * WINDOW_S)
    first, last = bias.cycles[0], bias.cycles[-1]
    return caption(
        number,
        figure,
        window=1e3 * WINDOW_S,
        worst=bias.worst,
        first=_text(first.extension_s),
        last=_text(last.extension_s),
        left=_text(last.left_um),
    )


def _text(value: float | None) -> str:
    return "?" if value is None else f"{value:.2f}"


def _since(recording: Recording, own: Part) -> tuple[Array, Array, Array]:
    """Time since the reset [s], reference [um] and laser [um] of a sequence."""
    t = recording["t"][own.rows]
    reference = 1e3 * recording["micro_reference"][own.rows]
    return t - t[0], reference, recording["laser"][own.rows]


def _return(ax: Axes, recording: Recording, own: Part, colour: str, name: str) -> None:
    if own.before is None:
        return
    a, b = round(own.before.start_s / recording.dt), own.rows.start
    since = recording["t"][a:b] - recording["t"][a]
    hall = smoothed(1e3 * recording["hall_position"][a:b], 21)
    # Below 0.1 um there is nothing but the sensor's noise, and a logarithm has no zero.
    line(ax, since, np.where(hall > 0.1, hall, np.nan), colour, name)
    ax.set_yscale("log")
    left = own.before.left_um
    if left > 0.1:
        ax.plot(since[-1], left, color=colour, marker="o", fillstyle="none", ms=7)
        where = (8, 0) if colour == BLUE else (8, -6)
        note(ax, f"{left:.1f} um", (since[-1], left), where)
        # Room for the words to the right of the ring, where there is no noise.
        ax.set_xlim(right=max(ax.get_xlim()[1], 1.22 * since[-1]))


def _label(ax: Axes, since: Array, laser: Array, bias: Bias) -> None:
    last = bias.cycles[-1]
    if last.bias_um is None:
        return
    at = (since >= 3.4) & (since <= 3.9)
    if not at.any():
        return
    shown = float(laser[at].mean())
    arrow = {"arrowstyle": "->", "linewidth": 0.7}
    note(ax, f"bias {-shown:.1f} um", (3.65, shown), (0, -38), ha="center", arrowprops=arrow)


def _by_cycle(ax: Any, bias: Bias) -> None:
    number = [c.cycle for c in bias.cycles]

    def values(name: str) -> list[float]:
        found = [getattr(c, name) for c in bias.cycles]
        return [float("nan") if v is None else v for v in found]

    other = ax.twinx()
    ax.plot(number, values("extension_s"), "o-", color=BLUE, ms=4, label="return to 20 um (left)")
    for name, style, colour, size, width, label in (
        ("bias_um", "^-", RED, 4, 1.5, "bias by the laser"),
        ("left_um", "s-", ORANGE, 3.5, 0.9, "left at reset"),
        ("true_bias_um", "v-", GREEN, 3, 0.9, "true error (bench truth)"),
    ):
        if np.isfinite(values(name)).any():
            other.plot(number, values(name), style, color=colour, ms=size, lw=width, label=label)
    # The same scales with and without a fan, unless what was measured needs more.
    ax.set_ylim(0.0, np.nanmax([2.2, *(1.5 * v for v in values("extension_s"))]))
    other.set_ylim(-1.5, np.nanmax([12.0, *(1.8 * v for v in values("bias_um"))]))
    other.set_ylabel("bias, left, error [um]", fontsize=8.5, labelpad=1.0)
    other.tick_params(labelsize=8)
    other.spines[["top"]].set_visible(False)
    ax.tick_params(axis="y", colors=BLUE)
    handles = [*ax.get_lines(), *other.get_lines()]
    other.legend(handles=handles, fontsize=7, loc="upper left", ncols=2, framealpha=0.85)
    finish(ax, "(d) by cycle", "cycle", "return to 20 um [s]")
    ax.yaxis.label.set_color(BLUE)
    ax.xaxis.get_major_locator().set_params(integer=True)


def response(runs: IntegratedRuns) -> Drawn:
    """Figure 6.2: the whole system's response to the test input."""
    r, pitch = runs.warm, 1e3 * runs.settings.sensors.encoder.pitch
    moves = np.flatnonzero(runs.single.stage == MACRO)
    end = int(np.searchsorted(r["move"], len(runs.single.target)))
    second = int(np.searchsorted(r["move"], moves[1]))
    t, phase = r["t"], r["phase"][:end]
    place = r["macro_position"][:end] * pitch + r["hall_position"][:end]
    fine_goal = np.where(phase == FINE, r["micro_reference"][:end], 0.0)
    goal = r["macro_reference"][:end] * pitch + fine_goal
    figure, axes = new(5.6, 2, 2, sharex="col", gridspec_kw={"width_ratios": [1.3, 1]})
    for column, rows in enumerate((slice(0, end), slice(0, second + round(1.5 / r.dt)))):
        coarse, fine = axes[:, column]
        line(coarse, t[rows], goal[rows], ORANGE, "reference", linestyle="--")
        line(coarse, t[rows], place[rows], BLUE, "encoder + Hall sensor")
        line(fine, t[rows], r["micro_reference"][rows], ORANGE, "reference", linestyle="--")
        line(fine, t[rows], r["hall_position"][rows], GREEN, "Hall sensor")
    target = float(runs.single.target[moves[0]]) * pitch
    axes[0, 1].set_ylim(target - 2.0, target + 5.0)
    for ax in axes[:, 1]:
        waits = spans(phase[:second] == SETTLING)
        for a, b in waits:
            ax.axvspan(t[a], t[b - 1], color=PURPLE, alpha=0.2, linewidth=0)
        for k in np.flatnonzero(r["laser_reset"][:second]):
            ax.axvline(t[k], color=RED, linestyle=":", linewidth=1.2)
            ax.text(t[k] + 0.15, 0.92, "reset", fontsize=8, color=RED, **_on(ax))
        for a, _ in waits:
            ax.text(t[a] + 0.6, 0.5, "wait", fontsize=8, color="0.3", **_on(ax))
    finish(axes[0, 0], "(a) full", "", "whole system [mm]", legend=True)
    finish(axes[1, 0], "(c) micro-stage, full", y="contraction [mm]", legend=True)
    finish(axes[0, 1], "(b) zoom", "")
    finish(axes[1, 1], "(d) micro-stage, zoom")
    found = integrated.turns(r, runs.single)
    return caption("6.2", figure, moves=len(found), waited=found[0].waited)


def _on(ax: Axes) -> dict[str, object]:
    return {"transform": ax.get_xaxis_transform()}


def vibration(runs: IntegratedRuns) -> Drawn:
    r = runs.warm
    found = integrated.shaken(runs)
    calm = spans((r["phase"] == SETTLING) & (r["move"] == 0))
    end = calm[0][1] - 1 if calm else len(r) - 1
    rest = found[0].rest_s if found else float(r["t"][calm[0][0] if calm else 0])
    start = max(0, round((rest - 0.1) / r.dt))
    settled = float(r["laser"][end - (end - start) // 4 : end].mean())
    since, laser = r["t"][start:end] - rest, r["laser"][start:end] - settled
    figure, axes = new(5.4, 2, 2, gridspec_kw={"width_ratios": [1.5, 1]})
    height = 1.3 * max((v.amplitude_um for v in found), default=20.0)
    for ax, first, last in zip(axes[0], (-0.1, -0.02), (np.inf, 0.5), strict=True):
        rows = (since >= first) & (since <= last)
        ax.axhspan(-DECAYED, DECAYED, color=GREEN, alpha=0.25, linewidth=0, label="±2 um")
        line(ax, since[rows], laser[rows], BLUE, "laser", linewidth=0.8)
        if found:
            _envelope(ax, since[rows], found[0])
        ax.set_ylim(-height, height)
    x = "time since the carriage stands [s]"
    finish(axes[0, 0], "(a) full", x, "position [um]", legend=True)
    finish(axes[0, 1], "(b) zoom", x)
    peaks, decays = [v.amplitude_um for v in found], [v.decay_s for v in found]
    for ax, values, (low, high), printed, title in (
        (axes[1, 0], peaks, integrated.PEAK_UM, 20.0, "(c) first peak of the fit [um]"),
        (axes[1, 1], decays, integrated.DECAY_S, 2.0, "(d) fit down to 2 um [s]"),
    ):
        ax.axhspan(low, high, color=GREEN, alpha=0.15, linewidth=0)
        ax.axhline(printed, color="0.4", linestyle="--", linewidth=1.0)
        shown = [np.nan if v is None else v for v in values]
        dots(ax, np.arange(1, len(shown) + 1), shown, BLUE, "o")
        ax.set_ylim(0.0, 1.3 * high)
        finish(ax, title, "macro move")
        ax.margins(x=0.06)
    frequency = f" at {found[0].frequency_hz:.1f} Hz" if found else ""
    return caption(
        "6.3",
        figure,
        frequency=frequency,
        decayed=DECAYED,
        moves=len(found),
        peak=integrated.PEAK_UM,
        decay=integrated.DECAY_S,
    )


def _envelope(ax: Axes, since: np.ndarray[tuple[int], np.dtype[np.float64]], v: Vibration) -> None:
    """The fitted decay, which is 2 um when the vibration counts as over."""
    if v.decay_s is None:
        return
    after = since[since >= 0.0]
    decay = DECAYED * np.exp(v.decay_rate * (v.decay_s - after))
    line(ax, after, decay, RED, "fitted decay", linestyle="--")
    line(ax, after, -decay, RED, "", linestyle="--")


def squares(runs: IntegratedRuns) -> Drawn:
    r, dt = runs.square, runs.square.dt
    last = integrated.squares(runs)[-2:]
    t = r["t"][:-1]
    figure, axes = new(3.4, 1, 2, gridspec_kw={"width_ratios": [1, 1.3]})
    full, near = axes[0]
    for ax, rows in ((full, slice(0, len(t))), (near, slice(round(last[0].start_s / dt), len(t)))):
        line(ax, t[rows], r["micro_reference"][:-1][rows], ORANGE, "reference", linestyle="--")
        line(ax, t[rows], 1e-3 * r["laser"][:-1][rows], BLUE, "laser")
    for move in last:
        if move.arrived_s is not None:
            near.axvspan(move.start_s, move.arrived_s, color=PURPLE, alpha=0.2, linewidth=0)
            near.text(move.arrived_s + 0.08, 2.0, f"{move.settling_s:.2f} s", fontsize=8.5)
    finish(full, "(a) all", y="contraction [mm]", legend=True)
    finish(near, "(b) the last")
    time = integrated.cycle_time(runs)
    both = time.contraction + time.extension
    shown = {"range": integrated.RANGE_MM, "band": MICRO_BAND, "both": both, "rate": 1.0 / both}
    return caption("6.5 (squares)", figure, **shown)


def collect(lab: Lab) -> IntegratedRuns:
    return integrated.collect(lab.settings, lab.seed, lab.runner())


cycling_warm = partial(cycling, number="6.4")
cycling_cooled = partial(cycling, number="6.5")
claims = integrated.claims
