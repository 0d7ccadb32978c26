"""Figures 5.19, 5.20, 5.22, 5.26 of the micro-stage's gains on the 3.8 mm step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from macromicro.arrays import Array
from macromicro.drawing.exhibit import Drawn
from macromicro.drawing.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, RED, finish, line, new
from macromicro.recording import Recording
from macromicro.runs import sequence
from macromicro.thesis.captions import captioned
from macromicro.thesis.chapter5 import micro_runs
from macromicro.thesis.chapter5.micro_runs import MicroRuns, Swing

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Curves = Sequence[tuple[float, str]]

# The chosen gain is black and bold, smaller ones are cold and larger ones warm.
GAINS: Curves = ((1.0, BLUE), (2.0, GREEN), (3.0, BLACK), (5.0, ORANGE), (10.0, RED))
INTEGRAL_GAINS: Curves = (
    (0.5, BLUE),
    (0.75, PURPLE),
    (1.0, GREEN),
    (1.25, ORANGE),
    (1.5, RED),
    (2.25, BLACK),
)
HELD_BACK_GAINS: Curves = (
    (5.0, BLUE),
    (10.0, PURPLE),
    (20.0, GREEN),
    (30.0, BLACK),
    (60.0, ORANGE),
    (100.0, RED),
)
CHOSEN = (3.0, 2.25, 30.0)


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
    for gain, colour in gains:
        recording = found[gain]
        t, y = recording["t"][:-1], values(recording)
        if limits is not None:
            seen = (t >= limits[0]) & (t <= limits[1])
            t, y = t[seen], y[seen]
        width = 1.8 if gain in CHOSEN else 1.0
        line(ax, t, y, colour, f"{name} {gain:g}", linewidth=width, zorder=3 if width > 1 else 2)


def key(ax: Any, where: str = "best", **options: Any) -> None:
    ax.legend(fontsize=7.5, loc=where, framealpha=0.85, **options)


def stop(runs: MicroRuns) -> Drawn:
    """Where the stage begins and stops: highest position over CTRL."""
    figure, axes = new(3.5, 1, 2)
    whole, foot = axes[0]
    steps = np.array([(v, micro_runs.highest(r)) for v, r in sorted(runs.steps.items())])
    feet = np.array([(v, micro_runs.highest(r)) for v, r in sorted(runs.feet.items())])
    whole.axhspan(3.96, 4.0, color=GREEN, alpha=0.25, linewidth=0, label="3.98 ± 0.02 mm")
    whole.plot(*feet.T, color=BLUE, marker=".", linestyle="", label="in 60 s")
    for long, marker, label in ((True, "o", "in 200 s"), (False, "^", "in 20 s")):
        part = steps[np.isin(steps[:, 0], micro_runs.BELOW_STOP) == long]
        whole.plot(*part.T, color=RED, marker=marker, markersize=5, linestyle="", label=label)
    whole.axvline(1.65, color="0.4", linestyle=":", linewidth=1.0)
    whole.text(1.66, 0.1, "1.65 V", fontsize=8, color="0.3")
    key(whole, "center left")
    finish(whole, "(a) up to the stop", "CTRL [V]", "highest position [mm]")
    whole.margins(x=0.03)
    foot.semilogy(feet[:, 0], 1e3 * feet[:, 1], color=BLUE, marker=".", linewidth=0.8)
    foot.axhline(micro_runs.RESPONDS_UM, color=GREEN, linestyle="--", linewidth=1.0)
    foot.text(1.265, 1.15 * micro_runs.RESPONDS_UM, f"{micro_runs.RESPONDS_UM:g} um", fontsize=8)
    first = micro_runs.first_response(runs.feet)
    if np.isfinite(first):
        at = (first, 1e3 * micro_runs.highest(runs.feet[first]))
        foot.annotate(
            f"first response\n{first:g} V", at, (10, -28), textcoords="offset points", fontsize=8
        )
        foot.plot(*at, color=RED, marker="o", fillstyle="none", markersize=8)
    foot.axvline(1.3, color="0.4", linestyle=":", linewidth=1.0)
    finish(foot, "(b) where it begins, in 60 s", "CTRL [V]", "highest position [um]")
    foot.margins(x=0.03)
    return captioned("5.10 (stop)", figure)


def effort(runs: MicroRuns) -> Drawn:
    """Figure 5.19: CTRL under proportional control."""
    figure, axes = new(3.6, 1, 3, gridspec_kw={"width_ratios": [1.2, 1.2, 0.8]})
    full, near, ripple = axes[0]
    curves(full, runs.proportional, GAINS, column("ctrl"), "Kp", (0.0, 3.0))
    curves(near, runs.proportional, GAINS, column("ctrl"), "Kp", (0.45, 1.25))
    near.set_ylim(1.0, 2.3)
    key(full, "upper right")
    finish(full, "(a) full view", y="controller output [V]")
    finish(near, "(b) zoom")
    swings = _swings(runs)
    ripple.plot(list(swings), [s.ripple for s in swings.values()], color=RED, marker="o", ms=4)
    ripple.set_ylim(bottom=0.0)
    finish(ripple, "(c) ripple [V]", "Kp [V/mm]")
    ripple.margins(x=0.06)
    return captioned("5.19", figure)


def _swings(runs: MicroRuns) -> dict[float, Swing]:
    return {k: micro_runs.swing(r) for k, r in sorted(runs.proportional.items())}


def proportional(runs: MicroRuns) -> Drawn:
    """Figure 5.20: position under proportional control."""
    figure, axes = new(3.6, 1, 2, gridspec_kw={"width_ratios": [1.6, 1]})
    place, left = axes[0]
    curves(place, runs.proportional, GAINS, millimetres, "Kp", (0.0, 3.0))
    place.axhline(micro_runs.TARGET_MM, color="0.4", linestyle="--", linewidth=1.0, label="target")
    key(place, "lower right", ncols=2)
    finish(place, "(a) position by the laser", y="position [mm]")
    swings = _swings(runs)
    for name, colour, marker, values in (
        ("error at rest", BLUE, "o", [s.error for s in swings.values()]),
        ("overshoot of the rest", RED, "^", [s.overshoot for s in swings.values()]),
    ):
        left.semilogy(list(swings), values, color=colour, marker=marker, ms=4, lw=1.0, label=name)
    left.axhline(sequence.BAND_UM, color=GREEN, linestyle=":", linewidth=1.2)
    key(left)
    finish(left, "(b) error and overshoot [um]", "Kp [V/mm]")
    left.margins(x=0.04)
    return captioned("5.20", figure, chosen=micro_runs.chosen_gain(swings))


def integral(runs: MicroRuns) -> Drawn:
    """Figure 5.22: PI control without anti-windup."""
    figure, axes = new(3.8, 1, 2)
    work, place = axes[0]
    curves(work, runs.integral, INTEGRAL_GAINS, column("micro_integral"), "Ki")
    curves(place, runs.integral, INTEGRAL_GAINS, millimetres, "Ki")
    cut = [k for k, _ in INTEGRAL_GAINS if not runs.integral[k].attributes.get("finished", 1)]
    for ax, values in ((work, column("micro_integral")), (place, millimetres)):
        for k, colour in INTEGRAL_GAINS:
            if k in cut:
                r = runs.integral[k]
                ax.plot(r["t"][-2], values(r)[-1], color=colour, marker="x", ms=6)
    place.axhline(micro_runs.TARGET_MM, color="0.4", linestyle="--", linewidth=1.0, label="target")
    place.set_ylim(3.0, 4.1)
    key(work, "upper right")
    key(place, "lower right", ncols=2)
    finish(work, "(a) integral effort", y="integral effort [V]")
    finish(place, "(b) position by the laser", y="position [mm]")
    stopped = (
        f" With Ki {', '.join(f'{k:g}' for k in cut)} the stage runs into its stop at 3.98 mm and "
        "the guard ends the run (crosses) before the integral has turned."
        if cut
        else ""
    )
    return captioned(
        "5.22", figure, chosen=micro_runs.chosen_integral_gain(runs.integral), stopped=stopped
    )


def held_back(runs: MicroRuns) -> Drawn:
    """Figure 5.26: anti-windup with several gains."""
    figure, axes = new(3.8, 1, 3, gridspec_kw={"width_ratios": [1.2, 1.2, 0.8]})
    work, place, swing = axes[0]
    curves(work, runs.held_back, HELD_BACK_GAINS, column("micro_integral"), "Ki", (0.0, 3.0))
    work.set_ylim(1.45, 1.9)
    curves(place, runs.held_back, HELD_BACK_GAINS, millimetres, "Ki", (0.0, 3.0))
    place.axhline(micro_runs.TARGET_MM, color="0.4", linestyle="--", linewidth=1.0, label="target")
    key(work, "upper left", borderpad=0.25)
    finish(work, "(a) zoom of the integral effort [V]")
    finish(place, "(b) position by the laser [mm]")
    unrest = {k: micro_runs.unrest(r) for k, r in sorted(runs.held_back.items())}
    swing.plot(list(unrest), list(unrest.values()), color=RED, marker="o", ms=4, lw=1.0)
    swing.set_ylim(bottom=0.0)
    finish(swing, "(c) late swing [V]", "Ki = Kaw")
    swing.margins(x=0.06)
    return captioned("5.26", figure, chosen=unrest[30.0], larger=unrest[60.0])
