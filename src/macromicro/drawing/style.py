"""Common style of figures: colours, axes, thinning of long columns."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from macromicro.arrays import Array
from macromicro.drawing.files import EXTRA
from macromicro.extras import require

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Okabe and Ito: distinct for colour-blind eyes; line styles differ too, for grey print.
BLUE, RED, GREEN, ORANGE, PURPLE, BLACK = (
    "#0072B2",
    "#D55E00",
    "#009E73",
    "#E69F00",
    "#CC79A7",
    "#000000",
)
DPI = 110
WIDTH = 8.6
BINS = 900


def new(height: float, rows: int, columns: int = 1, **options: Any) -> tuple[Figure, Any]:
    require("figures", "matplotlib", EXTRA)
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    from macromicro.drawing.notebook import NotebookFigure

    figure = NotebookFigure(figsize=(WIDTH, height), dpi=DPI)
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, columns, squeeze=False, **options)
    for ax in axes.flat:
        ax.grid(True, color="0.88", linewidth=0.6)
        ax.set_axisbelow(True)
        ax.spines[["top", "right"]].set_visible(False)
        ax.tick_params(labelsize=8)
    # Fixed margins: measuring every text, as automatic layouts do, takes longer than drawing.
    figure.subplots_adjust(
        left=0.085,
        right=0.985,
        bottom=0.62 / height,
        top=1 - 0.45 / height,
        hspace=0.45,
        wspace=0.22,
    )
    return figure, axes


def single(height: float, **options: Any) -> tuple[Figure, Any]:
    """A figure of one panel."""
    figure, axes = new(height, 1, **options)
    return figure, axes[0, 0]


def thin_out(t: Array, y: Array, bins: int = BINS) -> tuple[Array, Array]:
    """At most two points per bin, its least and greatest value, so that peaks are kept.

    Bins of NaN stay NaN and interrupt the line.
    """
    n = len(y)
    if n <= 2 * bins:
        return t, y
    edges = np.linspace(0, n, bins, endpoint=False).astype(np.intp)
    low, high = np.fmin.reduceat(y, edges), np.fmax.reduceat(y, edges)
    return np.repeat(t[edges], 2), np.stack((low, high), axis=1).ravel()


def line(ax: Any, t: Array, y: Array, color: str, label: str, **options: Any) -> None:
    ax.plot(*thin_out(t, y), color=color, label=label, **{"linewidth": 1.1, **options})


def dots(
    ax: Any, x: Any, y: Any, color: str, marker: str = "o", label: str = "", **options: Any
) -> None:
    """Draw points that no line joins."""
    style = {"markersize": 5, "linestyle": "none", **options}
    ax.plot(x, y, color=color, marker=marker, label=label, **style)


def note(
    ax: Any, text: str, at: tuple[Any, Any], offset: tuple[float, float], **options: Any
) -> None:
    """Write beside a point; the offset is in points of print."""
    ax.annotate(text, at, offset, textcoords="offset points", **{"fontsize": 8, **options})


def finish(
    ax: Any,
    title: str,
    /,
    x: str = "time [s]",
    y: str = "",
    *,
    legend: bool | str = False,
    **key: Any,
) -> None:
    """Title, labels and a legend: above the panel, or at a place in it with options of its own."""
    ax.set_title(title, fontsize=9.5, loc="left")
    ax.set_xlabel(x, fontsize=8.5)
    ax.set_ylabel(y, fontsize=8.5)
    ax.margins(x=0.01)
    if isinstance(legend, str):
        ax.legend(loc=legend, **{"fontsize": 7.5, "frameon": False, **key})
    elif legend:
        ax.legend(
            fontsize=7.5,
            loc="lower right",
            bbox_to_anchor=(1.0, 0.98),
            ncols=4,
            frameon=False,
            borderaxespad=0.0,
            columnspacing=1.2,
            handlelength=1.8,
            handletextpad=0.5,
        )


def smooth(ax: Any, t: Array, y: Array, color: str, label: str, **options: Any) -> None:
    """Draw every k-th sample of a smooth column; `line` would fill the gaps of a dotted one."""
    every = slice(None, None, -(-len(t) // (2 * BINS)))
    line(ax, t[every], y[every], color, label, **options)


def shades(count: int) -> list[str]:
    """Colours from dark to light, distinct in grey print too (part of viridis)."""
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    return [to_hex(colormaps["viridis"](v)) for v in np.linspace(0.0, 0.88, count)]
