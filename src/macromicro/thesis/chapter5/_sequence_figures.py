"""Figures of the micro-stage's sequential steps: 5.23, 5.25 and 5.27."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from macromicro.drawing.exhibit import Drawn
from macromicro.drawing.style import BLACK, BLUE, GREEN, ORANGE, RED, finish, line, new
from macromicro.recording import Recording
from macromicro.runs import sequence
from macromicro.thesis.captions import captioned
from macromicro.thesis.chapter5 import micro_runs as micro
from macromicro.thesis.chapter5._gain_figures import column, millimetres
from macromicro.thesis.chapter5.micro_runs import MicroRuns

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

HALF_ZOOM_UM, GOAL_UM = 25.0, 5.0
Laws = Sequence[tuple[Recording, str, str]]


def _three(laws: Laws) -> tuple[Figure, tuple[Axes, Axes, Axes]]:
    figure, axes = new(6.2, 3, 1, sharex=True)
    work, integral, place = axes[:, 0]
    first = laws[0][0]
    reference = first["micro_reference"][:-1]
    for recording, colour, name in laws:
        t = recording["t"][:-1]
        line(work, t, column("ctrl")(recording), colour, name)
        line(integral, t, column("micro_integral")(recording), colour, name)
        line(place, t, millimetres(recording), colour, name)
    line(place, first["t"][:-1], reference, BLACK, "reference", linestyle="--", linewidth=0.9)
    finish(work, "(a) controller output", "", "CTRL [V]", legend=len(laws) > 1)
    finish(integral, "(b) integral effort", "", "effort [V]")
    finish(place, "(c) position by the laser", y="position [mm]", legend=True)
    return figure, (work, integral, place)


def windup(runs: MicroRuns) -> Drawn:
    figure, (work, integral, _) = _three([(runs.pi, BLUE, "PI, Ki 2.25")])
    fall = sequence.TIMES[2]
    saturated = _saturated(runs.pi, fall)
    for ax in (work, integral):
        for begin, end in saturated:
            ax.axvspan(begin, end, color=ORANGE, alpha=0.25, linewidth=0)
    low = micro.undershoot(runs.pi, fall)
    integral.annotate(
        f"falls {low:.2f} V too far",
        (fall + 0.25, float(runs.pi["micro_integral"][round((fall + 0.25) / runs.pi.dt)])),
        (30, 14),
        textcoords="offset points",
        fontsize=8,
        arrowprops={"arrowstyle": "-", "linewidth": 0.6},
    )
    left = abs(micro.error_after(runs.pi, fall))
    return captioned("5.23", figure, left=left)


def _saturated(recording: Recording, since: float) -> list[tuple[float, float]]:
    """Spans of at least 20 ms with CTRL at 0 V, from `since` [s] on."""
    low = np.r_[False, recording["ctrl"][:-1] <= 0.0, False]
    begin, end = np.flatnonzero(~low[:-1] & low[1:]), np.flatnonzero(low[:-1] & ~low[1:])
    dt = recording.dt
    return [
        (float(a * dt), float(b * dt))
        for a, b in zip(begin, end, strict=True)
        if (b - a) * dt >= 0.02 and a * dt >= since
    ]


def anti_windup(runs: MicroRuns) -> Drawn:
    colours = (BLUE, GREEN)
    laws = [(runs.pi, "0.6", "PI alone, Ki 2.25")]
    laws += [
        (r, c, f"Ki = Kaw {k:g}")
        for (k, r), c in zip(sorted(runs.gentle.items()), colours, strict=True)
    ]
    figure, _ = _three(laws)
    return captioned("5.25", figure)


def final(runs: MicroRuns) -> Drawn:
    figure, axes = new(6.2, 2, 2)
    recording = runs.antiwindup
    t = recording["t"][:-1]
    reference, place = recording["micro_reference"][:-1], millimetres(recording)
    full = axes[0, 0]
    line(full, t, reference, ORANGE, "reference", linestyle="--")
    line(full, t, place, BLUE, "laser")
    finish(full, "(a) full", y="position [mm]", legend=True)
    near = axes[0, 1]
    near.axhspan(-GOAL_UM, GOAL_UM, color=GREEN, alpha=0.2, linewidth=0, label="±5 um")
    line(near, t, 1e3 * (place - reference), BLUE, "laser - reference", linewidth=0.8)
    near.set_ylim(-HALF_ZOOM_UM, HALF_ZOOM_UM)
    finish(near, "(b) zoom", y="[um]", legend=True)
    _settling(axes[1, 0], runs)
    _holds(axes[1, 1], runs)
    return captioned("5.27", figure, holds=len(runs.held) * len(micro.HOLDS))


def _settling(ax: Axes, runs: MicroRuns) -> None:
    starts = (0.0, *sequence.LEVELS[:-1])
    names = [f"{1e3 * a:g} to {1e3 * b:g}" for a, b in zip(starts, sequence.LEVELS, strict=True)]
    place = np.arange(len(names))
    for band, colour, marker, label in (
        (None, GREEN, "s", "2 % of the step"),
        (sequence.BAND_UM, BLUE, "o", "10 um"),
        (GOAL_UM, RED, "^", "5 um"),
    ):
        times = sequence.settling(runs.antiwindup, band)
        ax.plot(place, times, color=colour, marker=marker, ms=5, linestyle="", label=label)
    for value, left in ((0.5, -0.4), (1.0, 1.6)):
        ax.plot([left, left + 1.8], [value, value], color="0.4", linestyle="--", linewidth=1.0)
    ax.set_xticks(place, names)
    ax.set_ylim(bottom=0.0)
    finish(ax, "(c) settling", "step [mm]", "time [s]", legend=True)


def _holds(ax: Axes, runs: MicroRuns) -> None:
    levels, errors = micro.hold_errors(runs)
    ax.axhspan(-GOAL_UM, GOAL_UM, color=GREEN, alpha=0.2, linewidth=0)
    ax.plot(levels, errors, color=BLUE, marker="o", ms=3.5, linestyle="")
    ax.set_ylim(-1.5 * GOAL_UM, 1.5 * GOAL_UM)
    finish(ax, "(d) error at rest", "level [mm]", "[um]")
    ax.margins(x=0.04)
