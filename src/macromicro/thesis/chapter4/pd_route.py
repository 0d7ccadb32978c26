"""The thesis' own route (Sections 4.3.2 and 4.3.3, Figures 4.22 and 4.23).

A PD by phase margin on the linear model (4.4); then, on the tuned model with its dead zone
and limit, damping ratios at their lowest crossovers, and crossovers falling at one
derivative time, until a step neither overshoots nor saturates after its first sample.

The step is the thesis' own: 3000 counts, 2 s, on its model as printed, with 3 V friction.
Dead-zone inverse, limit and derivative time of the law come from the settings.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.control.macro import MacroLaw
from macromicro.control.pd import PdInitial, PdTuned
from macromicro.control.settings import Control
from macromicro.design.margins import (
    Crossover,
    PdTaps,
    damping_margin,
    first_crossover,
    lowest_frequency,
    open_loop,
    pd_by_margin,
    pd_by_time,
)
from macromicro.design.steps import overshoot, settling_time
from macromicro.errors import ProblemError
from macromicro.lab.drive import DT, law
from macromicro.models import macro
from macromicro.models.macro import Linear, MacroModel, position_transfer

STEP = 3000.0  # counts, Section 4.3.3
LIMIT = 5.0  # V
DEAD_ZONE = Control().dead_zone  # V, of the inverse
SECONDS = 2.0
RATIOS = (0.8, 0.9, 1.0, 1.05, 1.1, 1.2, 1.5, 2.0)  # of the sweep as in Figure 4.22
FREQUENCIES = (9.91, 8.0, 6.5, 4.91, 4.0, 3.0, 2.5, 2.0)  # rad/s, as in Figure 4.23
INITIAL_TAPS = PdTaps(*PdInitial())
TUNED_TAPS = PdTaps(*PdTuned())
SMALL = 0.5  # counts; an overshoot below it never shows in the encoder


class Trial(NamedTuple):
    taps: PdTaps
    crossover: Crossover  # with the position model (4.4)
    first: float  # effort asked for at the first sample [V]
    peak: float  # the largest after it [V]
    saturated: int  # samples after the first beyond the limit
    overshoot: float  # counts
    settled: float  # settling time [s] into 2 %; NaN where it never does
    # position, effort: of every sample, counts and V
    position: Array
    effort: Array


def crossover(taps: PdTaps, linear: Linear = Linear()) -> Crossover:  # noqa: B008
    """Gain crossover of D(z) with the position model (4.4)."""
    return first_crossover(*open_loop(taps, *position_transfer(linear)), linear.dt)


def with_taps(taps: PdTaps, limit: float = LIMIT, dead_zone: float = DEAD_ZONE) -> MacroLaw:
    return law("pd-tuned").with_gains(PdTuned(*taps))._replace(limit=limit, dead_zone=dead_zone)


def trial(
    taps: PdTaps,
    model: MacroModel = MacroModel(),  # noqa: B008
    dead_zone: float = DEAD_ZONE,
    limit: float = LIMIT,
) -> Trial:
    """Run a step of 3000 counts on the tuned model, which saturates by itself."""
    reference = np.full(round(SECONDS / DT), STEP)
    model = model._replace(limit=min(model.limit, limit))
    x, effort = macro.closed_loop(model, with_taps(taps, math.inf, dead_zone), reference)
    asked = np.abs(effort)
    return Trial(
        taps,
        crossover(taps, model.linear),
        float(asked[0]),
        float(asked[1:].max()),
        int(np.count_nonzero(asked[1:] > limit)),
        overshoot(x, STEP),
        settling_time(x, STEP),
        x,
        effort,
    )


def at_ratio(ratio: float) -> PdTaps:
    """The PD of a damping ratio at the lowest frequency that allows it (Section 4.3.3)."""
    num, den = position_transfer(Linear())
    margin = damping_margin(ratio)
    return pd_by_margin(num, den, DT, lowest_frequency(num, den, DT, margin), margin)


def sweep_ratios(dead_zone: float = DEAD_ZONE, limit: float = LIMIT) -> dict[float, Trial]:
    """Try damping ratios, each at its lowest phase-margin frequency (Figure 4.22)."""
    return {r: trial(at_ratio(r), dead_zone=dead_zone, limit=limit) for r in RATIOS}


def sweep_frequencies(
    derivative_time: float | None = None, dead_zone: float = DEAD_ZONE, limit: float = LIMIT
) -> dict[float, Trial]:
    """Try falling crossovers at one derivative time (Figure 4.23)."""
    return {w: _at(w, derivative_time, dead_zone, limit) for w in FREQUENCIES}


def _at(crossing: float, derivative_time: float | None, dead_zone: float, limit: float) -> Trial:
    held = TUNED_TAPS.derivative_time(DT) if derivative_time is None else derivative_time
    num, den = position_transfer(Linear())
    return trial(pd_by_time(num, den, DT, crossing, held), dead_zone=dead_zone, limit=limit)


def chosen(
    derivative_time: float | None = None, dead_zone: float = DEAD_ZONE, limit: float = LIMIT
) -> Trial:
    """Follow the stated rule.

    At a constant derivative time the crossover is lowered from 9.91 rad/s in steps of 0.05 until
    the tuned model overshoots by less than half a count and stays below the limit after the
    first sample.
    """
    for w in np.arange(FREQUENCIES[0], 0.5, -0.05):
        found = _at(float(w), derivative_time, dead_zone, limit)
        if found.saturated == 0 and found.overshoot < SMALL:
            return found
    held = TUNED_TAPS.derivative_time(DT) if derivative_time is None else derivative_time
    raise ProblemError(
        "the thesis' rule for the PD",
        "each crossover from 9.91 to 0.5 rad/s saturates or overshoots on the thesis' model",
        f"Choose other values than a dead-zone inverse of {dead_zone:g} V, a limit of {limit:g} V "
        f"and a derivative time of {held:g} s.",
    )


def ratio_below_limit() -> float:
    """The least damping ratio whose effort stays within 5 V on the step."""
    low, high = 1.0, 4.0
    while high - low > 1e-4:
        middle = 0.5 * (low + high)
        if trial(at_ratio(middle)).peak > LIMIT:
            low = middle
        else:
            high = middle
    return high
