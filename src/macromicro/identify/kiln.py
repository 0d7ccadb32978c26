"""Hysteresis from the kiln's recordings (Section 5.2.1, Figures 5.4 to 5.9), in degC and mm.

Thermocouples have spikes, which are removed (Figures 5.4 to 5.6), and noise, which is averaged.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import ProblemError
from macromicro.hysteresis.diagnostics import turning_points
from macromicro.hysteresis.preisach import Preisach
from macromicro.hysteresis.table import FodTable, Shape
from macromicro.hysteresis.table_files import load_table
from macromicro.identify.records import signal
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


def denoise(t: Array, temperature: Array, dt: float, noise: float = NOISE_S) -> Array:
    """A thermocouple's readings without spikes and noise."""
    smooth = without_spikes(t, temperature).values
    samples = int(noise / dt) | 1
    if not 5 <= samples <= len(smooth):
        return smooth
    from scipy.signal import savgol_filter

    return np.asarray(savgol_filter(smooth, samples, 2), dtype=np.float64)


def clean(recording: Recording, noise: float = NOISE_S) -> Profile:
    """Time, temperature without spikes and noise, and position of a kiln recording."""
    t = signal(recording["t"], "t")
    temperature = denoise(t, recording["thermocouple"], recording.dt, noise)
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
    records = [clean(r) for r in recordings]
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


def predict(table: FodTable, recording: Recording) -> Prediction:
    profile = clean(recording)
    model = Preisach(table)
    x = model.run(profile.temperature)
    rms = float(np.sqrt(np.mean((x - profile.position) ** 2)))
    return Prediction(profile, x, rms, rms / abs(table.span))


# A spike begins and ends with a slope that the kiln cannot produce; a window around it becomes a
# straight line. The rest, turning points above all, is unchanged, unlike with a wide median filter.


Index = npt.NDArray[np.intp]


class Smoothed(NamedTuple):
    values: Array  # the record
    replaced: npt.NDArray[np.bool_]  # replaced samples, shape (n,)
    spikes: int  # number of windows


def without_spikes(
    t: npt.ArrayLike,
    values: npt.ArrayLike,
    steepest: float = 7.0,
    window: float = 0.6,
    longest: float = 15.0,
) -> Smoothed:
    """The smoothing function of Figure 5.4: slope, window, straight line; `values` in deg C."""
    # A window surrounds each too steep step. The first later jump after which the record is nearer
    # to its earlier value than to the spike ends the spike. The line joins the means of three good
    # samples on both sides; at an end of the record it is the mean of the other side.
    time, y = signal(t, "t"), signal(values, "temperature")
    if len(time) != len(y) or len(y) < 5:
        found = f"times and temperatures number {len(time)} and {len(y)}"
        raise ProblemError("record", found, "Give as many of each, 5 or more.")
    if np.any(np.diff(time) <= 0.0):
        raise ProblemError("t", "the times do not increase", "Sort the rows by time.")
    jumps = np.flatnonzero(np.abs(np.diff(y) / np.diff(time)) > steepest)
    bad = np.zeros(len(y), dtype=bool)
    k = 0
    while k < len(jumps):
        last = _return(time, y, jumps, k, longest)
        a, b = np.searchsorted(time, [time[jumps[k]] - window, time[jumps[last] + 1] + window])
        bad[a:b] = True
        k = last + 1
    if bad.mean() > 0.5:
        found = f"{100 * bad.mean():.0f} % of the record is steeper than {steepest:g} per second"
        remedy = "Repair the record; only rare spikes can be removed."
        raise ProblemError("temperature", found, remedy)
    starts = np.flatnonzero(np.diff(bad.astype(np.int8), prepend=0) == 1)
    ends = np.flatnonzero(np.diff(bad.astype(np.int8), append=0) == -1) + 1
    good = np.flatnonzero(~bad)
    made = y.copy()
    for a, b in zip(starts, ends, strict=True):
        at = int(np.searchsorted(good, a))
        sides = [s for s in (good[max(at - 3, 0) : at], good[at : at + 3]) if len(s)]
        place, level = [time[s].mean() for s in sides], [y[s].mean() for s in sides]
        made[a:b] = np.interp(time[a:b], place, level)
    return Smoothed(made, bad, len(starts))


def _return(time: Array, y: Array, jumps: Index, k: int, longest: float) -> int:
    """Number of the jump that ends a spike; `k` itself if none does."""
    before = y[jumps[k]]
    height = y[jumps[k] + 1] - before
    for later in range(k + 1, len(jumps)):
        if time[jumps[later]] - time[jumps[k]] > longest:
            break
        if abs(y[jumps[later] + 1] - before) < 0.5 * abs(height):
            return later
    return k


def window_means(
    u: npt.ArrayLike, x: npt.ArrayLike, samples: int, width: float = np.inf
) -> tuple[Array, Array]:
    """Means of neighbours (Figure 5.6), over `samples` samples or a span of `width` in `u`."""
    uu, xx = signal(u, "u"), signal(x, "x")
    if len(uu) != len(xx) or samples < 1 or not width > 0.0:
        found = f"u and x have {len(uu)} and {len(xx)} values, samples is {samples}, width {width}"
        raise ProblemError("averaging", found, "Give as many of each, samples and width above 0.")
    if not len(uu):
        return uu, xx
    starts = [0]
    low = high = uu[0]
    for k in range(1, len(uu)):
        low, high = min(low, uu[k]), max(high, uu[k])
        if k - starts[-1] >= samples or high - low > width:
            starts.append(k)
            low = high = uu[k]
    count = np.diff([*starts, len(uu)])
    return np.add.reduceat(uu, starts) / count, np.add.reduceat(xx, starts) / count
