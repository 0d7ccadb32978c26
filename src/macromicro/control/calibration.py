"""Hall calibration in use: sensor volts to contraction (Figure 3.9)."""

from __future__ import annotations

from importlib import resources
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.errors import InputError
from macromicro.kernel import kernel


class Calibration(NamedTuple):
    """Positions on a uniform grid of voltages; straight between.

    Attributes
    ----------
    low : float
        Lowest voltage, V.
    step : float
        From point to point, V.
    position : ndarray, shape (n,)
        m.
    """

    low: float
    step: float
    position: npt.NDArray[np.float64]


@kernel
def position(p: Calibration, volts: float) -> float:
    """Contraction for a Hall reading; held at the table's ends.

    Parameters
    ----------
    p : Calibration
        The table.
    volts : float
        Voltage, V.

    Returns
    -------
    float
        m.
    """
    last = len(p.position) - 1
    place = (volts - p.low) / p.step
    if not place > 0.0:
        return float(p.position[0])
    if place >= last:
        return float(p.position[last])
    i = int(place)
    share = place - i
    return float(p.position[i] + share * (p.position[i + 1] - p.position[i]))


def shipped() -> Calibration:
    """The calibration of the default bench, made by ``macromicro.identify.hall``.

    Returns
    -------
    Calibration
        Volts to m.
    """
    return _parsed(
        resources.files("macromicro.control").joinpath("hall_calibration.csv").read_text("utf-8")
    )


def read(text: str) -> Calibration:
    """The table in the text of the file that `macromicro identify hall` writes.

    Parameters
    ----------
    text : str
        Lines of hall_V,position_mm.

    Returns
    -------
    Calibration
        Volts to m.

    Raises
    ------
    InputError
        It is no such table.
    """
    accepted = "the text of a hall_calibration.csv, lines hall_V,position_mm at equal steps"
    try:
        table = _parsed(text)
    except (ValueError, IndexError, ZeroDivisionError):
        raise InputError("Hall calibration", "no table", accepted) from None
    if not (table.step > 0.0 and np.isfinite(table.position).all()):
        raise InputError("Hall calibration", "voltages that do not rise", accepted)
    return table


def _parsed(text: str) -> Calibration:
    rows = [line for line in text.splitlines() if line and not line.startswith(("#", "hall"))]
    table = np.array([[float(cell) for cell in row.split(",")] for row in rows])
    low, step = float(table[0, 0]), float(table[-1, 0] - table[0, 0]) / (len(table) - 1)
    # Divided, not multiplied by 1e-3: so "1.5" mm is exactly the float 0.0015.
    return Calibration(low, step, np.ascontiguousarray(table[:, 1] / 1e3))
