"""Figures of an identification: measurement, free simulation and residual."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from macromicro.arrays import Array
from macromicro.drawing.style import BINS, BLUE, ORANGE, RED, finish, line, new, thin_out

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from macromicro.identify._report import Pair

_MOST = 3  # records that a figure shows
_LAGS = 50
_STRETCHES = 50  # of a record, one after the other


def free_runs(records: Sequence[Pair], label: str, names: Sequence[str] = ()) -> Figure:
    """Up to three records with their free simulations and differences."""
    count = min(len(records), _MOST)
    figure, axes = new(4.6, 2, count, sharex="col", gridspec_kw={"height_ratios": [2, 1]})
    for k, one in enumerate(records[:count]):
        top, low = axes[0, k], axes[1, k]
        line(top, one.t, one.measured, BLUE, "measured")
        line(top, one.t, one.model, ORANGE, "model, free run", linestyle="--")
        line(low, *_less(one.t, one.measured, one.model), RED, "measured - model")
        title = f"record {k + 1} of {len(records)}" if len(records) > 1 else ""
        finish(top, names[k] if names else title, "", label, legend=count == 1)
        finish(low, "measured less model", "time [s]")
    if count > 1:  # beside a title there is no room
        handles, words = axes[0, 0].get_legend_handles_labels()
        figure.legend(handles, words, loc="upper right", ncols=2, frameon=False, fontsize=8)
    figure.subplots_adjust(left=0.11, wspace=0.42)
    return figure


def _less(t: Array, measured: Array, model: Array) -> tuple[Array, Array]:
    cuts = np.linspace(0, len(t), _STRETCHES + 1).astype(np.intp)
    bins = BINS // _STRETCHES
    parts = [thin_out(t[a:b], measured[a:b] - model[a:b], bins) for a, b in pairwise(cuts)]
    x, y = zip(*parts, strict=True)
    return np.concatenate(x), np.concatenate(y)


def leftover(residuals: Sequence[Array], dt: float, label: str) -> Figure:
    """Residuals over time, and their autocorrelation with the 99 % band of white noise."""
    figure, axes = new(3.4, 1, 2)
    e = residuals[0] if len(residuals) == 1 else np.concatenate(list(residuals))
    t, thin = thin_out(np.arange(len(e), dtype=np.int32), e)
    line(axes[0, 0], t * dt, thin, RED, "residual")
    finish(axes[0, 0], "residuals, records in a row", y=label)
    figure.subplots_adjust(left=0.11)
    power = sum(float(r @ r) for r in residuals) or 1.0
    lags = max(min(_LAGS, min(len(r) for r in residuals) - 1), 1)
    values = [sum(float(r[k:] @ r[:-k]) for r in residuals) / power for k in range(1, lags + 1)]
    ax = axes[0, 1]
    band = 2.58 / np.sqrt(len(e))
    ax.axhspan(-band, band, color="0.9")
    ax.stem(np.arange(1, lags + 1), values, linefmt="0.4", markerfmt=".", basefmt=" ")
    finish(ax, "their autocorrelation", "lag [samples]")
    return figure


def points(title: str, x: str, y: str, series: Sequence[tuple[str, Array, Array, str]]) -> Figure:
    figure, axes = new(3.6, 1)
    ax = axes[0, 0]
    for (label, xs, ys, form), color in zip(series, (BLUE, ORANGE, RED) * 9, strict=False):
        ax.plot(xs, ys, form, color=color, label=label, linewidth=1.1, markersize=4)
    finish(ax, title, x, y, legend=len(series) > 1)
    return figure
