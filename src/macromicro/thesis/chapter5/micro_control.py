"""The micro-stage alone (Sections 5.2.2 and 5.3): Figures 5.19 to 5.27, S3, S4, S11 to S13c."""

from __future__ import annotations

import numpy as np

from macromicro.runs import sequence
from macromicro.thesis.chapter5 import _micro_figures, micro_runs
from macromicro.thesis.chapter5.micro_runs import MicroRuns, Swing
from macromicro.thesis.claims import Claim, accepts, band, judged, reached, stated, whole
from macromicro.thesis.contents import procedure
from macromicro.thesis.procedure import Lab

LASER_NOISE_UM = 2.0


def claims(runs: MicroRuns | None = None) -> list[Claim]:
    seen = runs or micro_runs.collect()
    return judged(
        [
            ("S3", lambda: _stop(seen)),
            ("S4", lambda: _foot(seen)),
            ("S11", lambda: _proportional(seen)),
            ("S12", lambda: _windup(seen)),
            (("S13a", "S13b"), lambda: _settling(seen)),
            ("S13c", lambda: _accuracy(seen)),
        ]
    )


def _stop(runs: MicroRuns) -> Claim:
    place = {v: micro_runs.highest(r) for v, r in runs.steps.items()}
    above = [place[v] for v in micro_runs.ABOVE_STOP]
    below = max(place[v] for v in micro_runs.BELOW_STOP)
    good = accepts("S3", *above) and below < band("S3")[0]
    edge = ", ".join(f"{v:g} V {place[v]:.3f} mm" for v in micro_runs.AT_STOP)
    return stated(
        "S3",
        float(np.mean(above)),
        good,
        volts=(micro_runs.ABOVE_STOP[0], micro_runs.ABOVE_STOP[-1]),
        lowest=min(above),
        highest=max(above),
        below=below,
        edge=edge,
    )


def _foot(runs: MicroRuns) -> Claim:
    first = micro_runs.first_response(runs.feet)
    still = max(1e3 * micro_runs.highest(r) for v, r in runs.feet.items() if v <= 1.3)
    good = accepts("S4", first) and still < 20.0
    return stated("S4", first, good, still=still, first=first)


def grows(values: list[float], noise: float) -> bool:
    """Whether each value reaches the one before within `noise`, and the last exceeds the first."""
    steps = np.diff(values)
    return bool(np.all(steps >= -noise) and values[-1] - values[0] > noise)


def _proportional(runs: MicroRuns) -> Claim:
    whole("a step under proportional control", *runs.proportional.values())
    swings: dict[float, Swing] = {k: micro_runs.swing(r) for k, r in runs.proportional.items()}
    errors = [s.error for s in swings.values()]
    over = [s.overshoot for s in swings.values()]
    ripple = [s.ripple for s in swings.values()]
    good = min(errors) > 20.0 and grows(over, LASER_NOISE_UM) and grows(ripple, 0.0)
    low, high = min(swings), max(swings)
    return stated(
        "S11",
        micro_runs.chosen_gain(swings),
        good,
        low=low,
        high=high,
        most=max(errors),
        least=min(errors),
        first=swings[low],
        last=swings[high],
        three=swings[3.0],
    )


def _windup(runs: MicroRuns) -> Claim:
    whole("the sequence 0 - 2 - 3 - 2 - 0 mm under PI control", runs.pi)
    whole("the sequence with anti-windup", runs.antiwindup)
    fall = sequence.TIMES[2]
    plain, held = (abs(micro_runs.error_after(r, fall)) for r in (runs.pi, runs.antiwindup))
    low = micro_runs.undershoot(runs.pi, fall)
    home = [abs(micro_runs.error_after(r, sequence.TIMES[3])) for r in (runs.pi, runs.antiwindup)]
    return stated(
        "S12",
        micro_runs.chosen_integral_gain(runs.integral),
        low > 0.02 and plain > 50.0 and plain > held,
        low=low,
        plain=plain,
        held=held,
        home=home,
        top=micro_runs.highest(runs.integral[2.25]),
    )


def _settling(runs: MicroRuns) -> list[Claim]:
    whole("the sequence with anti-windup", runs.antiwindup)
    time = {b: sequence.settling(runs.antiwindup, b) for b in (sequence.BAND_UM, 5.0, None)}
    names = {sequence.BAND_UM: "10 um", 5.0: "5 um", None: "2 % of the step"}

    def said(rows: slice) -> str:
        parts = [
            f"{' and '.join(f'{t:.2f}' if t > 0.0 else 'not' for t in time[b][rows])} s to {name}"
            for b, name in names.items()
        ]
        return "; ".join(parts)

    up, down = slice(0, 2), slice(2, 4)
    contract, extend = (float(np.mean(time[sequence.BAND_UM][rows])) for rows in (up, down))
    return [
        stated("S13a", contract, reached("S13a", contract), times=said(up)),
        stated("S13b", extend, reached("S13b", extend), times=said(down)),
    ]


def _accuracy(runs: MicroRuns) -> Claim:
    whole("the sequence of holds", *runs.held)
    worst = micro_runs.worst_hold(runs)
    count = len(runs.held) * len(micro_runs.HOLDS)
    return stated("S13c", worst, count=count)


def collect(lab: Lab) -> MicroRuns:
    return micro_runs.collect(lab.settings, lab.seed, lab.runner(), lab.bench())


PROCEDURE = procedure(
    "micro-control",
    {
        "5.10 (stop)": _micro_figures.stop,
        "5.19": _micro_figures.effort,
        "5.20": _micro_figures.proportional,
        "5.22": _micro_figures.integral,
        "5.23": _micro_figures.windup,
        "5.25": _micro_figures.anti_windup,
        "5.26": _micro_figures.held_back,
        "5.27": _micro_figures.final,
    },
    collect,
    claims,
)
