"""The micro-stage alone (Sections 5.2.2 and 5.3): Figures 5.19 to 5.27, S3, S4, S11 to S13c."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from macromicro.arrays import Array, spans
from macromicro.drawing.exhibit import Drawn
from macromicro.drawing.style import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    RED,
    dots,
    finish,
    line,
    new,
    note,
)
from macromicro.recording import Recording
from macromicro.runs import sequence
from macromicro.thesis.chapter5 import micro_runs
from macromicro.thesis.chapter5.micro_runs import MicroRuns, Swing
from macromicro.thesis.claims import Claim, accepts, band, judge, judge_time, state, whole
from macromicro.thesis.contents import caption
from macromicro.thesis.procedure import Lab

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


HALF_ZOOM_UM, GOAL_UM = 25.0, 5.0
Laws = Sequence[tuple[Recording, str, str]]


def _three(laws: Laws) -> tuple[Figure, tuple[Axes, Axes, Axes]]:
    figure, axes = new(6.2, 3, 1, sharex=True)
    work, integral, place = axes[:, 0]
    first = laws[0][0]
    reference = first["micro_reference"][:-1]
    for recording, colour, name in laws:
        t = recording["t"][:-1]
        line(work, t, column("ctrl")(recording), colour, name)
        line(integral, t, column("micro_integral")(recording), colour, name)
        line(place, t, millimetres(recording), colour, name)
    line(place, first["t"][:-1], reference, BLACK, "reference", linestyle="--", linewidth=0.9)
    finish(work, "(a) controller output", "", "CTRL [V]", legend=len(laws) > 1)
    finish(integral, "(b) integral effort", "", "effort [V]")
    finish(place, "(c) position by the laser", y="position [mm]", legend=True)
    return figure, (work, integral, place)


def windup(runs: MicroRuns) -> Drawn:
    figure, (work, integral, _) = _three([(runs.pi, BLUE, "PI, Ki 2.25")])
    fall = sequence.TIMES[2]
    saturated = _saturated_spans(runs.pi, fall)
    for ax in (work, integral):
        for begin, end in saturated:
            ax.axvspan(begin, end, color=ORANGE, alpha=0.25, linewidth=0)
    low = micro_runs.undershoot(runs.pi, fall)
    at = fall + 0.25
    there = (at, float(runs.pi["micro_integral"][round(at / runs.pi.dt)]))
    arrow = {"arrowstyle": "-", "linewidth": 0.6}
    note(integral, f"falls {low:.2f} V too far", there, (30, 14), arrowprops=arrow)
    left = abs(micro_runs.error_after(runs.pi, fall))
    return caption("5.23", figure, left=left)


def _saturated_spans(recording: Recording, since: float) -> list[tuple[float, float]]:
    """Spans of at least 20 ms with CTRL at 0 V, from `since` [s] on."""
    dt = recording.dt
    found = [(a * dt, b * dt) for a, b in spans(recording["ctrl"][:-1] <= 0.0)]
    return [(begin, end) for begin, end in found if end - begin >= 0.02 and begin >= since]


def anti_windup(runs: MicroRuns) -> Drawn:
    colours = (BLUE, GREEN)
    laws = [(runs.pi, "0.6", "PI alone, Ki 2.25")]
    laws += [
        (r, c, f"Ki = Kaw {k:g}")
        for (k, r), c in zip(sorted(runs.gentle.items()), colours, strict=True)
    ]
    figure, _ = _three(laws)
    return caption("5.25", figure)


def final(runs: MicroRuns) -> Drawn:
    figure, axes = new(6.2, 2, 2)
    recording = runs.antiwindup
    t = recording["t"][:-1]
    reference, place = recording["micro_reference"][:-1], millimetres(recording)
    full = axes[0, 0]
    line(full, t, reference, ORANGE, "reference", linestyle="--")
    line(full, t, place, BLUE, "laser")
    finish(full, "(a) full", y="position [mm]", legend=True)
    near = axes[0, 1]
    near.axhspan(-GOAL_UM, GOAL_UM, color=GREEN, alpha=0.2, linewidth=0, label="±5 um")
    line(near, t, 1e3 * (place - reference), BLUE, "laser - reference", linewidth=0.8)
    near.set_ylim(-HALF_ZOOM_UM, HALF_ZOOM_UM)
    finish(near, "(b) zoom", y="[um]", legend=True)
    _settling(axes[1, 0], runs)
    _holds(axes[1, 1], runs)
    return caption("5.27", figure, holds=len(runs.held) * len(micro_runs.HOLDS))


def _settling(ax: Axes, runs: MicroRuns) -> None:
    starts = (0.0, *sequence.LEVELS[:-1])
    names = [f"{1e3 * a:g} to {1e3 * b:g}" for a, b in zip(starts, sequence.LEVELS, strict=True)]
    place = np.arange(len(names))
    for width, colour, marker, label in (
        (None, GREEN, "s", "2 % of the step"),
        (sequence.BAND_UM, BLUE, "o", "10 um"),
        (GOAL_UM, RED, "^", "5 um"),
    ):
        times = sequence.settling(runs.antiwindup, width)
        dots(ax, place, times, colour, marker, label)
    for value, left in ((0.5, -0.4), (1.0, 1.6)):
        ax.plot([left, left + 1.8], [value, value], color="0.4", linestyle="--", linewidth=1.0)
    ax.set_xticks(place, names)
    ax.set_ylim(bottom=0.0)
    finish(ax, "(c) settling", "step [mm]", "time [s]", legend=True)


def _holds(ax: Axes, runs: MicroRuns) -> None:
    levels, errors = micro_runs.hold_errors(runs)
    ax.axhspan(-GOAL_UM, GOAL_UM, color=GREEN, alpha=0.2, linewidth=0)
    dots(ax, levels, errors, BLUE, "o", markersize=3.5)
    ax.set_ylim(-1.5 * GOAL_UM, 1.5 * GOAL_UM)
    finish(ax, "(d) error at rest", "level [mm]", "[um]")
    ax.margins(x=0.04)


Curves = Mapping[float, str]

# Colours by gain: the chosen one is black and bold, smaller ones are cold and larger ones warm.
GAINS: Curves = {1.0: BLUE, 2.0: GREEN, 3.0: BLACK, 5.0: ORANGE, 10.0: RED}
INTEGRAL_GAINS: Curves = dict(
    zip((0.5, 0.75, 1.0, 1.25, 1.5, 2.25), (BLUE, PURPLE, GREEN, ORANGE, RED, BLACK), strict=True)
)
HELD_BACK_GAINS: Curves = dict(
    zip(
        (5.0, 10.0, 20.0, 30.0, 60.0, 100.0), (BLUE, PURPLE, GREEN, BLACK, ORANGE, RED), strict=True
    )
)


def millimetres(recording: Recording) -> Array:
    """The laser [mm] without the run's last row."""
    return np.asarray(recording["laser"][:-1] * 1e-3)


