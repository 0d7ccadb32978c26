"""Design of the macro-stage's PD controllers (Sections 4.3.2 and 4.3.3): M11, M11b, M12.

Margins come from the polynomials of (4.4), (4.9) and (4.10), computed with numpy alone. The
tuning uses the tuned model as printed and a step of 3000 counts.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from macromicro.design.margins import PdTaps, damping_margin
from macromicro.design.steps import overshoot, settling_time
from macromicro.lab.drive import DT, closed_loop
from macromicro.lab.machine import Machine
from macromicro.thesis.chapter4.pd_route import (
    INITIAL_TAPS,
    LIMIT,
    SECONDS,
    STEP,
    TUNED_TAPS,
    Trial,
    at_ratio,
    chosen,
    crossover,
    ratio_below_limit,
    sweep_frequencies,
    sweep_ratios,
    trial,
    with_taps,
)
from macromicro.thesis.claims import Claim, accepts, holds, stated, within


class OnBench(NamedTuple):
    overshoot: float  # [counts]
    saturated: int  # samples at the limit after the first
    settled: float  # into 2 % [s], NaN if never


class Design(NamedTuple):
    ratios: dict[float, Trial]  # by damping ratio
    frequencies: dict[float, Trial]  # by crossover [rad/s]
    bare: dict[float, Trial]  # by crossover, without derivative action
    printed: Trial  # of (4.10)
    rule: Trial  # of the stated rule
    ratio: float  # least damping ratio within the limit
    at_limit: Trial
    rule_on_bench: OnBench
    printed_on_bench: OnBench


def collect(plant: Machine) -> Design:
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


def on_bench(plant: Machine, taps: PdTaps) -> OnBench:
    """The step on the bench.

    It starts 100 counts below zero, so that the end stop at 3000 counts hides no overshoot.
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
    return [
        stated("M11", tuned.frequency, within("M11", tuned.frequency), tuned=tuned, plus=plus),
        stated(
            "M11b",
            [initial.phase_margin, initial.frequency],
            within("M11b", initial.phase_margin, initial.frequency),
            asked=damping_margin(1.0),
        ),
    ]


def tuning(design: Design) -> Claim:
    here = design.rule_on_bench
    good = accepts("M12", here.overshoot, float(here.saturated), here.settled)
    return stated(
        "M12",
        [here.overshoot, float(here.saturated), here.settled],
        holds(good),
        rule=design.rule,
        arrived=f"after {here.settled:.2f} s" if math.isfinite(here.settled) else "never",
        asked=design.ratios[1.05],
        ratio=design.ratio,
        printed=design.printed,
        beyond=design.printed.first - 3.0,
        bench=design.printed_on_bench,
        least=min(t.overshoot for t in design.bare.values()),
    )
