"""Temperature from position (Section 5.2.2): the kiln's table inverted, with its error."""

# Valid after full extension for one heating and one cooling: no minor loops.

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.hysteresis.table import FodTable


class Doubt(NamedTuple):
    position: float = 0.006  # error of the reading and of the table, mm
    # error of the thermometer that the table was made with, as it stands for the wires, K
    temperature: float = 0.3


class Inferred(NamedTuple):
    """Temperatures with a band of two standard errors."""

    temperature: Array  # deg C
    low: Array  # lower end of the band, deg C; in saturation it reaches to the end of the table
    high: Array  # upper end, deg C
    slope: Array  # slope of the branch, mm/K: what a kelvin of error is worth in position


def on_heating(table: FodTable, x: npt.ArrayLike, doubt: Doubt | None = None) -> Inferred:
    """Temperatures along the rising branch of the major loop; `x` in mm."""
    grid, rising, _ = table.major_loop
    return _inverted(grid, rising, table, x, doubt or Doubt())


def on_cooling(
    table: FodTable, x: npt.ArrayLike, peak: float, doubt: Doubt | None = None
) -> Inferred:
    """Temperatures along the first-order curve from a peak (deg C); `x` in mm."""
    if not table.lo < peak:
        raise InputError("inference, peak", peak, f"a temperature above {table.lo:g} degC")
    top = min(peak, table.hi)
    grid = np.append(table.grid[table.grid < top], top)
    return _inverted(grid, table.curve(top, grid, "descending"), table, x, doubt or Doubt())


def _inverted(
    grid: Array, branch: Array, table: FodTable, x: npt.ArrayLike, doubt: Doubt
) -> Inferred:
    """The inverse of a branch that rises with temperature; held at its ends."""
    place = np.asarray(x, dtype=np.float64)
    if table.span <= 0.0:
        raise ProblemError("inference, table", f"its span is {table.span:g}", "Give a rising one.")
    if not np.isfinite(place).all():
        raise ProblemError(
            "inference, position", "the values are not finite", "Give finite numbers."
        )
    if not (doubt.position >= 0.0 and doubt.temperature >= 0.0):
        raise InputError("inference, doubt", tuple(doubt), "errors of at least 0")
    # Flat stretches have no inverse: of equal outputs the upper end is kept at the bottom
    # of the branch, the lower end elsewhere, so that saturation reads as its beginning.
    f = np.maximum.accumulate(branch)
    first = int(np.flatnonzero(f <= f[0] + 1e-9 * table.span)[-1])
    keep = np.r_[first, first + 1 + np.flatnonzero(np.diff(f[first:]) > 1e-9 * table.span)]
    u, f = grid[keep], f[keep]
    if len(u) < 2:
        raise ProblemError(
            "inference, branch",
            "the branch is flat",
            "Choose a branch on which the output changes.",
        )
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
    """Temperature at which the rising branch has nearly ended (S6), deg C."""
    _, rising, _ = table.major_loop
    level = rising[-1] - within * table.span
    return float(on_heating(table, [level]).temperature[0])
