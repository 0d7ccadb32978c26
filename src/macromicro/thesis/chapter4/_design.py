"""Design of the macro-stage's PD controllers (Sections 4.3.2 and 4.3.3): M11, M11b, M12.

Margins come from the polynomials of (4.4), (4.9) and (4.10), computed with numpy alone. The
tuning uses the tuned model as printed and a step of 3000 counts.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

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
from macromicro.drawing.exhibit import Drawn
from macromicro.drawing.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, RED, finish, line, new
from macromicro.lab.drive import DT, closed_loop, law
from macromicro.lab.machine import Machine
from macromicro.models import macro
from macromicro.models.macro import Linear, MacroModel, position_transfer
from macromicro.thesis.claims import Claim, accepts, state
from macromicro.thesis.contents import caption

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


def crossover(taps: PdTaps) -> Crossover:
    """Gain crossover of D(z) with the position model (4.4)."""
    linear = Linear()
    return first_crossover(*open_loop(taps, *position_transfer(linear)), linear.dt)


def with_taps(taps: PdTaps, limit: float = LIMIT) -> MacroLaw:
    return law("pd-tuned").with_gains(PdTuned(*taps))._replace(limit=limit, dead_zone=DEAD_ZONE)


def trial(taps: PdTaps) -> Trial:
    """Run a step of 3000 counts on the tuned model, which saturates by itself."""
    reference, model = np.full(round(SECONDS / DT), STEP), MacroModel()
    model = model._replace(limit=min(model.limit, LIMIT))
    x, effort = macro.closed_loop(model, with_taps(taps, math.inf), reference)
    asked = np.abs(effort)
    return Trial(
        taps,
        crossover(taps),
        float(asked[0]),
        float(asked[1:].max()),
        int(np.count_nonzero(asked[1:] > LIMIT)),
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


def sweep_ratios() -> dict[float, Trial]:
    """Try damping ratios, each at its lowest phase-margin frequency (Figure 4.22)."""
    return {ratio: trial(at_ratio(ratio)) for ratio in RATIOS}


def sweep_frequencies(derivative_time: float | None = None) -> dict[float, Trial]:
    """Try falling crossovers at one derivative time, that of (4.10) by default (Figure 4.23)."""
    return {w: _at(w, derivative_time) for w in FREQUENCIES}


def _at(crossing: float, derivative_time: float | None = None) -> Trial:
    held = TUNED_TAPS.derivative_time(DT) if derivative_time is None else derivative_time
    num, den = position_transfer(Linear())
    return trial(pd_by_time(num, den, DT, crossing, held))


def choose() -> Trial:
    """Follow the stated rule.

    At a constant derivative time the crossover is lowered from 9.91 rad/s in steps of 0.05 until
    the tuned model overshoots by less than half a count and stays below the limit after the
    first sample.
    """
    lowered = (_at(float(w)) for w in np.arange(FREQUENCIES[0], 0.5, -0.05))
    return next(t for t in lowered if t.saturated == 0 and t.overshoot < SMALL)


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


SHOWN_RATIOS = (0.8, 1.0, 1.05, 1.2, 1.5)  # of the sweep, beside the one at the limit
SHOWN_FREQUENCIES = (9.91, 6.5, 4.91, 4.0, 3.0)  # rad/s, beside the rule's
_COLOURS = (PURPLE, ORANGE, BLUE, GREEN, RED, BLACK)
SHOWN = 1.2  # s
ZOOMED = (0.4, SHOWN)
MARGINS = (1.0, 200.0)  # rad/s


def sample_times(rows: int) -> Array:
    return np.asarray(np.arange(rows) * DT, dtype=np.float64)


def _curves(ax: Any, trials: Mapping[str, Array], rows: slice) -> None:
    for (label, values), color in zip(trials.items(), _COLOURS, strict=True):
        line(ax, sample_times(len(values))[rows], values[rows], color, label)


def ratios(design: Design) -> Drawn:
    shown: dict[str, Trial] = {f"{ratio:g}": design.ratios[ratio] for ratio in SHOWN_RATIOS}
    shown[f"{design.ratio:.2f}"] = design.at_limit
    figure, axes = new(3.8, 1, 2)
    rows = slice(0, round(SHOWN / DT))
    _curves(axes[0, 0], {k: v.effort for k, v in shown.items()}, rows)
    _curves(axes[0, 1], {k: v.position for k, v in shown.items()}, rows)
    axes[0, 0].axhline(LIMIT, color=BLACK, linestyle="--", linewidth=0.9)
    axes[0, 0].set_ylim(-6.0, 16.0)
    axes[0, 1].set_ylim(STEP - 60.0, STEP + 30.0)
    key: Any = {
        "legend": "upper right",
        "ncols": 2,
        "title": "damping ratio",
        "title_fontsize": 7.5,
    }
    finish(axes[0, 0], "(a) controller output; dashed: 5 V", y="requested output [V]", **key)
    finish(axes[0, 1], "(b) zoom of the response", y="position [counts]")
    axes[0, 1].set_xlim(*ZOOMED)
    asked = design.ratios[1.05]
    return caption("4.22", figure, step=STEP, asked=asked, design=design)


def frequencies(design: Design) -> Drawn:
    """Figure 4.23, with the margins of (4.9) and (4.10) in two panels."""
    rule = design.rule.crossover.frequency
    shown: dict[str, Trial] = {f"{w:g}": design.frequencies[w] for w in SHOWN_FREQUENCIES}
    shown[f"{rule:.2f}"] = design.rule
    figure, axes = new(6.2, 2, 2)
    rows = slice(0, round(SHOWN / DT))
    bare = design.bare[4.91].position
    t = sample_times(len(bare))
    for ax in axes[0]:
        _curves(ax, {k: v.position for k, v in shown.items()}, rows)
        line(ax, t[rows], bare[rows], BLUE, "4.91, no derivative", linestyle="--", linewidth=0.9)
    axes[0, 1].set_ylim(STEP - 60.0, STEP + 25.0)
    key: Any = {"legend": "lower right", "title": "crossover [rad/s]", "title_fontsize": 7.5}
    finish(axes[0, 0], "(a) full", y="position [counts]", **key)
    finish(axes[0, 1], "(b) zoom", y="position [counts]")
    axes[0, 1].set_xlim(*ZOOMED)
    _margins(axes[1, 0], axes[1, 1])
    tuned, initial = (crossover(taps) for taps in (TUNED_TAPS, INITIAL_TAPS))
    return caption("4.23", figure, step=STEP, rule=rule, initial=initial, tuned=tuned)


def _margins(gains: Any, phases: Any) -> None:
    plus = PdTaps(TUNED_TAPS.now, -TUNED_TAPS.before)
    loops = (
        (INITIAL_TAPS, ORANGE, "(4.9)", "-"),
        (TUNED_TAPS, BLUE, "(4.10), minus", "-"),
        (plus, RED, "(4.10) as printed", "--"),
    )
    w = np.geomspace(*MARGINS, 300)
    z = np.exp(1j * w * DT)
    for taps, color, label, style in loops:
        num, den = open_loop(taps, *position_transfer(Linear()))
        values = np.polyval(num, z) / np.polyval(den, z)
        at = crossover(taps)
        phase = np.degrees(np.unwrap(np.angle(values)))
        # The first frequency lies where the loop is an integrator, about -90 deg.
        phase -= 360.0 * round((float(phase[0]) + 90.0) / 360.0)
        gains.loglog(w, np.abs(values), color=color, label=label, linestyle=style, linewidth=1.1)
        phases.semilogx(w, phase, color=color, linestyle=style, linewidth=1.1)
        gains.plot([at.frequency], [1.0], "o", color=color, markersize=4)
        phases.plot([at.frequency], [at.phase_margin - 180.0], "o", color=color, markersize=4)
    gains.axhline(1.0, color=BLACK, linestyle=":", linewidth=0.9)
    phases.axhline(-180.0, color=BLACK, linestyle=":", linewidth=0.9)
    finish(gains, "(c) gain of the open loop", "frequency [rad/s]", "gain", legend="upper right")
    finish(phases, "(d) its phase", "frequency [rad/s]", "phase [deg]")


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
    printed, rule, ratio = trial(TUNED_TAPS), choose(), ratio_below_limit()
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
        state("M11", tuned.frequency, tuned=tuned, plus=plus),
        state("M11b", [initial.phase_margin, initial.frequency], asked=damping_margin(1.0)),
    ]


def tuning(design: Design) -> Claim:
    here = design.rule_on_bench
    measured = [here.overshoot, float(here.saturated), here.settled]
    return state(
        "M12",
        measured,
        accepts("M12", *measured),
        rule=design.rule,
        arrived=f"after {here.settled:.2f} s" if math.isfinite(here.settled) else "never",
        asked=design.ratios[1.05],
        ratio=design.ratio,
        printed=design.printed,
        beyond=design.printed.first - 3.0,
        bench=design.printed_on_bench,
        least=min(t.overshoot for t in design.bare.values()),
    )