def column(name: str) -> Callable[[Recording], Array]:
    """A column without the run's last row, where outputs are 0."""
    return lambda recording: np.asarray(recording[name][:-1])


def curves(
    ax: Axes,
    found: dict[float, Recording],
    gains: Curves,
    values: Callable[[Recording], Array],
    name: str,
    limits: tuple[float, float] | None = None,
) -> None:
    """`values` of each gain's recording over time, between `limits` [s]."""
    for gain, colour in gains.items():
        recording = found[gain]
        t, y = recording["t"][:-1], values(recording)
        if limits is not None:
            seen = (t >= limits[0]) & (t <= limits[1])
            t, y = t[seen], y[seen]
        bold = {"linewidth": 1.8, "zorder": 3} if colour == BLACK else {"linewidth": 1.0}
        line(ax, t, y, colour, f"{name} {gain:g}", **bold)


def target(ax: Axes) -> None:
    ax.axhline(micro_runs.TARGET_MM, color="0.4", linestyle="--", linewidth=1.0, label="target")


def key(where: str = "best", **options: Any) -> dict[str, Any]:
    """The legend of a panel whose curves may pass below it."""
    return {"legend": where, "frameon": True, "framealpha": 0.85, **options}


def by_gain(ax: Axes, found: Mapping[float, float], title: str, label: str) -> None:
    """A number over the gains, from 0 on."""
    ax.plot(list(found), list(found.values()), color=RED, marker="o", ms=4, lw=1.0)
    ax.set_ylim(bottom=0.0)
    finish(ax, title, label)
    ax.margins(x=0.06)


