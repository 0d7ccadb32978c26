"""Slope and resolution of the calibrated Hall sensor (Section 3.2.3): claim D6.

The calibration's ramps on a bench, read as Figure 3.9 is read.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.design import resolution
from macromicro.experiments.claim import Claim, within
from macromicro.experiments.sensor_design import SENSITIVITY, SPAN
from macromicro.experiments.statements import stated
from macromicro.identify.hall import HallFit, calibrated
from macromicro.runs import hall as hall_calibration
from macromicro.runs.machine import Machine

Array = npt.NDArray[np.float64]

# Left out at either end, and the length of an end [mm].
MARGIN, END = 0.05, 0.2


class Slopes(NamedTuple):
    """Slopes [um/mV] over the travel and at its two ends, the converter's step [V] as the
    readings show it, and the places [mm] and voltages [V] between which the slopes are
    taken, shape (4,): both ends of the extended end, both of the contracted."""

    mean: float
    extended: float
    contracted: float
    step: float
    place: Array
    volts: Array


class HallRuns(NamedTuple):
    """`runs`: (Hall [V], laser [mm]), up and down in turn; the table fitted to them; slopes."""

    runs: list[tuple[Array, Array]]
    fit: HallFit
    slopes: Slopes


def collect(plant: Machine, seed: int = 0) -> HallRuns:
    """Run the calibration's ramps, fit the table and read its slopes."""
    runs = hall_calibration.collect(plant, seed)
    fit = calibrated(runs)
    return HallRuns(runs, fit, slopes(runs, fit))


def slopes(runs: list[tuple[Array, Array]], fit: HallFit) -> Slopes:
    """Mean: travel over voltage between 0.05 mm from either end of what the runs cover; ends:
    straight lines through the 0.2 mm there."""
    volts, place = fit.volts, fit.calibration.position
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
    """D6."""
    found = data.slopes
    reach = 0.5 * SPAN / SENSITIVITY
    return [
        stated(
            "D6",
            1e6 * resolution.calibrated(found.step, 1e-3 * found.mean),
            within(found.mean, 0.75, 0.85),
            f"mean slope {found.mean:.3f} um/mV, {found.extended:.3f} at the extended and "
            f"{found.contracted:.3f} at the contracted end; the readings differ by "
            f"{1e3 * found.step:.4f} mV and multiples. The magnets' profile was chosen for the "
            f"mean; its full 5 V would be +-{reach:.0f} G, beyond the +-670 G of the SS94B1.",
        )
    ]
