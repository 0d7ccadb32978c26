"""Interference off a thermocouple's record (Figures 5.4 to 5.6), and averaging.

A spike begins and ends with a jump. Where the slope is larger than the kiln can make it,
a window is placed, and the record inside it becomes a straight line. The rest, turning
points above all, is left as it is: that is why this beats a wide median filter.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify.records import signal

Index = npt.NDArray[np.intp]


class Smoothed(NamedTuple):
    """A record without spikes.

    Attributes
    ----------
    values : ndarray, shape (n,)
        The record.
    replaced : npt.NDArray[np.bool_]
        Which samples are new, shape (n,).
    spikes : int
        Number of windows.
    """

    values: Array
    replaced: npt.NDArray[np.bool_]
    spikes: int


def without_spikes(
    t: npt.ArrayLike,
    values: npt.ArrayLike,
    steepest: float = 7.0,
    window: float = 0.6,
    longest: float = 15.0,
) -> Smoothed:
    """The smoothing function of Figure 5.4: slope, window, straight line.

    A step from one sample to the next that is too steep is a jump; a window is placed around it.
    The first later jump after which the record is back, nearer to where it was before than to the
    spike, ends the spike: all between the two goes as well. Each window becomes the straight line
    between the means of the three good samples on its two sides; at an end of the record it becomes
    the mean of the other side.

    Parameters
    ----------
    t : array_like, shape (n,)
        Times, s.
    values : array_like, shape (n,)
        Values, deg C.
    steepest : float, optional
        Slope beyond which a step is a jump, K/s.
    window : float, optional
        To either side of a jump, s.
    longest : float, optional
        Duration of the longest spike, s.

    Returns
    -------
    Smoothed
        The record, and what was replaced.

    Raises
    ------
    InputError
        Unequal lengths, times that do not rise, fewer than five samples, or a record of which more
        than half would go.
    """
    time, y = signal(t, "t"), signal(values, "temperature")
    if len(time) != len(y) or len(y) < 5:
        found = f"{len(time)} times, {len(y)} temperatures"
        raise InputError("record", found, "as many of each, 5 or more")
    if np.any(np.diff(time) <= 0.0):
        raise InputError("t", "does not rise", "times in rising order")
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
        raise InputError("temperature", found, "a record whose spikes are rare")
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
    """Number of the jump that ends the spike which jump `k` begins; `k` itself if none does."""
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
    """Means of neighbours (Figure 5.6, diamonds): less noise and fewer points.

    A window closes after `samples` samples, or as soon as `u` spans more than `width` in it, so
    that steep places keep their points.

    Parameters
    ----------
    u, x : array_like, shape (n,)
        Input and output.
    samples : int
        The most in a window.
    width : float, optional
        The most that `u` may span in a window.

    Returns
    -------
    u : ndarray, shape (windows,)
        Means.
    x : ndarray, shape (windows,)
        Means.

    Raises
    ------
    InputError
        Unequal lengths, fewer than one sample, or a width not above 0.
    """
    uu, xx = signal(u, "u"), signal(x, "x")
    if len(uu) != len(xx) or samples < 1 or not width > 0.0:
        found = f"{len(uu)} and {len(xx)} values, {samples} samples, width {width}"
        raise InputError("averaging", found, "equal lengths, 1 sample or more, a width above 0")
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