def stop(runs: MicroRuns) -> Drawn:
    """Where the stage begins and stops: highest position over CTRL."""
    figure, axes = new(3.5, 1, 2)
    whole, foot = axes[0]
    steps, feet = (
        np.array([(v, micro_runs.highest(r)) for v, r in sorted(found.items())])
        for found in (runs.steps, runs.feet)
    )
    whole.axhspan(3.96, 4.0, color=GREEN, alpha=0.25, linewidth=0, label="3.98 ± 0.02 mm")
    whole.plot(*feet.T, color=BLUE, marker=".", linestyle="", label="in 60 s")
    for long, marker, label in ((True, "o", "in 200 s"), (False, "^", "in 20 s")):
        part = steps[np.isin(steps[:, 0], micro_runs.BELOW_STOP) == long]
        whole.plot(*part.T, color=RED, marker=marker, markersize=5, linestyle="", label=label)
    whole.axvline(1.65, color="0.4", linestyle=":", linewidth=1.0)
    whole.text(1.66, 0.1, "1.65 V", fontsize=8, color="0.3")
    place = ("CTRL [V]", "highest position [mm]")
    finish(whole, "(a) up to the stop", *place, **key("center left"))
    whole.margins(x=0.03)
    foot.semilogy(feet[:, 0], 1e3 * feet[:, 1], color=BLUE, marker=".", linewidth=0.8)
    foot.axhline(micro_runs.RESPONDS_UM, color=GREEN, linestyle="--", linewidth=1.0)
    foot.text(1.265, 1.15 * micro_runs.RESPONDS_UM, f"{micro_runs.RESPONDS_UM:g} um", fontsize=8)
    first = micro_runs.first_response(runs.feet)
    if np.isfinite(first):
        at = (first, 1e3 * micro_runs.highest(runs.feet[first]))
        note(foot, f"first response\n{first:g} V", at, (10, -28))
        foot.plot(*at, color=RED, marker="o", fillstyle="none", markersize=8)
    foot.axvline(1.3, color="0.4", linestyle=":", linewidth=1.0)
    finish(foot, "(b) where it begins, in 60 s", "CTRL [V]", "highest position [um]")
    foot.margins(x=0.03)
    return caption("5.10 (stop)", figure)


def effort(runs: MicroRuns) -> Drawn:
    """Figure 5.19: CTRL under proportional control."""
    figure, axes = new(3.6, 1, 3, gridspec_kw={"width_ratios": [1.2, 1.2, 0.8]})
    full, near, ripple = axes[0]
    curves(full, runs.proportional, GAINS, column("ctrl"), "Kp", (0.0, 3.0))
    curves(near, runs.proportional, GAINS, column("ctrl"), "Kp", (0.45, 1.25))
    near.set_ylim(1.0, 2.3)
    finish(full, "(a) full view", y="controller output [V]", **key("upper right"))
    finish(near, "(b) zoom")
    ripples = {k: s.ripple for k, s in _swings(runs).items()}
    by_gain(ripple, ripples, "(c) ripple [V]", "Kp [V/mm]")
    return caption("5.19", figure)


def _swings(runs: MicroRuns) -> dict[float, Swing]:
    return {k: micro_runs.swing(r) for k, r in sorted(runs.proportional.items())}


def proportional(runs: MicroRuns) -> Drawn:
    """Figure 5.20: position under proportional control."""
    figure, axes = new(3.6, 1, 2, gridspec_kw={"width_ratios": [1.6, 1]})
    place, left = axes[0]
    curves(place, runs.proportional, GAINS, millimetres, "Kp", (0.0, 3.0))
    target(place)
    position = {"y": "position [mm]", **key("lower right", ncols=2)}
    finish(place, "(a) position by the laser", **position)
    swings = _swings(runs)
    for name, colour, marker, values in (
        ("error at rest", BLUE, "o", [s.error for s in swings.values()]),
        ("overshoot of the rest", RED, "^", [s.overshoot for s in swings.values()]),
    ):
        left.semilogy(list(swings), values, color=colour, marker=marker, ms=4, lw=1.0, label=name)
    left.axhline(sequence.BAND_UM, color=GREEN, linestyle=":", linewidth=1.2)
    finish(left, "(b) error and overshoot [um]", "Kp [V/mm]", **key())
    left.margins(x=0.04)
    return caption("5.20", figure, chosen=micro_runs.chosen_gain(swings))


