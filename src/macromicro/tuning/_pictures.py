"""Figures of a tuning: the run before and after, and the open loops with their margins."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from macromicro.arrays import Array
from macromicro.design.margins import Complex, crossovers, frequencies, responses
from macromicro.design.response import smoothed
from macromicro.drawing.style import BLACK, BLUE, GREEN, RED, finish, line, new
from macromicro.models.macro import Linear
from macromicro.recording import Recording
from macromicro.runs.sequence import MEAN
from macromicro.tuning import _measuring, loops
from macromicro.tuning.tune import Tuning

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RESPONSE, BODE = "response", "bode"
_COLOURS = ((BLUE, "before", "-"), (RED, "after", "--"))


def drawn(found: Tuning) -> Iterator[tuple[str, Figure]]:
    if found.plan.request.stage == "macro":
        yield RESPONSE, _macro(found)
        if found.margins is not None:
            yield BODE, _bode(found)
    else:
        yield RESPONSE, _micro(found)


def _macro(found: Tuning) -> Figure:
    figure, axes = new(6.6, 3)
    runs = [shown.recording for shown in found.bench]
    until = _calm(runs)
    rows = slice(0, int(np.searchsorted(runs[0]["t"], until)))
    t = runs[0]["t"][rows]
    step = _measuring.STEP
    for k, (colour, name, style) in enumerate(_COLOURS):
        x = runs[k]["macro_position"][rows]
        line(axes[0, 0], t, x, colour, name, linestyle=style)
        line(axes[1, 0], t, step - x, colour, name, linestyle=style)
        line(axes[2, 0], t, runs[k]["motor"][rows], colour, name, linestyle=style)
    axes[0, 0].axhline(step, color=BLACK, linewidth=0.7, linestyle=":", label="reference")
    for edge in (-0.02 * step, 0.02 * step):
        axes[1, 0].axhline(edge, color=GREEN, linewidth=0.8, label="2 % band" if edge > 0 else None)
    axes[1, 0].set_ylim(-0.03 * step, 0.08 * step)
    finish(axes[0, 0], "(a) Step of the macro-stage on the bench", "", "[counts]", legend=True)
    finish(axes[1, 0], "(b) Error, close to the target", "", "[counts]", legend=True)
    finish(axes[2, 0], "(c) Effort at the D/A board, limited", y="[V]")
    return figure


def _calm(runs: list[Recording]) -> float:
    """End of the plots [s]: one and a half times the last change of the position."""
    last = 0.0
    for run in runs:
        moved = np.flatnonzero(np.diff(run["macro_position"]))
        last = max(last, float(run["t"][moved[-1]]) if len(moved) else 0.0)
    return min(max(1.5 * last, 0.2), float(runs[0]["t"][-1]))


def _micro(found: Tuning) -> Figure:
    figure, axes = new(6.6, 3)
    for k, (colour, name, style) in enumerate(_COLOURS):
        run = found.bench[k].recording
        t, place = run["t"], smoothed(run["laser"], MEAN)
        line(axes[0, 0], t, 1e-3 * place, colour, name, linestyle=style)
        error = 1e3 * run["micro_reference"] - place
        line(axes[1, 0], t, error, colour, name, linestyle=style)
        line(axes[2, 0], t, run["ctrl"], colour, name, linestyle=style)
    longest = max((s.recording for s in found.bench), key=len)
    line(axes[0, 0], longest["t"], longest["micro_reference"], BLACK, "reference", linewidth=0.7)
    for edge in (-10.0, 10.0):
        axes[1, 0].axhline(
            edge, color=GREEN, linewidth=0.8, label="10 um band" if edge > 0 else None
        )
    axes[1, 0].set_ylim(-60.0, 60.0)
    finish(axes[0, 0], "(a) Steps of the micro-stage on the bench, laser", "", "[mm]", legend=True)
    finish(axes[1, 0], "(b) Error by the laser, close to the target", "", "[um]", legend=True)
    finish(axes[2, 0], "(c) Effort CTRL", y="[V]")
    return figure


def _bode(found: Tuning) -> Figure:
    figure, axes = new(5.6, 2, sharex=True)
    dt = Linear().dt
    w = frequencies(dt, 600)
    marks, sizes = [], []
    assert found.margins is not None
    margins, settings = found.margins, (found.plan.start, found.tuned)
    for k, (colour, name, style) in enumerate(_COLOURS):
        loop = loops.macro_loop(settings[k].controller)
        at = responses(*loop, w, dt)
        phase = np.degrees(np.unwrap(np.angle(at)))
        phase -= 360.0 * round((phase[0] + 90.0) / 360.0)
        sizes.append(20.0 * np.log10(np.abs(at)))
        axes[0, 0].plot(w, sizes[k], colour, label=name, linestyle=style)
        axes[1, 0].plot(w, phase, colour, linestyle=style)
        for each in crossovers(*loop, dt):
            marks.append((each.frequency, each.phase_margin, colour))
        _mark_gain(axes[0, 0], w, at, margins[k].gain, colour, k)
    for row, (frequency, margin, colour) in enumerate(sorted(marks)):
        _mark(axes, frequency, margin, colour, row)
    lowest = min((frequency for frequency, _, _ in marks), default=1.0)
    axes[0, 0].axhline(0.0, color=BLACK, linewidth=0.7)
    axes[1, 0].axhline(-180.0, color=BLACK, linewidth=0.7)
    for ax in axes.flat:
        ax.set_xscale("log")
        ax.set_xlim(lowest / 30.0, w[-1])
    shown = w > lowest / 30.0
    every = np.concatenate([size[shown] for size in sizes])
    axes[0, 0].set_ylim(float(every.min()) - 10.0, max(float(every.max()), 20.0) + 10.0)
    title = "(a) Open loop with the linear model (4.4): gain, with the gain margins"
    finish(axes[0, 0], title, "", "[dB]", legend=True)
    finish(
        axes[1, 0],
        "(b) Phase, with the phase margins at the gain crossovers",
        "frequency [rad/s]",
        "[deg]",
    )
    return figure


def _mark(axes: Any, frequency: float, margin: float, colour: str, row: int) -> None:
    """A crossover in both panels; the margin as an upright line from -180 deg."""
    axes[0, 0].plot([frequency], [0.0], "o", color=colour, markersize=4)
    axes[1, 0].plot(
        [frequency] * 2, [-180.0, margin - 180.0], color=colour, linewidth=2.0, alpha=0.6
    )
    axes[1, 0].annotate(
        f"{margin:.1f} deg at {frequency:.3g} rad/s",
        (frequency, -180.0),
        xytext=(6, 2 - 12 * row) if row else (-6, -10),
        textcoords="offset points",
        ha="left" if row else "right",
        fontsize=7.5,
        color=colour,
    )


def _mark_gain(ax: Any, w: Array, at: Complex, factor: float, colour: str, row: int) -> None:
    """The gain margin as an upright line from 0 dB, where the loop is nearest to -1/factor."""
    if not math.isfinite(factor):
        return
    frequency = w[int(np.argmin(np.abs(at + 1.0 / factor)))]
    ax.plot(
        [frequency] * 2, [0.0, -20.0 * math.log10(factor)], color=colour, linewidth=2.0, alpha=0.6
    )
    ax.annotate(
        f"{20.0 * math.log10(factor):.1f} dB",
        (frequency, 0.0),
        xytext=(0, 6 + 11 * row),
        textcoords="offset points",
        fontsize=7.5,
        color=colour,
        ha="center",
    )
