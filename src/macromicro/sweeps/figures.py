"""The figure of a sweep: maps over two parameters of a grid, or panels over one parameter each."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from macromicro.arrays import Array
from macromicro.drawing import files
from macromicro.drawing.style import BLUE, finish, new
from macromicro.robustness.statistics import rank_correlation
from macromicro.sweeps.results import FIGURES, NAME, Quantity, Results, load

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_POINTS = 3000  # of a cloud
_ROWS, _COLUMNS = 3, 4  # of clouds: metrics, parameters
_MAP = 400_000  # cells
_LINES = (10.0, 25.0, 50.0, 75.0, 90.0)  # contours: so many percent of the variants are below
_APART = 0.003  # of the range of colours: differences below are noise, not contours
_DECADES = 30.0  # beyond this ratio colours are logarithmic


def save(folder: Path, kinds: Sequence[str] = files.DEFAULT) -> list[Path]:
    """Draw a finished sweep into its folder; figures in other formats are removed."""
    figure = draw(load(folder)) if kinds else None
    for name in FIGURES:
        (folder / name).unlink(missing_ok=True)
    if figure is None:
        return []
    files.save(figure, folder, NAME, kinds)
    return [folder / f"{NAME}.{kind}" for kind in kinds]


def draw(results: Results) -> Figure | None:
    """Draw the metrics of a sweep.

    A grid of two parameters: a map with contours for each metric. Else a panel for each metric and
    parameter, of the parameters with the largest rank correlations.
    """
    if not results.parameters or not results.metrics:
        return None
    maps = len(results.parameters) == 2 and 0 < np.prod(results.shape or 0) <= _MAP
    figure = _maps(results) if maps else _panels(results)
    rows = len(results.metrics[0].values)
    some = "" if rows == results.total else f"{rows} of "
    title = f"{results.job}, {results.method}: {some}{results.total} variants"
    top = 1.0 - 0.08 / figure.get_figheight()
    figure.suptitle(title, fontsize=9.5, x=0.01, y=top, ha="left", va="top")
    return figure


def _panels(results: Results) -> Figure:
    alone = len(results.parameters) == 1
    metrics = results.metrics if alone else results.metrics[:_ROWS]
    parameters = results.parameters if alone else _strongest(results, metrics)
    style = "-o" if alone and results.shape else "."
    count = len(metrics[0].values)
    at = np.argsort(parameters[0].values, kind="stable") if alone else np.arange(count)
    at = at[np.linspace(0, count - 1, min(count, _POINTS)).astype(int)]
    height = 1.2 + 1.9 * len(metrics)
    figure, axes = new(height, len(metrics), len(parameters), sharex="col", sharey="row")
    figure.subplots_adjust(
        left=0.115, bottom=0.75 / height, top=1.0 - 0.62 / height, hspace=0.3, wspace=0.08
    )
    for row, metric in enumerate(metrics):
        y = np.where(np.isfinite(metric.values), metric.values, np.nan)[at]
        for ax, x in zip(axes[row], parameters, strict=True):
            ax.plot(x.values[at], y, style, color=BLUE, markersize=2.5, alpha=0.6, rasterized=True)
            finish(ax, "", x.label.replace(" [", "\n[") if row == len(metrics) - 1 else "")
            ax.margins(x=0.03)
            _scale(ax, x=x)
        axes[row, 0].set_ylabel(metric.label.replace(" [", "\n["), fontsize=8.5)
        if not np.isfinite(metric.values).all():
            axes[row, 0].set_title(_title(metric), fontsize=9.5, loc="left")
    dropped = len(results.parameters) - len(parameters)
    if dropped:
        words = f"not shown: {dropped} parameters with weaker rank correlations"
        figure.text(0.985, 1.0 - 0.1 / height, words, fontsize=8, ha="right", va="top")
    return figure


def _strongest(results: Results, metrics: tuple[Quantity, ...]) -> tuple[Quantity, ...]:
    """The parameters to draw, in the order of the spec."""
    if len(results.parameters) <= _COLUMNS:
        return results.parameters
    every = slice(None, None, max(1, len(metrics[0].values) // 20_000))

    def strength(x: Quantity) -> float:
        return max(_correlation(x.values[every], y.values[every]) for y in metrics)

    drawn = sorted(results.parameters, key=strength, reverse=True)[:_COLUMNS]
    names = {each.name for each in drawn}
    return tuple(each for each in results.parameters if each.name in names)


def _correlation(x: Array, y: Array) -> float:
    """Magnitude of the rank correlation; 0 where it is not known."""
    known = np.where(np.isfinite(y), y, np.nan)
    return float(np.nan_to_num(abs(rank_correlation(x, known).value)))


def _maps(results: Results) -> Figure:
    columns = min(len(results.metrics), 2)
    rows = -(-len(results.metrics) // columns)
    height = 0.9 + 3.0 * rows
    figure, axes = new(height, rows, columns)
    figure.subplots_adjust(left=0.095, top=1.0 - 0.62 / height, wspace=0.3, hspace=0.42)
    up, across = results.parameters
    x, y = (np.reshape(each.values, results.shape) for each in (across, up))
    # Rows and columns in rising order, as contours need them.
    rising = np.ix_(np.argsort(y[:, 0]), np.argsort(x[0]))
    for ax, metric in zip(axes.flat, results.metrics, strict=False):
        z = np.ma.masked_invalid(np.reshape(metric.values, results.shape))
        _map(figure, ax, x[rising], y[rising], z[rising], metric)
        finish(ax, _title(metric), across.label, up.label)
        ax.margins(0.0)
        _scale(ax, x=across, y=up)
    for ax in axes.flat[len(results.metrics) :]:
        ax.set_visible(False)
    return figure


def _map(figure: Figure, ax: Any, x: Array, y: Array, z: Any, metric: Quantity) -> None:
    """Colours to the 2nd and 98th percentile, against outliers; NaN is grey."""
    from matplotlib.colors import LogNorm, Normalize

    ax.set_facecolor("0.8")
    ax.grid(False)
    known = z.compressed()
    if not len(known):
        ax.text(0.5, 0.5, "no number", transform=ax.transAxes, ha="center")
        return
    low, high = np.percentile(known, (2.0, 98.0))
    if not low < high:
        low, high = known.min(), known.max()
    extend = ("neither", "max", "min", "both")[(known.max() > high) + 2 * (known.min() < low)]
    norm = (LogNorm if known.min() > 0.0 and high > _DECADES * low else Normalize)(low, high)
    mesh = ax.pcolormesh(x, y, z, shading="nearest", cmap="viridis", rasterized=True, norm=norm)
    bar = figure.colorbar(mesh, ax=ax, extend=extend, pad=0.02)
    bar.ax.tick_params(labelsize=7.5)
    bar.set_label(f"[{metric.unit}]" if metric.unit else "", fontsize=8)
    levels = [float(low)]
    for level in np.percentile(known, _LINES).tolist():
        if norm(level) > norm(levels[-1]) + _APART and level < known.max():
            levels.append(level)
    if min(z.shape) >= 3 and levels[1:]:
        lines = ax.contour(x, y, z, levels[1:], colors="white", linewidths=0.7)
        ax.clabel(lines, fontsize=6.5, fmt="%.3g")


def _title(metric: Quantity) -> str:
    count = len(metric.values)
    lost = count - int(np.isfinite(metric.values).sum())
    return f"{metric.name}; no number for {lost} of {count}" if lost else metric.name


def _scale(ax: Any, **quantities: Quantity) -> None:
    for axis, quantity in quantities.items():
        if quantity.log:
            ax.set(**{f"{axis}scale": "log"})
