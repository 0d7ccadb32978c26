"""Draws docs/figures/integrated-run.png, the README's figure, from a run of the default
programme (the counterpart of Figure 6.2).

    python docs/make_figures.py
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from macromicro import api
from macromicro.drawing.files import encoded
from macromicro.drawing.style import BLUE, GREEN, ORANGE, Floats, finish, thinned
from macromicro.recording import Recording
from macromicro.settings import Settings

PICTURE = Path(__file__).resolve().parent / "figures" / "integrated-run.png"
SET_POINT = 32  # the move to 3.0 mm after the seventh macro move
PITCH = 1e3 * Settings().sensors.encoder.pitch


def drawn(ax: Any, t: Floats, y: Floats, **options: Any) -> None:
    """A column, thinned to about four points a pixel."""
    ax.plot(*thinned(t, y, 2400), **{"linewidth": 1.5, **options})


def draw(run: Recording) -> Figure:
    """Both stages over the whole programme; below, one set point through the laser."""
    t, move = run["t"], run["move"]
    figure = Figure(figsize=(12.0, 8.0), dpi=100, facecolor="white")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(3, 1, height_ratios=(1.0, 1.0, 1.0))
    coarse = figure.add_subplot(grid[0])
    fine = figure.add_subplot(grid[1], sharex=coarse)
    near = figure.add_subplot(grid[2])
    for ax in (coarse, fine, near):
        ax.grid(True, color="0.88", linewidth=0.6)
        ax.spines[["top", "right"]].set_visible(False)
    dashed = {"color": ORANGE, "linestyle": "--", "linewidth": 1.2}
    drawn(coarse, t, run["macro_position"] * PITCH, color=BLUE, label="encoder")
    drawn(coarse, t, run["macro_reference"] * PITCH, label="reference", **dashed)
    drawn(fine, t, run["hall_position"], color=GREEN, label="Hall sensor")
    drawn(fine, t, run["micro_reference"], label="reference", **dashed)
    a, b = np.searchsorted(move, [SET_POINT, SET_POINT + 1])
    rows = slice(a + 300, b)
    target = 1e3 * float(run["micro_reference"][b - 1])
    near.axhspan(-5.0, 5.0, color=GREEN, alpha=0.13, linewidth=0, label="±5 um")
    drawn(near, t[rows], run["laser"][rows] - target, color=BLUE, label="laser", linewidth=0.7)
    near.axhline(0.0, **dashed)
    near.set_ylim(-25.0, 15.0)
    fine.axvspan(t[a], t[b - 1], color="0.55", alpha=0.25, linewidth=0)
    finish(coarse, "Macro-stage", "", "position [mm]", legend=True)
    finish(fine, "Micro-stage", "time [s]", "contraction [mm]", legend=True)
    place = float(run["macro_reference"][b - 1]) * PITCH
    title = f"The grey set point through the laser: {1e-3 * target:g} mm, carriage at {place:g} mm"
    finish(near, title, "time [s]", "laser - target [um]", legend=True)
    for ax in (coarse, fine, near):
        ax.set_title(ax.get_title(loc="left"), loc="left", fontsize=13)
        ax.tick_params(labelsize=11)
        for label in (ax.xaxis.label, ax.yaxis.label):
            label.set_fontsize(11.5)
        for text in ax.get_legend().get_texts():
            text.set_fontsize(11)
    coarse.tick_params(labelbottom=False)
    figure.align_ylabels([coarse, fine, near])
    figure.subplots_adjust(left=0.07, right=0.985, top=0.95, bottom=0.075, hspace=0.45)
    return figure


def main() -> None:
    """Run the default programme and write the picture."""
    PICTURE.parent.mkdir(parents=True, exist_ok=True)
    PICTURE.write_bytes(encoded(draw(api.run())))


if __name__ == "__main__":
    main()
