"""The integrated test (Chapter 6): both stages in turn, ten cycles. Claims I1 to I4 and I6."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from macromicro.control.supervisor import MICRO as FINE
from macromicro.control.supervisor import SETTLING
from macromicro.design.response import MICRO_BAND
from macromicro.design.vibration import DECAYED, Vibration
from macromicro.drawing.exhibit import Drawn
from macromicro.drawing.style import BLUE, GREEN, ORANGE, PURPLE, RED, finish, line, new
from macromicro.programme import MACRO
from macromicro.thesis.captions import captioned
from macromicro.thesis.chapter6 import integrated_runs as integrated
from macromicro.thesis.chapter6._cycling_figures import cycling
from macromicro.thesis.chapter6.integrated_runs import IntegratedRuns
from macromicro.thesis.claims import measured_by
from macromicro.thesis.procedure import Lab, Procedure

if TYPE_CHECKING:
    from matplotlib.axes import Axes


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
        waits = _spans(phase[:second] == SETTLING)
        for a, b in waits:
            ax.axvspan(t[a], t[b], color=PURPLE, alpha=0.2, linewidth=0)
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
    return captioned("6.2", figure, moves=len(found), waited=found[0].waited)


def _on(ax: Axes) -> dict[str, object]:
    return {"transform": ax.get_xaxis_transform()}


def _spans(holds: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> list[tuple[int, int]]:
    padded = np.r_[False, holds, False]
    begin, end = (
        np.flatnonzero(~padded[:-1] & padded[1:]),
        np.flatnonzero(padded[:-1] & ~padded[1:]),
    )
    return [(int(a), int(b) - 1) for a, b in zip(begin, end, strict=True)]


def vibration(runs: IntegratedRuns) -> Drawn:
    r = runs.warm
    found = integrated.shaken(runs)
    calm = _spans((r["phase"] == SETTLING) & (r["move"] == 0))
    end = calm[0][1] if calm else len(r) - 1
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
    for ax, values, low, high, printed, title in (
        (
            axes[1, 0],
            [v.amplitude_um for v in found],
            *integrated.PEAK_UM,
            20.0,
            "(c) first peak of the fit [um]",
        ),
        (
            axes[1, 1],
            [v.decay_s for v in found],
            *integrated.DECAY_S,
            2.0,
            "(d) fit down to 2 um [s]",
        ),
    ):
        ax.axhspan(low, high, color=GREEN, alpha=0.15, linewidth=0)
        ax.axhline(printed, color="0.4", linestyle="--", linewidth=1.0)
        shown = [np.nan if v is None else v for v in values]
        ax.plot(np.arange(1, len(shown) + 1), shown, color=BLUE, marker="o", ms=5, linestyle="")
        ax.set_ylim(0.0, 1.3 * high)
        finish(ax, title, "macro move")
        ax.margins(x=0.06)
    frequency = f" at {found[0].frequency_hz:.1f} Hz" if found else ""
    return captioned(
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
    for ax, rows in zip(
        (full, near), (slice(0, len(t)), slice(round(last[0].start_s / dt), len(t))), strict=True
    ):
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
    return captioned(
        "6.5 (squares)",
        figure,
        range=integrated.RANGE_MM,
        band=MICRO_BAND,
        both=both,
        rate=1.0 / both,
    )


def collect(lab: Lab) -> IntegratedRuns:
    return integrated.collect(lab.settings, lab.seed, lab.runner())


PROCEDURE = Procedure(
    name="integrated",
    title="The integrated system",
    sections=("6.1", "6.2", "6.3", "6.3.1", "6.4.2"),
    channels=("encoder", "hall", "laser"),
    ids=measured_by("integrated"),
    figures={
        "6.2": response,
        "6.3": vibration,
        "6.4": partial(cycling, number="6.4"),
        "6.5": partial(cycling, number="6.5"),
        "6.5 (squares)": squares,
    },
    diagrams=("6.1",),
    seconds=3.0,
    collect=collect,
    claims=integrated.claims,
)
