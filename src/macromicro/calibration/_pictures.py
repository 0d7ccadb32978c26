"""Figures of a calibration, drawn as ISO 230-2 has them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from macromicro.calibration.iso import Means
from macromicro.calibration.procedure import Axis, Calibration
from macromicro.drawing.page import PageFigure
from macromicro.drawing.style import BLUE, RED, finish, new
from macromicro.machines import composite
from macromicro.place import Place

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DEVIATIONS = "deviations"
_CAPTION = (
    "Deviation of the true position from its target: mean of the runs, and two standard "
    "deviations to either side. Blue: approached from below; red: from above."
)


def draw(found: Calibration) -> Iterator[PageFigure]:
    places = composite.places(found.request.machine)
    yield PageFigure(DEVIATIONS, "Before and after", _CAPTION, _deviations(found, places))


def _deviations(found: Calibration, places: tuple[Place, ...]) -> Figure:
    axes = found.axes
    figure, grid = new(2.6 * len(axes) + 0.6, len(axes), 2)
    for row, (axis, place) in enumerate(zip(axes, places, strict=True)):
        _panel(grid[row, 0], axis, axis.before, place, "before")
        _panel(grid[row, 1], axis, axis.after, place, "after")
    return figure


def _panel(ax: Any, axis: Axis, means: Means, place: Place, when: str) -> None:
    x = means.place * place.per
    per = place.fines if np.max(np.abs(means.up)) > 2e-8 else 1e3 * place.fines
    unit = place.fine if per == place.fines else place.finest
    ways = ((BLUE, means.up, means.up_scatter), (RED, means.down, means.down_scatter))
    for colour, mean, scatter in ways:
        ax.plot(x, per * mean, color=colour, linewidth=1.0, marker=".", markersize=3.0)
        low, high = per * (mean - 2.0 * scatter), per * (mean + 2.0 * scatter)
        ax.fill_between(x, low, high, color=colour, alpha=0.2, linewidth=0.0)
    name = f"{axis.name}, {when}" if axis.name else when
    finish(ax, name, f"position [{place.unit}]", f"deviation [{unit}]")
