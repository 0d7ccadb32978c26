"""Design of the macro-stage's PD controllers (Sections 4.3.2 and 4.3.3): M11, M11b, M12.

Margins come from the polynomials of (4.4), (4.9) and (4.10) by numpy alone. Tuning in
simulation is done on the tuned model as printed, for a step of 3000 counts.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

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
from macromicro.errors import InputError
from macromicro.experiments.claim import Claim, holds, within
from macromicro.experiments.machine import Machine
from macromicro.experiments.macro_drive import closed_loop, law, overshoot, settling_time
from macromicro.experiments.macro_friction import DT
from macromicro.experiments.statements import stated
from macromicro.models import macro
from macromicro.models.macro import Linear, MacroModel, position_transfer

Array = npt.NDArray[np.float64]

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
    """One controller on the tuned model: effort as asked for, before the limit.

    crossover on the linear model; first, peak: |effort| [V] of the first sample and the
    largest after it; saturated: samples after the first beyond the limit; overshoot
    [counts]; settled [s]: to within 2 %; position [counts] and effort [V], (n,).
    """

    taps: PdTaps
    crossover: Crossover
    first: float
    peak: float
    saturated: int
    overshoot: float
    settled: float
    position: Array
    effort: Array


class OnBench(NamedTuple):
    """A step on the bench: overshoot [counts], samples after the first at the limit, and the
    time [s] until it stays within 2 %, NaN where it never does."""

    overshoot: float
    saturated: int
    settled: float


class Design(NamedTuple):
    """What the design and its tuning give.

    `ratios`, `frequencies`, `bare`: trials by damping ratio, by crossover [rad/s], and by
    crossover without derivative action; `printed`: of (4.10); `rule`: of the stated rule;
    `ratio`: the least damping ratio within the limit, `at_limit` its trial; `rule_on_bench`,
    `printed_on_bench`: these two there.
    """

    ratios: dict[float, Trial]
    frequencies: dict[float, Trial]
    bare: dict[float, Trial]
    printed: Trial
    rule: Trial
    ratio: float
    at_limit: Trial
    rule_on_bench: OnBench
    printed_on_bench: OnBench


def collect(plant: Machine) -> Design:
    """The sweeps, the rule's controller and (4.10), these two on the bench as well."""
    printed, rule, ratio = trial(TUNED_TAPS), chosen(), ratio_below_limit()
    return Design(
        sweep_ratios(),
        sweep_frequencies(),
        sweep_frequencies(0.0),
        printed,
        rule,
        ratio,
        trial(at_ratio(ratio)),
        on_bench(plant, rule.taps),
        on_bench(plant, printed.taps),
    )


def crossover(taps: PdTaps, linear: Linear = Linear()) -> Crossover:  # noqa: B008
    """Gain crossover of D(z) with the position model (4.4)."""
    return first_crossover(*open_loop(taps, *position_transfer(linear)), linear.dt)


def with_taps(taps: PdTaps, limit: float = LIMIT, dead_zone: float = DEAD_ZONE) -> MacroLaw:
    """The tuned controller with other taps; `limit`, `dead_zone` [V] of its inverse."""
    return law("pd-tuned").with_gains(PdTuned(*taps))._replace(limit=limit, dead_zone=dead_zone)


def trial(
    taps: PdTaps,
    model: MacroModel = MacroModel(),  # noqa: B008
    dead_zone: float = DEAD_ZONE,
    limit: float = LIMIT,
) -> Trial:
    """A step of 3000 counts on the tuned model, which saturates by itself at `limit` [V] or
    its own; `dead_zone` [V]: of the law's inverse, whatever the model's friction."""
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
    """Figure 4.22: damping ratios, each at its lowest phase-margin frequency."""
    return {r: trial(at_ratio(r), dead_zone=dead_zone, limit=limit) for r in RATIOS}


def sweep_frequencies(
    derivative_time: float | None = None, dead_zone: float = DEAD_ZONE, limit: float = LIMIT
) -> dict[float, Trial]:
    """Figure 4.23: falling crossovers [rad/s] at one derivative time [s], that of (4.10)."""
    return {w: _at(w, derivative_time, dead_zone, limit) for w in FREQUENCIES}


def _at(crossing: float, derivative_time: float | None, dead_zone: float, limit: float) -> Trial:
    held = TUNED_TAPS.derivative_time(DT) if derivative_time is None else derivative_time
    num, den = position_transfer(Linear())
    return trial(pd_by_time(num, den, DT, crossing, held), dead_zone=dead_zone, limit=limit)


