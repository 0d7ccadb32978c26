"""Hall calibration in use: sensor volts to contraction (Figure 3.9)."""

from __future__ import annotations

from functools import cache
from importlib import resources
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.columns import Meaning
from macromicro.errors import ProblemError
from macromicro.kernel import kernel


class Calibration(NamedTuple):
    """Positions on a uniform grid of voltages, interpolated linearly."""

    low: Annotated[float, Meaning("lowest voltage", "V")]
    step: Annotated[float, Meaning("from point to point", "V")]
    position: Annotated[npt.NDArray[np.float64], Meaning("", "m")]


@kernel
def position(p: Calibration, volts: float) -> float:
    """Contraction for a Hall reading, clamped to the table."""
    last = len(p.position) - 1
    place = (volts - p.low) / p.step
    if not place > 0.0:
        return float(p.position[0])
    if place >= last:
        return float(p.position[last])
    i = int(place)
    share = place - i
    return float(p.position[i] + share * (p.position[i + 1] - p.position[i]))


@cache
def default_calibration() -> Calibration:
    """The calibration of the default bench, made by ``macromicro.identify.hall``."""
    return _parse(
        resources.files("macromicro.control").joinpath("hall_calibration.csv").read_text("utf-8")
    )


def parse(text: str) -> Calibration:
    """The table in the text of the file that `macromicro identify hall` writes."""
    remedy = "Use a hall_calibration.csv with lines hall_V,position_mm at equal steps."
    try:
        table = _parse(text)
    except (ValueError, IndexError, ZeroDivisionError):
        raise ProblemError("Hall calibration", "it holds no table", remedy) from None
    if not (table.step > 0.0 and np.isfinite(table.position).all()):
        raise ProblemError("Hall calibration", "the voltages do not rise", remedy)
    return table


def _parse(text: str) -> Calibration:
    rows = [line for line in text.splitlines() if line and not line.startswith(("#", "hall"))]
    table = np.array([[float(cell) for cell in row.split(",")] for row in rows])
    low, step = float(table[0, 0]), float(table[-1, 0] - table[0, 0]) / (len(table) - 1)
    # Divided, not multiplied by 1e-3: so "1.5" mm is exactly the float 0.0015.
    return Calibration(low, step, np.ascontiguousarray(table[:, 1] / 1e3))