def integral(runs: MicroRuns) -> Drawn:
    """Figure 5.22: PI control without anti-windup."""
    figure, axes = new(3.8, 1, 2)
    work, place = axes[0]
    curves(work, runs.integral, INTEGRAL_GAINS, column("micro_integral"), "Ki")
    curves(place, runs.integral, INTEGRAL_GAINS, millimetres, "Ki")
    cut = [k for k in INTEGRAL_GAINS if not runs.integral[k].attributes.get("finished", 1)]
    for k in cut:
        r = runs.integral[k]
        for ax, values in ((work, column("micro_integral")), (place, millimetres)):
            ax.plot(r["t"][-2], values(r)[-1], color=INTEGRAL_GAINS[k], marker="x", ms=6)
    target(place)
    place.set_ylim(3.0, 4.1)
    finish(work, "(a) integral effort", y="integral effort [V]", **key("upper right"))
    position = {"y": "position [mm]", **key("lower right", ncols=2)}
    finish(place, "(b) position by the laser", **position)
    stopped = (
        f" With Ki {', '.join(f'{k:g}' for k in cut)} the stage runs into its stop at 3.98 mm and "
        "the guard ends the run (crosses) before the integral has turned."
        if cut
        else ""
    )
    return caption(
        "5.22", figure, chosen=micro_runs.chosen_integral_gain(runs.integral), stopped=stopped
    )


def held_back(runs: MicroRuns) -> Drawn:
    """Figure 5.26: anti-windup with several gains."""
    figure, axes = new(3.8, 1, 3, gridspec_kw={"width_ratios": [1.2, 1.2, 0.8]})
    work, place, swing = axes[0]
    curves(work, runs.held_back, HELD_BACK_GAINS, column("micro_integral"), "Ki", (0.0, 3.0))
    work.set_ylim(1.45, 1.9)
    curves(place, runs.held_back, HELD_BACK_GAINS, millimetres, "Ki", (0.0, 3.0))
    target(place)
    finish(work, "(a) zoom of the integral effort [V]", **key("upper left", borderpad=0.25))
    finish(place, "(b) position by the laser [mm]")
    unrest = {k: micro_runs.unrest(r) for k, r in sorted(runs.held_back.items())}
    by_gain(swing, unrest, "(c) late swing [V]", "Ki = Kaw")
    return caption("5.26", figure, chosen=unrest[30.0], larger=unrest[60.0])


LASER_NOISE_UM = 2.0


def claims(runs: MicroRuns) -> list[Claim]:
    return judge(
        [
            ("S3", lambda: _stop(runs)),
            ("S4", lambda: _foot(runs)),
            ("S11", lambda: _proportional(runs)),
            ("S12", lambda: _windup(runs)),
            (("S13a", "S13b"), lambda: _times(runs)),
            ("S13c", lambda: _accuracy(runs)),
        ]
    )


def _stop(runs: MicroRuns) -> Claim:
    place = {v: micro_runs.highest(r) for v, r in runs.steps.items()}
    above = [place[v] for v in micro_runs.ABOVE_STOP]
    below = max(place[v] for v in micro_runs.BELOW_STOP)
    good = accepts("S3", *above) and below < band("S3")[0]
    edge = ", ".join(f"{v:g} V {place[v]:.3f} mm" for v in micro_runs.AT_STOP)
    return state(
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
    return state("S4", first, good, still=still, first=first)


def grows(values: list[float], noise: float) -> bool:
    """Whether each value reaches the one before within `noise`, and the last exceeds the first."""
    steps = np.diff(values)
    return bool(np.all(steps >= -noise) and values[-1] - values[0] > noise)


def _proportional(runs: MicroRuns) -> Claim:
    whole("a step under proportional control", *runs.proportional.values())
    swings = _swings(runs)
    errors, over, ripple = (list(each) for each in zip(*swings.values(), strict=True))
    good = min(errors) > 20.0 and grows(over, LASER_NOISE_UM) and grows(ripple, 0.0)
    low, high = min(swings), max(swings)
    return state(
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
    return state(
        "S12",
        micro_runs.chosen_integral_gain(runs.integral),
        low > 0.02 and plain > 50.0 and plain > held,
        low=low,
        plain=plain,
        held=held,
        home=home,
        top=micro_runs.highest(runs.integral[2.25]),
    )


def _times(runs: MicroRuns) -> list[Claim]:
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
        state("S13a", contract, judge_time("S13a", contract), times=said(up)),
        state("S13b", extend, judge_time("S13b", extend), times=said(down)),
    ]


def _accuracy(runs: MicroRuns) -> Claim:
    whole("the sequence of holds", *runs.held)
    worst = micro_runs.worst_hold(runs)
    count = len(runs.held) * len(micro_runs.HOLDS)
    return state("S13c", worst, count=count)


def collect(lab: Lab) -> MicroRuns:
    return micro_runs.collect(lab.settings, lab.seed, lab.runner(), lab.bench())
