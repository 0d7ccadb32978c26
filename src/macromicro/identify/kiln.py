"""Hysteresis from the kiln's recordings (Section 5.2.1, Figures 5.4 to 5.9), in degC and mm."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import ProblemError
from macromicro.hysteresis.diagnostics import turning_points
from macromicro.hysteresis.preisach import Preisach
from macromicro.hysteresis.table import FodTable, Shape
from macromicro.hysteresis.table_files import load_table
from macromicro.identify.records import signal
from macromicro.identify.smoothing import window_means, without_spikes
from macromicro.recording import Recording
from macromicro.schema.text import printable

# Seconds over which a parabola is fitted to the noise that is left: it keeps turning points.
NOISE_S = 6.0
# A leg is a rise or fall of at least this many degC.
LEAST_LEG = 3.0
_COLD, _ABOVE = 35.0, 4.0  # degC, and K above the coldest of a record: cold enough


class Profile(NamedTuple):
    t: Array  # s
    temperature: Array  # deg C
    position: Array  # mm


def cleaned(recording: Recording, noise: float = NOISE_S) -> Profile:
    """Time, temperature without spikes and noise, and position of a kiln recording."""
    t = signal(recording["t"], "t")
    temperature = without_spikes(t, recording["thermocouple"]).values
    samples = int(noise / recording.dt) | 1
    if samples >= 5:
        from scipy.signal import savgol_filter

        temperature = np.asarray(savgol_filter(temperature, samples, 2), dtype=np.float64)
    return Profile(t, temperature, signal(recording["position"], "position"))


def saved_table(path: Path) -> FodTable:
    """The table in a file, of positions in mm by temperatures in degC unless it has no units."""
    table = load_table(path)
    given = (table.input_unit or "degC", table.output_unit or "mm")
    if given != ("degC", "mm"):
        found = f"its input is in {given[0]} and its output in {given[1]}"
        remedy = "Give a table of positions in mm by temperatures in degC."
        raise ProblemError(printable(path, 300), found, remedy)
    return table


def first_order_curves(
    profile: Profile, cold: float, width: float = 0.4
) -> list[tuple[Array, Array]]:
    """The cooling branches of Figure 5.7 that follow a rise from `cold` (deg C) or less."""
    points = turning_points(profile.temperature, LEAST_LEG)
    curves = []
    for before, top, end in zip(points, points[1:], points[2:], strict=False):
        low, high, last = profile.temperature[[before, top, end]]
        if low > cold or high < max(low, last) + LEAST_LEG:
            continue
        u, x = profile.temperature[top : end + 1], profile.position[top : end + 1]
        uu, xx = window_means(u, x, len(u), width)
        # The curve begins where the record turned, not in the middle of its first window.
        curves.append((np.r_[u[0], uu[1:]], np.r_[x[: max(len(x) // 2000, 3)].mean(), xx[1:]]))
    if len(curves) < 2:
        found = f"{len(curves)} of at least two falls follow a rise from {cold:g} degC or less"
        raise ProblemError("kiln recording", found, "Record two heating cycles or more.")
    return curves


def fod_table(
    recordings: Sequence[Recording],
    cold: float | None = None,
    nodes: int = 151,
    shape: Shape = "nonnegative",
    smooth: float = 1.0,
) -> FodTable:
    """The table of Figure 5.8 from heating cycles with falling maxima; `cold` in deg C."""
    records = [cleaned(r) for r in recordings]
    least = [
        max(_COLD, float(r.temperature.min()) + _ABOVE) if cold is None else cold for r in records
    ]
    curves = [c for r, low in zip(records, least, strict=True) for c in first_order_curves(r, low)]
    return FodTable.from_curves(curves, "descending", shape=shape, smooth=smooth, nodes=nodes)


class Prediction(NamedTuple):
    profile: Profile  # as measured, cleaned
    model: Array  # position by the model, mm
    rms: float  # mm
    share: float  # the RMS error as a share of the table's stroke (S2)


def predicted(table: FodTable, recording: Recording) -> Prediction:
    profile = cleaned(recording)
    model = Preisach(table)
    x = model.run(profile.temperature)
    rms = float(np.sqrt(np.mean((x - profile.position) ** 2)))
    return Prediction(profile, x, rms, rms / abs(table.span))
