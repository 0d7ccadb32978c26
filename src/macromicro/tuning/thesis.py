"""The thesis' own route (Sections 4.3.2 and 4.3.3, Figures 4.22 and 4.23).

A PD by phase margin on the linear model (4.4); then, on the tuned model with its dead zone
and limit, damping ratios at their lowest crossovers, and crossovers falling at one
derivative time, until a step neither overshoots nor saturates after its first sample.

The step is the thesis' own: 3000 counts, 2 s, on its model as printed, whose friction is 3 V
whatever the settings' bench has. The law's dead-zone inverse, limit and derivative time are
those of the settings.
"""

from __future__ import annotations

from collections.abc import Callable

from macromicro.control import settings as control_settings
from macromicro.control.settings import Control
from macromicro.design.margins import PdTaps
from macromicro.experiments import macro_design
from macromicro.experiments.macro_design import Trial
from macromicro.experiments.macro_friction import DT

Row = dict[str, float | str]

TRIALS = len(macro_design.RATIOS) + len(macro_design.FREQUENCIES) + 1


def tuned(
    tell: Callable[[int, float], None],
    control: Control = Control(),  # noqa: B008
) -> tuple[PdTaps, tuple[Row, ...]]:
    """The route's taps for the PD law that `control` chooses, and a row for each trial.

    The rule that ends it, in steps of 0.05 rad/s, is `macro_design.chosen`; raises
    `InputError` where that finds nothing.
    """
    law = control_settings.prepare(control).macro
    held, width, limit = derivative_time(control), law.dead_zone, law.limit
    ratios = macro_design.sweep_ratios(width, limit)
    crossovers = macro_design.sweep_frequencies(held, width, limit)
    last = macro_design.chosen(held, width, limit)
    rows = [_row("damping ratio", r, t) for r, t in ratios.items()]
    rows += [_row("crossover", w, t) for w, t in crossovers.items()]
    rows.append(_row("rule", last.crossover.frequency, last))
    tell(len(rows), last.settled)
    return last.taps, tuple(rows)


def derivative_time(control: Control) -> float:
    """The derivative time [s] of the chosen PD; that of (4.10) where it has no lead, as (4.9),
    because without one no crossover keeps the step from overshooting."""
    mine = PdTaps(*(control.pd_initial if control.macro_law == "pd-initial" else control.pd_tuned))
    if mine.proportional > 0.0 and mine.before < 0.0:
        return mine.derivative_time(DT)
    return macro_design.TUNED_TAPS.derivative_time(DT)


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
