"""Spike removal for thermocouples (Figures 5.4 to 5.6), and averaging."""

# A spike begins and ends with a slope that the kiln cannot produce; a window around it becomes a
# straight line. The rest, turning points above all, is unchanged, unlike with a wide median filter.

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import ProblemError
from macromicro.identify.records import signal

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
        raise ProblemError(
            "temperature", found, "Repair the record; only rare spikes can be removed."
        )
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
