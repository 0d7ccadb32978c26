"""Figures of a tuning: the run before and after, and the open loops of the linear model."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from macromicro.arrays import Array
from macromicro.drawing import phases
from macromicro.drawing.page import PageFigure
from macromicro.drawing.style import BLACK, BLUE, GREEN, RED, finish, line, new
from macromicro.machines.loops import Complex, margins
from macromicro.tuning.search import AFTER, BEFORE, Tuning
from macromicro.tuning.subject import Bode

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RESPONSE, BODE = "response", "bode"
_STYLES = ((RED, BEFORE, "--"), (BLUE, AFTER, "-"))


def draw(found: Tuning) -> Iterator[PageFigure]:
    caption = "The machine itself, with the gains before and with the best."
    yield PageFigure(RESPONSE, "Before and after", caption, _response(found))
    before, after = (found.subject.bodes(v.settings) for v in (found.first, found.best))
    if before:
        caption = "Dots: where the gain falls through 1, with the phase margin."
        yield PageFigure(BODE, "Open loops", caption, _bodes(before, after))


def _response(found: Tuning) -> Figure:
    seed = found.budget.seed
    runs = [found.subject.panels(v.settings, seed) for v in (found.first, found.best)]
    figure, axes = new(max(3.4, 2.2 * len(runs[0])), len(runs[0]), sharex=True)
    for k, ax in enumerate(axes[:, 0]):
        for (colour, name, style), run in zip(_STYLES, runs, strict=True):
            line(ax, run[k].t, run[k].y, colour, name, linestyle=style)
        panel = runs[0][k]
        if panel.target is not None:
            longest = max((run[k] for run in runs), key=lambda p: len(p.t))
            assert longest.target is not None
            line(ax, *longest.target, BLACK, "set point", linewidth=0.7)
        if panel.band is not None:
            for edge in (-panel.band, panel.band):
                ax.axhline(edge, color=GREEN, linewidth=0.8, linestyle=":")
        if panel.limits is not None:
            ax.set_ylim(*panel.limits)
        x = "time [s]" if ax is axes[-1, 0] else ""
        finish(ax, panel.title, x, f"[{panel.unit}]", legend=True)
    return figure


def _bodes(before: Sequence[Bode], after: Sequence[Bode]) -> Figure:
    figure, axes = new(5.6, 2, len(before), sharex="col")
    for k, pair in enumerate(zip(before, after, strict=True)):
        _bode(axes[0, k], axes[1, k], pair)
    return figure


def _bode(gain: Any, phase: Any, pair: Sequence[Bode]) -> None:
    frequency, loops = pair[0].frequency, [bode.loop for bode in pair]
    found = [margins(frequency, loop) for loop in loops]
    for (colour, name, style), loop, margin in zip(_STYLES, loops, found, strict=True):
        label = f"{name}: phase margin {margin.phase:.1f} deg at {margin.crossover:.3g} Hz"
        gain.semilogx(frequency, _decibels(loop), colour, linestyle=style, label=name)
        phase.semilogx(frequency, phases.degrees(loop, loop), colour, linestyle=style, label=label)
        gain.plot([margin.crossover], [0.0], "o", color=colour, markersize=4)
        phase.plot([margin.crossover], [margin.phase - 180.0], "o", color=colour, markersize=4)
    lowest = np.nanmin([margin.crossover for margin in found] + [frequency[-1]])
    shown = frequency >= lowest / 30.0
    sizes = np.concatenate([_decibels(loop[shown]) for loop in loops])
    gain.set_xlim(frequency[shown][0], frequency[-1])
    gain.set_ylim(max(float(sizes.min()), -120.0) - 5.0, float(sizes.max()) + 5.0)
    gain.axhline(0.0, color=BLACK, linewidth=0.7)
    phase.axhline(-180.0, color=BLACK, linewidth=0.7)
    finish(gain, pair[0].title, "", "gain [dB]", legend=True)
    finish(phase, "Phase", "frequency [Hz]", "[deg]", legend="lower left")


def _decibels(loop: Complex) -> Array:
    return np.asarray(20.0 * np.log10(np.abs(loop)))
