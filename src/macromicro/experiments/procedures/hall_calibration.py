"""Calibration of the Hall sensor against the laser (Section 3.2.3): Figure 3.9, claim D6."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from macromicro.drawing.exhibit import Drawn
from macromicro.drawing.style import BLACK, BLUE, ORANGE, RED, finish, line, new
from macromicro.experiments import hall_slopes
from macromicro.experiments.hall_slopes import HallRuns
from macromicro.experiments.procedure import Lab, Procedure

# Points at which the runs' distance from the table is shown, each a mean over as many readings.
MEANS = 240


def collect(lab: Lab) -> HallRuns:
    """Slow ramps of CTRL up and down, three times; Hall voltage and laser."""
    return hall_slopes.collect(lab.bench(), lab.seed)


def draw(data: HallRuns) -> Iterator[Drawn]:
    """Figure 3.9."""
    fit, found = data.fit, data.slopes
    figure, axes = new(3.9, 1, 2, gridspec_kw={"width_ratios": [1.25, 1]})
    whole, near = axes[0]
    for k, (hall, laser) in enumerate(data.runs):
        up = laser[-1] > laser[0]
        colour, word = (BLUE, "up") if up else (RED, "down")
        label = f"runs {word}" if k < 2 else ""
        line(whole, hall, laser, colour, label, linewidth=0.8)
        rows = np.array_split(np.arange(len(hall)), MEANS)
        table = np.interp(hall, fit.volts, fit.calibration.position)
        volts, off = (np.array([c[r].mean() for r in rows]) for c in (hall, laser - table))
        line(near, volts, 1e3 * off, colour, label, linewidth=0.7)
    seen = np.isfinite(fit.std)
    table_v, table_x = fit.volts[seen], fit.calibration.position[seen]
    line(whole, table_v, table_x, BLACK, "averaged", linestyle="--", linewidth=1.0)
    ends = ((0, found.extended, "extended"), (2, found.contracted, "contracted"))
    for k, slope, name in ends:
        whole.plot(
            found.volts[k : k + 2], found.place[k : k + 2], color=ORANGE, linewidth=4, alpha=0.7
        )
        right = k == 0
        whole.annotate(
            f"{slope:.2f} um/mV, {name}",
            (found.volts[k : k + 2].mean(), found.place[k : k + 2].mean()),
            xytext=(14 if right else -14, -3),
            textcoords="offset points",
            horizontalalignment="left" if right else "right",
            fontsize=8,
        )
    near.axhline(0.0, color=BLACK, linestyle="--", linewidth=0.9)
    finish(whole, "(a) position", "Hall sensor [V]", "contraction by the laser [mm]", legend=True)
    finish(near, "(b) laser - average", "Hall sensor [V]", "distance [um]", legend=True)
    lag = 1e3 * float(np.nanmedian(fit.between))
    yield Drawn(
        "3.9",
        "Position over the Hall sensor's reading",
        f"Three runs up, three down, and their average, which lie on each other in (a); (b) shows "
        f"how far each run is from the average, as means over {len(data.runs[0][0]) // MEANS} "
        f"readings. Up and down are {2.0 * abs(lag):.1f} um apart, which is the sensor's lag. The "
        f"slope is {found.mean:.2f} um/mV over the travel, {found.extended:.2f} and "
        f"{found.contracted:.2f} um/mV through the last {hall_slopes.END:g} mm at either end "
        "(orange).",
        figure,
        ("D6",),
    )


PROCEDURE = Procedure(
    name="hall-calibration",
    title="Calibration of the Hall sensor",
    sections=("3.2.3",),
    channels=("hall", "laser"),
    ids=("D6",),
    figures=("3.9",),
    diagrams=(),
    seconds=3.0,
    collect=collect,
    claims=hall_slopes.claims,
    draw=draw,
)
