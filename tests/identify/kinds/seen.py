"""What tests of the kinds share: a table in a file, and what a figure shows."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.io import savemat

from macromicro.arrays import Array
from macromicro.hysteresis import FodTable
from macromicro.identify.picking import Picking
from macromicro.identify.result import Line


class Plot(NamedTuple):
    """One pair of axes: title, labels, and (label, x, y) of each line."""

    title: str
    x: str
    y: str
    lines: list[tuple[str, Array, Array]]
    legend: bool


def plots(figure: Any) -> list[Plot]:
    """What the axes of a figure show."""
    return [
        Plot(
            ax.get_title(loc="left"),
            ax.get_xlabel(),
            ax.get_ylabel(),
            [(str(x.get_label()), *map(np.asarray, x.get_data())) for x in ax.lines],
            ax.get_legend() is not None,
        )
        for ax in figure.axes
    ]


def table(path: Path, head: str, *columns: npt.ArrayLike) -> Path:
    """A CSV file with a heading, exact to 15 digits."""
    rows = np.column_stack([np.asarray(c, np.float64) for c in columns])
    np.savetxt(path, rows, delimiter=",", header=head, comments="", fmt="%.15g")
    return path


def given(*files: Path, **columns: str) -> Picking:
    """Files as a command line names them."""
    return Picking(list(files), columns)


def facts(lines: list[Line]) -> dict[str, Line]:
    """Lines by name; each name once."""
    found = {line.name: line for line in lines}
    assert len(found) == len(lines)
    return found


def mat(path: Path, **values: npt.ArrayLike) -> Path:
    """A MAT file; single numbers are constants of the file."""
    savemat(path, {name: np.asarray(v, np.float64) for name, v in values.items()})
    return path


def degrees() -> FodTable:
    """Position [mm] over temperature [degC]: 0.1 mm for each degree from 20 to 60."""
    curves = []
    for top in np.linspace(24.0, 60.0, 10):
        u = np.linspace(top, 20.0, 30)
        curves.append((u, 0.1 * (u - 20.0)))
    return FodTable.from_curves(curves, "descending")
