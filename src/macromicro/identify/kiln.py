"""Hysteresis from the kiln's recordings (Section 5.2.1, Figures 5.4 to 5.9).

Spikes are taken out, noise averaged, heating cycles cut into first-order descending
curves, and the curves made into the table of (5.1). Temperatures in degC, positions in mm.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.hysteresis.preisach import Preisach
from macromicro.hysteresis.table import FodTable, Shape
from macromicro.identify.records import signal
from macromicro.identify.smoothing import window_means, without_spikes
from macromicro.recording import Recording

# Seconds over which a parabola is fitted to the noise that is left: it keeps turning points.
NOISE_S = 6.0
# A leg is a rise or fall of at least this many degC.
LEAST_LEG = 3.0
_COLD, _ABOVE = 35.0, 4.0  # degC, and K above the coldest of a record: cold enough


class Profile(NamedTuple):
    """A cleaned record.

    Attributes
    ----------
    t : ndarray, shape (n,)
        s.
    temperature : ndarray, shape (n,)
        deg C.
    position : ndarray, shape (n,)
        mm.
    """

    t: Array
    temperature: Array
    position: Array


def cleaned(recording: Recording, noise: float = NOISE_S) -> Profile:
    """Time, temperature without spikes and noise, and position of a kiln recording.

    Parameters
    ----------
    recording : Recording
        Recording with the columns t, thermocouple and position.
    noise : float, optional
        Window of the parabola that is fitted to the temperature around each sample, s; 0 leaves the
        noise in.

    Returns
    -------
    Profile
        s, deg C and mm.

    Raises
    ------
    InputError
        A column is missing or unusable.
    """
    t = signal(recording["t"], "t")
    temperature = without_spikes(t, recording["thermocouple"]).values
    samples = int(noise / recording.dt) | 1
    if samples >= 5:
        from scipy.signal import savgol_filter

        temperature = np.asarray(savgol_filter(temperature, samples, 2), dtype=np.float64)
    return Profile(t, temperature, signal(recording["position"], "position"))


def turning_points(values: npt.ArrayLike, least: float = LEAST_LEG) -> list[int]:
    """Indices of the extremes between legs of some size; first and last sample too.

    Parameters
    ----------
    values : array_like, shape (n,)
        The record.
    least : float, optional
        Size of the smallest leg, unit of `values`.

    Returns
    -------
    list[int]
        Ascending.

    Raises
    ------
    InputError
        Fewer than two values, values that are not finite, or `least` not above 0.
    """
    y = signal(values, "values")
    if len(y) < 2 or not least > 0.0:
        raise InputError("turning points", f"{len(y)} values, {least}", "2 or more, and above 0")
    points = [0]
    high = low = 0
    way = 0
    for k in range(1, len(y)):
        if y[k] > y[high]:
            high = k
        if y[k] < y[low]:
            low = k
        if way >= 0 and y[high] - y[k] >= least:
            points += [high] if high > points[-1] else []
            way, low = -1, k
        elif way <= 0 and y[k] - y[low] >= least:
            points += [low] if low > points[-1] else []
            way, high = 1, k
    last = {1: high, -1: low}.get(way, len(y) - 1)
    return points + [k for k in dict.fromkeys((last, len(y) - 1)) if k > points[-1]]


def first_order_curves(
    profile: Profile, cold: float, width: float = 0.4
) -> list[tuple[Array, Array]]:
    """The cooling branches of Figure 5.7, each from its maximum to the end of its fall.

    Only falls that follow a rise from `cold` or less count: others are minor loops.

    Parameters
    ----------
    profile : Profile
        A cleaned record.
    cold : float
        Temperature of a cold actuator, deg C.
    width : float, optional
        Points are means over windows of at most this width, K.

    Returns
    -------
    list[tuple[Array, Array]]
        Pairs of temperature (deg C) and position (mm), shape (m,) each.

    Raises
    ------
    InputError
        Fewer than two such branches.
    """
    points = turning_points(profile.temperature)
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
        found = f"{len(curves)} falls after a rise from {cold:g} degC or less"
        raise InputError("kiln recording", found, "two heating cycles or more")
    return curves


def fod_table(
    recordings: Sequence[Recording],
    cold: float | None = None,
    nodes: int = 151,
    shape: Shape = "nonnegative",
    smooth: float = 1.0,
) -> FodTable:
    """The table of Figure 5.8 from recordings of heating cycles with falling maxima.

    Parameters
    ----------
    recordings : Sequence[Recording]
        Recordings with the columns t, thermocouple and position.
    cold : float | None, optional
        A curve counts after a rise from this temperature or less, deg C; None: 35 deg C, or of a
        record in a warmer room 4 K above the coldest that it shows.
    nodes : int, optional
        Grid points per axis.
    shape : Shape, optional
        As for ``FodTable.from_curves``.
    smooth : float, optional
        As for ``FodTable.from_curves``, grid steps.

    Returns
    -------
    FodTable
        deg C to mm.

    Raises
    ------
    InputError
        The recordings or the curves are unusable.
    """
    records = [cleaned(r) for r in recordings]
    least = [
        max(_COLD, float(r.temperature.min()) + _ABOVE) if cold is None else cold for r in records
    ]
    curves = [c for r, low in zip(records, least, strict=True) for c in first_order_curves(r, low)]
    return FodTable.from_curves(curves, "descending", shape=shape, smooth=smooth, nodes=nodes)


class Prediction(NamedTuple):
    """A new profile against the model.

    Attributes
    ----------
    profile : Profile
        As measured, cleaned.
    model : ndarray, shape (n,)
        Position by the model, mm.
    rms : float
        mm.
    share : float
        The RMS error as a share of the table's stroke (S2).
    """

    profile: Profile
    model: Array
    rms: float
    share: float


def predicted(table: FodTable, recording: Recording) -> Prediction:
    """Position by (5.1) along a recording's temperature, from negative saturation on.

    Parameters
    ----------
    table : FodTable
        deg C to mm.
    recording : Recording
        Recording with the columns t, thermocouple and position.

    Returns
    -------
    Prediction
        The model's position beside the measured one.

    Raises
    ------
    InputError
        A column is missing or unusable.
    """
    profile = cleaned(recording)
    model = Preisach(table)
    x = model.run(profile.temperature)
    rms = float(np.sqrt(np.mean((x - profile.position) ** 2)))
    return Prediction(profile, x, rms, rms / abs(table.span))
