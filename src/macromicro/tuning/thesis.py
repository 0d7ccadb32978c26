"""The thesis' own route (Sections 4.3.2 and 4.3.3, Figures 4.22 and 4.23).

A PD by phase margin on the linear model (4.4); then, on the tuned model with its dead zone
and limit, damping ratios at their lowest crossovers, and crossovers falling at one
derivative time, until a step neither overshoots nor saturates after its first sample.
"""

from __future__ import annotations

from collections.abc import Callable

from macromicro.design.margins import PdTaps
from macromicro.experiments import macro_design
from macromicro.experiments.macro_design import Trial

Row = dict[str, float | str]


def tuned(tell: Callable[[int, float], None]) -> tuple[PdTaps, tuple[Row, ...]]:
    """The route's taps, and a row for each trial on its way.

    The rule that ends it, in steps of 0.05 rad/s, is `macro_design.chosen`.
    """
    rows = [_row("damping ratio", r, t) for r, t in macro_design.sweep_ratios().items()]
    rows += [_row("crossover", w, t) for w, t in macro_design.sweep_frequencies().items()]
    last = macro_design.chosen()
    rows.append(_row("rule", last.crossover.frequency, last))
    tell(len(rows), last.settled)
    return last.taps, tuple(rows)


def _row(swept: str, value: float, trial: Trial) -> Row:
    return {
        "swept": swept,
        "value": value,
        "now": trial.taps.now,
        "before": trial.taps.before,
        "crossover": trial.crossover.frequency,
        "phase_margin": trial.crossover.phase_margin,
        "overshoot": trial.overshoot,
        "peak_effort": trial.peak,
        "saturated": float(trial.saturated),
        "settling_time": trial.settled,
    }
