"""Figures of a Preisach model: the plane with its staircase, the density, the curves."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from macromicro.arrays import Array
from macromicro.hysteresis.preisach import Preisach
from macromicro.hysteresis.table import FodTable

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def staircase(model: Preisach) -> tuple[Array, Array]:
    """The staircase L(t) of the Preisach plane, left side to diagonal (Figure 2.17)."""
    beta, alpha = [model.table.lo], []
    for top, low in model.corners.tolist():
        alpha.extend([top, top])
        beta.extend([low, low])
    return np.array(beta[:-1]), np.array(alpha)


def draw_plane(model: Preisach, unit: str = "") -> Figure:
    figure, axes = _figure()
    lo, hi = model.table.lo, model.table.hi
    beta, alpha = staircase(model)
    axes.fill([lo, hi, lo], [lo, hi, hi], color="0.93", label="S- (down)")
    axes.fill(
        [*beta, model.u, lo], [*alpha, model.u, lo], color="tab:blue", alpha=0.35, label="S+ (up)"
    )
    axes.plot([*beta, model.u], [*alpha, model.u], color="tab:blue", label="L(t)")
    axes.plot([lo, hi, lo, lo], [lo, hi, hi, lo], color="0.3", linewidth=0.8)
    corners = model.corners
    corners = corners[corners[:, 0] > corners[:, 1]]
    axes.plot(corners[:, 1], corners[:, 0], "o", color="tab:blue", markersize=4)
    for k, (top, low) in enumerate(corners if len(corners) < 8 else (), 1):
        axes.annotate(f"$(M_{k}, m_{k})$", (low, top), xytext=(4, 4), textcoords="offset points")
    axes.set_aspect("equal")
    title = f"Preisach plane at u = {model.u:g} {unit}".rstrip()
    _finish(axes, title, *_thresholds(unit), legend=True)
    return figure


def draw_density(table: FodTable, unit: str = "") -> Figure:
    figure, axes = _figure()
    density = np.sign(table.span) * table.density
    sizes = np.abs(density[np.isfinite(density)])
    # A few cells on the diagonal must not leave all others pale.
    most = float(np.quantile(sizes, 0.995)) or float(sizes.max())
    edges = table.grid
    mesh = axes.pcolormesh(edges, edges, density, cmap="RdBu", vmin=-most, vmax=most)
    scale = figure.colorbar(mesh, ax=axes, extend="both")
    scale.set_label(r"$\mu$ [output per input squared]", fontsize=8.5)
    scale.ax.tick_params(labelsize=8)
    axes.set_aspect("equal")
    _finish(axes, "Preisach density", *_thresholds(unit))
    return figure


def draw_curves(table: FodTable, u_unit: str = "", f_unit: str = "", most: int = 25) -> Figure:
    figure, axes = _figure()
    raw = table.raw
    chosen = [raw[k] for k in _evenly(len(raw), most)]
    descending = table.kind == "descending"
    starts = [float(u.max() if descending else u.min()) for u, _ in map(_finite, chosen)]
    for u, f in chosen:
        axes.plot(u, f, ".", color="0.6", markersize=3)
    if not raw:
        starts = [float(table.grid[k]) for k in _evenly(table.n, most)]
    for start in starts:
        end = table.lo if descending else table.hi
        inputs = np.linspace(start, end, 200)
        axes.plot(inputs, table.curve(start, inputs), color="tab:blue", linewidth=0.8)
    grid, rising, falling = table.major_loop
    axes.plot(grid, rising, color="k", linewidth=1.2, label="major loop")
    axes.plot(grid, falling, color="k", linewidth=1.2)
    title = f"First-order {table.kind} curves"
    _finish(axes, title, f"input u {_in(u_unit)}", f"output f {_in(f_unit)}", legend=True)
    return figure


def _finite(pair: tuple[Array, Array]) -> tuple[Array, Array]:
    good = np.isfinite(pair[0]) & np.isfinite(pair[1])
    return pair[0][good], pair[1][good]


def _evenly(count: int, most: int) -> list[int]:
    """At most `most` numbers below `count`, the first and the last among them."""
    return sorted({round(k) for k in np.linspace(0, count - 1, min(count, most))}) if count else []


def _figure() -> tuple[Figure, Axes]:
    from macromicro.drawing.style import new

    figure, axes = new(6.2, 1)
    return figure, axes[0, 0]


def _in(unit: str) -> str:
    return f"[{unit}]" if unit else ""


def _thresholds(unit: str) -> tuple[str, str]:
    return rf"down threshold $\beta$ {_in(unit)}", rf"up threshold $\alpha$ {_in(unit)}"


def _finish(axes: Axes, title: str, x: str, y: str, *, legend: bool = False) -> None:
    from macromicro.drawing.style import finish

    finish(axes, title, x.strip(), y.strip(), legend=legend)
