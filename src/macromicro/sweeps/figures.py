"""The figure of a sweep: metrics over one parameter, maps over two, or clouds of points."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from macromicro.arrays import Array
from macromicro.drawing import files
from macromicro.drawing.style import BLUE, finish, new
from macromicro.sweeps._reading import Quantity, Results, load
from macromicro.sweeps.folder import FIGURES

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NAME = "sweep"
_POINTS = 3000  # of a cloud
_ROWS, _COLUMNS = 3, 4  # of clouds: metrics, parameters
_MAP = 400_000  # cells
_LINES = (10.0, 25.0, 50.0, 75.0, 90.0)  # contours: so many percent of the variants are below
_APART = 0.003  # of the range of colours
_DECADES = 30.0  # beyond this ratio colours are logarithmic
_MARKED = 60  # values that show as dots, too


def save(folder: Path, kinds: Iterable[str] = files.DEFAULT) -> list[Path]:
    """Draw a finished sweep into its folder; figures in other formats are removed."""
    figure = draw(load(folder))
    for name in FIGURES:
        (folder / name).unlink(missing_ok=True)
    if figure is None:
        return []
    wanted = tuple(kinds)
    files.save(figure, folder, NAME, wanted)
    return [folder / f"{NAME}.{kind}" for kind in wanted]


def draw(results: Results) -> Figure | None:
    """Draw the results of a sweep.

    One parameter: the metrics over it. A grid of two: a map with contours for each metric. Else a
    cloud for each metric and parameter, of the parameters with the largest rank correlations.
    """
    count = len(results.parameters)
    if not count or not results.metrics:
        return None
    if count == 1:
        figure = _curves(results)
    elif count == 2 and results.shape and np.prod(results.shape) <= _MAP:
        figure = _maps(results)
    else:
        figure = _clouds(results)
    rows = len(results.metrics[0].values)
    some = "" if rows == results.total else f"{rows} of "
    title = f"{results.job}, {results.method}: {some}{results.total} variants"
    figure.suptitle(title, fontsize=9.5, x=0.01, y=1.0 - 0.08 / figure.get_figheight(), ha="left",
                    va="top")  # fmt: skip
    return figure


def _figure(height: float, rows: int, columns: int = 1, **options: Any) -> tuple[Figure, Any]:
    figure, axes = new(height, rows, columns, **options)
    figure.subplots_adjust(top=1.0 - 0.62 / height, left=0.095)
    return figure, axes


def _curves(results: Results) -> Figure:
    (x,) = results.parameters
    count = len(results.metrics)
    figure, axes = _figure(1.25 + 1.6 * count, count, sharex=True)
    order = np.argsort(x.values, kind="stable")
    lines = bool(results.shape)
    for ax, metric in zip(axes[:, 0], results.metrics, strict=True):
        style = ("-o" if len(order) <= _MARKED else "-") if lines else "."
        at = order if lines else _some(order)
        shown = np.where(np.isfinite(metric.values), metric.values, np.nan)[at]
        ax.plot(x.values[at], shown, style, color=BLUE, markersize=3.5, linewidth=1.1)
        last = ax is axes[-1, 0]
        finish(
            ax, _named(metric), x.label if last else "", f"[{metric.unit}]" if metric.unit else ""
        )
        _scaled(ax, x, None)
    return figure


def _maps(results: Results) -> Figure:
    count = len(results.metrics)
    columns = min(count, 2)
    rows = -(-count // columns)
    figure, axes = _figure(0.9 + 3.0 * rows, rows, columns)
    across, up = results.parameters[1], results.parameters[0]
    x, y = (np.reshape(p.values, results.shape) for p in (across, up))
    for ax, metric in zip(axes.flat, results.metrics, strict=False):
        z = np.ma.masked_invalid(np.reshape(metric.values, results.shape))
        # Rows and columns in rising order, as contours need them.
        rising = np.ix_(np.argsort(y[:, 0]), np.argsort(x[0]))
        _map(figure, ax, x[rising], y[rising], z[rising], metric)
        finish(ax, _named(metric), across.label, up.label)
        ax.margins(0.0)
        _scaled(ax, across, up)
    for ax in axes.flat[count:]:
        ax.set_visible(False)
    figure.subplots_adjust(wspace=0.3, hspace=0.42)
    return figure


def _map(figure: Figure, ax: Any, x: Array, y: Array, z: Any, metric: Quantity) -> None:
    """Colours to the 2nd and 98th percentile, against outliers; NaN is grey."""
    from matplotlib.colors import LogNorm, Normalize

    ax.set_facecolor("0.8")
    ax.grid(False)
    known = np.asarray(z.compressed(), float)
    if not len(known):
        ax.text(0.5, 0.5, "no number", transform=ax.transAxes, ha="center")
        return
    low, high = (float(v) for v in np.percentile(known, (2.0, 98.0)))
    if not low < high:
        low, high = float(known.min()), float(known.max())
    over, under = bool(known.max() > high), bool(known.min() < low)
    extend = ("neither", "max", "min", "both")[over + 2 * under]
    wide = known.min() > 0.0 and high > _DECADES * low
    mesh = ax.pcolormesh(
        x, y, z, shading="nearest", cmap="viridis", rasterized=True,
        norm=(LogNorm if wide else Normalize)(low, high),
    )  # fmt: skip
    bar = figure.colorbar(mesh, ax=ax, extend=extend, pad=0.02)
    bar.ax.tick_params(labelsize=7.5)
    bar.set_label(f"[{metric.unit}]" if metric.unit else "", fontsize=8)
    levels = _levels(known, mesh.norm, low)
    if min(z.shape) >= 3 and levels:
        lines = ax.contour(x, y, z, levels, colors="white", linewidths=0.7)
        ax.clabel(lines, fontsize=6.5, fmt="%.3g")


def _levels(known: Array, norm: Any, low: float) -> list[float]:
    """Levels of the contours; none where the differences are invisible."""
    levels, last = [], float(norm(low))
    for level in np.percentile(known, _LINES).tolist():
        if norm(level) > last + _APART and level < known.max():
            levels.append(level)
            last = float(norm(level))
    return levels


def _lost(metric: Quantity) -> int:
    return int(np.sum(~np.isfinite(metric.values)))


def _named(metric: Quantity) -> str:
    lost = _lost(metric)
    return f"{metric.name}; no number for {lost} of {len(metric.values)}" if lost else metric.name


def _clouds(results: Results) -> Figure:
    metrics, parameters = results.metrics[:_ROWS], _telling(results)
    rows, columns = len(metrics), len(parameters)
    figure, axes = _figure(1.2 + 1.9 * rows, rows, columns, sharex="col", sharey="row")
    at = _some(np.arange(len(metrics[0].values)))
    for row, metric in enumerate(metrics):
        for column, x in enumerate(parameters):
            ax = axes[row, column]
            y = np.where(np.isfinite(metric.values), metric.values, np.nan)[at]
            ax.plot(x.values[at], y, ".", color=BLUE, markersize=2.5, alpha=0.5, rasterized=True)
            below = x.label.replace(" [", "\n[") if row == rows - 1 else ""
            title = _named(metric) if column == 0 and _lost(metric) else ""
            finish(ax, title, below, metric.label.replace(" [", "\n[") if column == 0 else "")
            ax.margins(x=0.03)
            _scaled(ax, x, None)
    figure.subplots_adjust(
        wspace=0.08, hspace=0.18, left=0.115, bottom=0.75 / figure.get_figheight()
    )
    dropped = len(results.parameters) - columns
    if dropped:
        words = f"not shown: {dropped} parameters with weaker rank correlations"
        figure.text(0.985, 1.0 - 0.1 / figure.get_figheight(), words, fontsize=8, ha="right",
                    va="top")  # fmt: skip
    return figure


def _telling(results: Results) -> list[Quantity]:
    """The parameters to draw, in the order of the spec."""
    if len(results.parameters) <= _COLUMNS:
        return list(results.parameters)
    every = np.arange(len(results.metrics[0].values))
    at = every[:: max(1, len(every) // 20_000)]
    best = [
        max(_correlation(p.values[at], m.values[at]) for m in results.metrics[:_ROWS])
        for p in results.parameters
    ]
    first = np.sort(np.argsort(best, kind="stable")[::-1][:_COLUMNS])
    return [results.parameters[k] for k in first]


def _correlation(x: Array, y: Array) -> float:
    """Magnitude of the rank correlation; 0 if undefined."""
    from scipy.stats import rankdata

    good = np.isfinite(y)
    if good.sum() < 3 or np.ptp(x[good]) == 0.0 or np.ptp(y[good]) == 0.0:
        return 0.0
    return abs(float(np.corrcoef(rankdata(x[good]), rankdata(y[good]))[0, 1]))


def _some(order: Any) -> Any:
    if len(order) <= _POINTS:
        return order
    return order[np.linspace(0, len(order) - 1, _POINTS).astype(int)]


def _scaled(ax: Any, x: Quantity, y: Quantity | None) -> None:
    if x.log:
        ax.set_xscale("log")
    if y is not None and y.log:
        ax.set_yscale("log")