def chosen(
    derivative_time: float | None = None, dead_zone: float = DEAD_ZONE, limit: float = LIMIT
) -> Trial:
    """The stated rule: keep the derivative time [s], by default that of (4.10), and lower the
    crossover from 9.91 rad/s in steps of 0.05 until the tuned model neither overshoots by
    half a count nor asks for more than `limit` [V] after the first sample. Raises
    `InputError` where no crossover down to 0.5 rad/s does, as with a dead-zone inverse near
    the limit or too short a derivative time."""
    for w in np.arange(FREQUENCIES[0], 0.5, -0.05):
        found = _at(float(w), derivative_time, dead_zone, limit)
        if found.saturated == 0 and found.overshoot < SMALL:
            return found
    held = TUNED_TAPS.derivative_time(DT) if derivative_time is None else derivative_time
    raise InputError(
        "the thesis' rule for the PD",
        f"dead-zone inverse {dead_zone:g} V, limit {limit:g} V, derivative time {held:g} s",
        "settings with which some crossover from 9.91 to 0.5 rad/s neither saturates nor "
        "overshoots on the thesis' model",
    )


def ratio_below_limit() -> float:
    """The least damping ratio whose effort stays within 5 V on the step, by bisection."""
    low, high = 1.0, 4.0
    while high - low > 1e-4:
        middle = 0.5 * (low + high)
        if trial(at_ratio(middle)).peak > LIMIT:
            low = middle
        else:
            high = middle
    return high


def on_bench(plant: Machine, taps: PdTaps) -> OnBench:
    """The step on the bench.

    From 100 counts below zero, so that the end stop at 3000 counts cannot hide anything.
    """
    target = STEP - 100.0
    aim = np.full(round(SECONDS / DT), target)
    run = closed_loop(plant, with_taps(taps), aim, -100.0)
    full = np.abs(run["motor"][1:]) >= LIMIT
    x = run["macro_position"]
    return OnBench(overshoot(x, target), int(np.count_nonzero(full)), settling_time(x, target))


def margins() -> list[Claim]:
    """M11 and M11b: arithmetic on printed figures."""
    tuned, initial = crossover(TUNED_TAPS), crossover(INITIAL_TAPS)
    plus = crossover(PdTaps(TUNED_TAPS.now, -TUNED_TAPS.before))
    good = abs(initial.phase_margin / 76.3 - 1.0) <= 0.005
    good = good and abs(initial.frequency / 9.91 - 1.0) <= 0.005
    how = "computed from the polynomials with numpy"
    return [
        stated(
            "M11",
            tuned.frequency,
            within(tuned.frequency, 4.91 * 0.995, 4.91 * 1.005),
            f"{how}; holds with a minus sign in the numerator of (4.10), where the phase margin "
            f"is {tuned.phase_margin:.1f} deg; the printed plus gives {plus.frequency:.1f} rad/s",
        ),
        stated(
            "M11b",
            [initial.phase_margin, initial.frequency],
            holds(good),
            f"{how}; the plus sign of (4.9) stands. A damping ratio of 1 asks for "
            f"{damping_margin(1.0):.2f} deg by the rule of second-order loops",
        ),
    ]


def tuning(design: Design) -> Claim:
    """M12: what the rule finds in simulation, put to the bench."""
    printed, rule, asked = design.printed, design.rule, design.ratios[1.05]
    here, there = design.rule_on_bench, design.printed_on_bench
    least = min(t.overshoot for t in design.bare.values())
    good = here.overshoot < 1.0 and here.saturated == 0 and here.settled <= SECONDS
    arrived = f"after {here.settled:.2f} s" if math.isfinite(here.settled) else "never"
    return stated(
        "M12",
        [here.overshoot, float(here.saturated), here.settled],
        holds(good),
        "Judged is the bench under the rule's controller: derivative time of (4.10), crossover "
        f"lowered to {rule.crossover.frequency:.2f} rad/s (taps {rule.taps.now:.7f}, "
        f"{rule.taps.before:.7f}), found in simulation as the first with {rule.overshoot:.2f} "
        f"counts of overshoot and at most {rule.peak:.2f} V. There it is within 2 % {arrived}. The "
        f"printed ratio of 1.05 does not do it: that ({asked.crossover.phase_margin:.1f} deg) asks "
        f"for {asked.peak:.2f} V, {design.ratio:.2f} for 5 V. (4.10) has "
        f"{printed.crossover.phase_margin:.1f} deg, asks for {printed.first - 3.0:.0f} + 3 V, "
        f"then {printed.peak:.2f} V: it saturates for {printed.saturated} samples "
        f"({there.saturated} on the bench) and goes {printed.overshoot:.2f} counts over "
        f"({there.overshoot:.0f}). Without derivative action no crossover from 9.91 to 2 rad/s "
        f"leaves less than {least:.0f} counts of overshoot: "
        "the derivative time removes it, not the lower frequency.",
    )
