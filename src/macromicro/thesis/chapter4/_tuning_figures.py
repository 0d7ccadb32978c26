"""Tuning of the macro-stage's PD in simulation: Figures 4.22 and 4.23."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.design.margins import PdTaps, open_loop
from macromicro.drawing.exhibit import Drawn
from macromicro.drawing.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, RED, finish, line, new
from macromicro.lab.drive import DT
from macromicro.models.macro import Linear, position_transfer
from macromicro.thesis.captions import captioned
from macromicro.thesis.chapter4 import pd_route
from macromicro.thesis.chapter4._design import Design
from macromicro.thesis.chapter4.pd_route import LIMIT, STEP, Trial

RATIOS = (0.8, 1.0, 1.05, 1.2, 1.5)  # of the sweep, beside the one at the limit
FREQUENCIES = (9.91, 6.5, 4.91, 4.0, 3.0)  # rad/s, beside the rule's
_COLOURS = (PURPLE, ORANGE, BLUE, GREEN, RED, BLACK)
SHOWN = 1.2  # s
ZOOMED = (0.4, SHOWN)
MARGINS = (1.0, 200.0)  # rad/s


def _curves(ax: Any, trials: Mapping[str, Array], rows: slice) -> None:
    for (label, values), color in zip(trials.items(), _COLOURS, strict=True):
        t = np.asarray(np.arange(len(values)) * DT, dtype=np.float64)
        line(ax, t[rows], values[rows], color, label)


def ratios(design: Design) -> Drawn:
    shown: dict[str, Trial] = {f"{ratio:g}": design.ratios[ratio] for ratio in RATIOS}
    shown[f"{design.ratio:.2f}"] = design.at_limit
    figure, axes = new(3.8, 1, 2)
    rows = slice(0, round(SHOWN / DT))
    _curves(axes[0, 0], {k: v.effort for k, v in shown.items()}, rows)
    _curves(axes[0, 1], {k: v.position for k, v in shown.items()}, rows)
    axes[0, 0].axhline(LIMIT, color=BLACK, linestyle="--", linewidth=0.9)
    axes[0, 0].set_ylim(-6.0, 16.0)
    axes[0, 0].legend(
        fontsize=7.5,
        loc="upper right",
        ncols=2,
        frameon=False,
        title="damping ratio",
        title_fontsize=7.5,
    )
    axes[0, 1].set_ylim(STEP - 60.0, STEP + 30.0)
    finish(axes[0, 0], "(a) controller output; dashed: 5 V", y="requested output [V]")
    finish(axes[0, 1], "(b) zoom of the response", y="position [counts]")
    axes[0, 1].set_xlim(*ZOOMED)
    asked = design.ratios[1.05]
    return captioned("4.22", figure, step=STEP, asked=asked, design=design)


def frequencies(design: Design) -> Drawn:
    """Figure 4.23, with the margins of (4.9) and (4.10) in two panels."""
    rule = design.rule.crossover.frequency
    shown: dict[str, Trial] = {f"{w:g}": design.frequencies[w] for w in FREQUENCIES}
    shown[f"{rule:.2f}"] = design.rule
    figure, axes = new(6.2, 2, 2)
    rows = slice(0, round(SHOWN / DT))
    for ax in axes[0]:
        _curves(ax, {k: v.position for k, v in shown.items()}, rows)
    bare = design.bare[4.91].position
    t = np.asarray(np.arange(len(bare)) * DT, dtype=np.float64)
    for ax in axes[0]:
        line(ax, t[rows], bare[rows], BLUE, "4.91, no derivative", linestyle="--", linewidth=0.9)
    axes[0, 1].set_ylim(STEP - 60.0, STEP + 25.0)
    axes[0, 0].legend(
        fontsize=7.5,
        loc="lower right",
        frameon=False,
        title="crossover [rad/s]",
        title_fontsize=7.5,
    )
    finish(axes[0, 0], "(a) full", y="position [counts]")
    finish(axes[0, 1], "(b) zoom", y="position [counts]")
    axes[0, 1].set_xlim(*ZOOMED)
    _margins(axes[1, 0], axes[1, 1])
    tuned, initial = (
        pd_route.crossover(taps) for taps in (pd_route.TUNED_TAPS, pd_route.INITIAL_TAPS)
    )
    return captioned("4.23", figure, step=STEP, rule=rule, initial=initial, tuned=tuned)


def _margins(gains: Any, phases: Any) -> None:
    plus = PdTaps(pd_route.TUNED_TAPS.now, -pd_route.TUNED_TAPS.before)
    loops = (
        (pd_route.INITIAL_TAPS, ORANGE, "(4.9)", "-"),
        (pd_route.TUNED_TAPS, BLUE, "(4.10), minus", "-"),
        (plus, RED, "(4.10) as printed", "--"),
    )
    w = np.geomspace(*MARGINS, 300)
    z = np.exp(1j * w * DT)
    for taps, color, label, style in loops:
        num, den = open_loop(taps, *position_transfer(Linear()))
        values = np.polyval(num, z) / np.polyval(den, z)
        at = pd_route.crossover(taps)
        phase = np.degrees(np.unwrap(np.angle(values)))
        # The first frequency lies where the loop is an integrator, about -90 deg.
        phase -= 360.0 * round((float(phase[0]) + 90.0) / 360.0)
        gains.loglog(w, np.abs(values), color=color, label=label, linestyle=style, linewidth=1.1)
        phases.semilogx(w, phase, color=color, linestyle=style, linewidth=1.1)
        gains.plot([at.frequency], [1.0], color=color, marker="o", markersize=4)
        phases.plot(
            [at.frequency], [at.phase_margin - 180.0], color=color, marker="o", markersize=4
        )
    gains.axhline(1.0, color=BLACK, linestyle=":", linewidth=0.9)
    phases.axhline(-180.0, color=BLACK, linestyle=":", linewidth=0.9)
    gains.legend(fontsize=7.5, loc="upper right", frameon=False)
    finish(gains, "(c) gain of the open loop", "frequency [rad/s]", "gain")
    finish(phases, "(d) its phase", "frequency [rad/s]", "phase [deg]")
