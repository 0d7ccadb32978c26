"""Temperature from position (Section 5.2.2): the kiln's table read backwards, with its error.

Only where the actuator was fully extended and then heated, or heated once and then
cooled: no minor loops. Where a branch is steep, a small error of temperature is a large
error of position, and the other way round where it is flat.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.hysteresis.table import FodTable


class Doubt(NamedTuple):
    """Standard errors.

    Attributes
    ----------
    position : float
        Error of the reading and of the table, mm.
    temperature : float
        Error of the thermometer that the table was made with, as it stands for the wires, K.
    """

    position: float = 0.006
    temperature: float = 0.3


class Inferred(NamedTuple):
    """Temperatures with a band of two standard errors.

    Attributes
    ----------
    temperature : ndarray, shape (n,)
        deg C.
    low : ndarray, shape (n,)
        Lower end of the band, deg C; in saturation it reaches to the end of the table.
    high : ndarray, shape (n,)
        Upper end, deg C.
    slope : ndarray, shape (n,)
        Slope of the branch, mm/K: what a kelvin of error is worth in position.
    """

    temperature: Array
    low: Array
    high: Array
    slope: Array


def on_heating(table: FodTable, x: npt.ArrayLike, doubt: Doubt | None = None) -> Inferred:
    """Temperatures along the rising branch of the major loop.

    Parameters
    ----------
    table : FodTable
        From the kiln, deg C to mm.
    x : array_like, shape (n,)
        Positions, mm.
    doubt : Doubt | None, optional
        Standard errors; default `Doubt()`.

    Returns
    -------
    Inferred
        One temperature per position.
    """
    grid, rising, _ = table.major_loop
    return _inverted(grid, rising, table, x, doubt or Doubt())


def on_cooling(
    table: FodTable, x: npt.ArrayLike, peak: float, doubt: Doubt | None = None
) -> Inferred:
    """Temperatures along the first-order curve that leaves the rising branch at a peak.

    Parameters
    ----------
    table : FodTable
        From the kiln, deg C to mm.
    x : array_like, shape (n,)
        Positions, mm.
    peak : float
        Peak temperature, deg C.
    doubt : Doubt | None, optional
        Standard errors; default `Doubt()`.

    Returns
    -------
    Inferred
        One temperature per position.

    Raises
    ------
    InputError
        `peak` is below the table.
    """
    if not table.lo < peak:
        raise InputError("inference, peak", peak, f"a temperature above {table.lo:g} degC")
    top = min(peak, table.hi)
    grid = np.append(table.grid[table.grid < top], top)
    return _inverted(grid, table.curve(top, grid, "descending"), table, x, doubt or Doubt())


def _inverted(
    grid: Array, branch: Array, table: FodTable, x: npt.ArrayLike, doubt: Doubt
) -> Inferred:
    """The branch (rising with temperature) read backwards; held at its ends."""
    place = np.asarray(x, dtype=np.float64)
    if table.span <= 0.0:
        raise InputError("inference, table", f"span {table.span:g}", "an output that rises")
    if not np.isfinite(place).all():
        raise InputError("inference, position", "not finite", "numbers")
    if not (doubt.position >= 0.0 and doubt.temperature >= 0.0):
        raise InputError("inference, doubt", tuple(doubt), "errors of at least 0")
    # Flat stretches have no inverse: of equal outputs the upper end is kept at the bottom
    # of the branch, the lower end elsewhere, so that saturation reads as its beginning.
    f = np.maximum.accumulate(branch)
    first = int(np.flatnonzero(f <= f[0] + 1e-9 * table.span)[-1])
    keep = np.r_[first, first + 1 + np.flatnonzero(np.diff(f[first:]) > 1e-9 * table.span)]
    u, f = grid[keep], f[keep]
    if len(u) < 2:
        raise InputError("inference, branch", "flat", "a branch on which the output changes")
    middle = np.interp(place, f, u)
    reach = 2.0 * doubt.position
    warmth = 2.0 * doubt.temperature
    low = np.where(place - reach <= f[0], grid[0], np.interp(place - reach, f, u) - warmth)
    high = np.where(place + reach >= f[-1], grid[-1], np.interp(place + reach, f, u) + warmth)
    cell = np.clip(np.searchsorted(f, place, side="right") - 1, 0, len(u) - 2)
    slope = np.diff(f)[cell] / np.diff(u)[cell]
    inside = (place > f[0]) & (place < f[-1])
    return Inferred(middle, np.minimum(low, middle), np.maximum(high, middle), slope * inside)


def full_contraction(table: FodTable, within: float = 0.05) -> float:
    """Temperature at which the rising branch has nearly come to its end (S6).

    The last few hundredths are rounded by averaging and by the encoder: what they say about
    temperature depends on where one stops.

    Parameters
    ----------
    table : FodTable
        From the kiln, deg C to mm.
    within : float, optional
        Distance from the end, as a share of the stroke.

    Returns
    -------
    float
        deg C.
    """
    _, rising, _ = table.major_loop
    level = rising[-1] - within * table.span
    return float(on_heating(table, [level]).temperature[0])
