"""Calibration of the Hall sensor against the laser (Section 3.2.3): Figure 3.9, claim D6."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.design import resolution
from macromicro.drawing.exhibit import Drawn
from macromicro.drawing.style import BLACK, BLUE, ORANGE, RED, finish, line, new, note
from macromicro.hall_table import profile
from macromicro.identify.hall import HallFit, fit_table
from macromicro.lab.drive import drive
from macromicro.lab.machine import Machine
from macromicro.thesis.chapter3.sensor_design import SENSITIVITY, SPAN
from macromicro.thesis.claims import Claim, state, within
from macromicro.thesis.contents import caption
from macromicro.thesis.procedure import Lab


def ramps(plant: Machine, seed: int = 0, runs: int = 3) -> list[tuple[Array, Array]]:
    ctrl, parts = profile(runs)
    found = drive(plant, "the Hall calibration", ("hall", "laser"), ctrl, seed=seed)
    return [(found["hall"][part], found["laser"][part]) for part in parts]


# Left out at either end, and the length of an end [mm].
MARGIN, END = 0.05, 0.2

# Points at which the runs' distance from the table is shown, each a mean over as many readings.
MEANS = 240


class Slopes(NamedTuple):
    """Slopes [um/mV] over the travel and at its two ends."""

    mean: float
    extended: float
    contracted: float
    step: float  # of the converter [V], by the readings
    place: Array  # [mm], both ends of the extended end, both of the contracted
    volts: Array  # at these places


class HallRuns(NamedTuple):
    runs: list[tuple[Array, Array]]  # (Hall [V], laser [m]), up and down in turn
    fit: HallFit
    slopes: Slopes


def calibrated_by(plant: Machine, seed: int = 0) -> HallRuns:
    runs = ramps(plant, seed)
    fit = fit_table(runs)
    return HallRuns(runs, fit, slopes(runs, fit))


def slopes(runs: list[tuple[Array, Array]], fit: HallFit) -> Slopes:
    """Slopes of the whole travel (without 0.05 mm at both ends) and of its last 0.2 mm."""
    volts, place = fit.volts, 1e3 * fit.calibration.position
    seen = np.isfinite(fit.std)
    low, high = max(0.0, place[seen][0]) + MARGIN, min(place[seen][-1], 3.98) - MARGIN
    where = np.array([low, low + END, high - END, high])
    at = np.interp(where, place, volts)
    codes = np.unique(np.concatenate([hall for hall, _ in runs]))
    return Slopes(
        float((high - low) / (at[3] - at[0])),
        float(END / (at[1] - at[0])),
        float(END / (at[3] - at[2])),
        float(np.diff(codes).min()),
        where,
        at,
    )


def claims(data: HallRuns) -> list[Claim]:
    found = data.slopes
    return [
        state(
            "D6",
            1e6 * resolution.calibrated(found.step, 1e-3 * found.mean),
            within("D6", found.mean),
            found=found,
            step=1e3 * found.step,
            reach=0.5 * SPAN / SENSITIVITY,
        )
    ]


def collect(lab: Lab) -> HallRuns:
    return calibrated_by(lab.bench(), lab.seed)


def draw(data: HallRuns) -> Drawn:
    fit, found = data.fit, data.slopes
    figure, axes = new(3.9, 1, 2, gridspec_kw={"width_ratios": [1.25, 1]})
    whole, near = axes[0]
    for k, (hall, laser) in enumerate(data.runs):
        up = laser[-1] > laser[0]
        colour, word = (BLUE, "up") if up else (RED, "down")
        label = f"runs {word}" if k < 2 else ""
        line(whole, hall, 1e3 * laser, colour, label, linewidth=0.8)
        rows = np.array_split(np.arange(len(hall)), MEANS)
        table = np.interp(hall, fit.volts, fit.calibration.position)
        volts, off = (np.array([c[r].mean() for r in rows]) for c in (hall, laser - table))
        line(near, volts, 1e6 * off, colour, label, linewidth=0.7)
    seen = np.isfinite(fit.std)
    table_v, table_x = fit.volts[seen], 1e3 * fit.calibration.position[seen]
    line(whole, table_v, table_x, BLACK, "averaged", linestyle="--", linewidth=1.0)
    ends = ((0, found.extended, "extended"), (2, found.contracted, "contracted"))
    for k, slope, name in ends:
        volts, place = found.volts[k : k + 2], found.place[k : k + 2]
        whole.plot(volts, place, color=ORANGE, linewidth=4, alpha=0.7)
        aside, side = (14, "left") if k == 0 else (-14, "right")
        middle = (volts.mean(), place.mean())
        note(whole, f"{slope:.2f} um/mV, {name}", middle, (aside, -3), ha=side)
    near.axhline(0.0, color=BLACK, linestyle="--", linewidth=0.9)
    finish(whole, "(a) position", "Hall sensor [V]", "contraction by the laser [mm]", legend=True)
    finish(near, "(b) laser - average", "Hall sensor [V]", "distance [um]", legend=True)
    lag = 1e6 * float(np.nanmedian(fit.between))
    return caption(
        "3.9",
        figure,
        readings=len(data.runs[0][0]) // MEANS,
        apart=2.0 * abs(lag),
        found=found,
        end=END,
    )
