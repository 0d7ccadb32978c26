"""Figures of a study: yields, tornado, distributions, and the two most influential parameters."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from macromicro.batch import Metric
from macromicro.drawing import style
from macromicro.drawing.captions import captions
from macromicro.drawing.page import PageFigure
from macromicro.drawing.style import BLACK, BLUE, GREEN, ORANGE, RED
from macromicro.robustness import words
from macromicro.robustness._findings import Influence, overall, strongest, yields
from macromicro.robustness.study import Study
from macromicro.uncertainty.ranges import FACTOR
from macromicro.uncertainty.table import Uncertain

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CAPTIONS = captions(Path(__file__).with_name("figures.toml"))
FIGURES = tuple(CAPTIONS)
_BARS = 6
_LABEL = 42  # characters of a line below a panel
_FAINT = "0.45"
_HATCHED: dict[str, Any] = {"facecolor": "white", "hatch": "////", "linewidth": 0.6}


def draw(study: Study) -> Iterator[PageFigure]:
    yield _yields(study)
    if not np.isnan(study.single[:, :, 0]).all():
        yield _tornado(study)
    yield _distributions(study)
    if len(study.rows) > 1 and len(study.subject.uncertain) > 1:
        yield _scatter(study)


def _yields(study: Study) -> PageFigure:
    found, whole = yields(study), overall(study)
    labels = [f"{y.requirement.metric.meaning}\n{y.requirement.text}" for y in found]
    shares = [y.all for y in found]
    figure, ax = style.single(0.9 + 0.48 * (len(found) + 1))
    figure.subplots_adjust(left=0.37)
    places = np.arange(len(found) + 1)[::-1]
    for place, s, colour in zip(
        places, [*shares, whole], [BLUE] * len(shares) + [BLACK], strict=True
    ):
        ax.barh(place, 100.0 * s.share, color=colour, alpha=0.75, height=0.62)
        ax.plot([100 * s.low, 100 * s.high], [place, place], color=ORANGE, linewidth=2.2)
        ax.plot([100 * s.low, 100 * s.high], [place, place], "|", color=ORANGE, markersize=9)
        ax.text(102, place, f"{s.passed} of {s.total}", va="center", fontsize=8)
    ax.set_yticks(places, [*labels, "all together"], fontsize=8)
    style.finish(ax, "Share of machines that meet each requirement", "yield [%]")
    ax.set_xlim(0.0, 114.0)
    ax.set_xticks(range(0, 101, 20))
    return CAPTIONS["yields"].page("yields", figure, machines=len(study.rows))


def _tornado(study: Study) -> PageFigure:
    names = [n for n in study.subject.main if math.isfinite(study.nominal[study.at(n)])]
    rows = max(1, (len(names) + 1) // 2)
    height = 0.8 + 2.35 * rows
    figure, axes = style.new(height, rows, 2)
    figure.subplots_adjust(left=0.155, wspace=0.52, hspace=0.75, right=0.97)
    for ax in axes.flat[len(names) :]:
        ax.set_visible(False)
    for letter, ax, name in zip("abcdef", axes.flat, names, strict=False):
        _bars(ax, study, name, letter)
    _legend(figure, height)
    count = len(study.subject.uncertain)
    return CAPTIONS["tornado"].page("tornado", figure, parameters=count, bars=_BARS)


def _legend(figure: Figure, height: float) -> None:
    """One legend of colours and hatching for all panels, above them."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    figure.subplots_adjust(top=1.0 - 0.68 / height)
    figure.legend(
        handles=[
            Patch(facecolor=BLUE, label="at the low end"),
            Patch(facecolor=ORANGE, label="at the high end"),
            Patch(**_HATCHED, edgecolor=_FAINT, label="never settled, or stopped"),
            Line2D([], [], color=BLACK, linewidth=0.9, label="nominal"),
        ],
        loc="upper center",
        ncols=4,
        fontsize=8,
        frameon=False,
    )


def _bars(ax: Any, study: Study, name: str, letter: str) -> None:
    metric = study.metric(name)
    middle = float(study.nominal[study.at(name)])
    found = words.top_influences(study, name, _BARS)
    known = [v for i in found for v in (i.low, i.high) if math.isfinite(v)]
    low, high = min([middle, *known]), max([middle, *known])
    room = 0.12 * (high - low) or max(0.1 * abs(middle), 0.1)
    edge = high + 2.0 * room
    places = range(_BARS - 1, _BARS - 1 - len(found), -1)
    for place, each in zip(places, found, strict=True):
        _pair(ax, place, each, middle, edge)
    ax.axvline(middle, color=BLACK, linewidth=0.9)
    ax.set_yticks(places, [_label(i) for i in found], fontsize=7.5)
    unit = f" [{metric.unit}]" if metric.unit else ""
    label = textwrap.fill(f"{metric.meaning}{unit}", 50)
    style.finish(ax, f"({letter}) {name.replace('_', ' ')}", label)
    ax.locator_params(axis="x", nbins=5)
    ax.set_xlim(low - room, edge)
    ax.set_ylim(-0.6, _BARS - 0.4)


def _pair(ax: Any, place: int, each: Influence, middle: float, edge: float) -> None:
    """The bars of both ends, one below the other where both have the same sign."""
    for value, colour, offset in ((each.low, BLUE, 0.19), (each.high, ORANGE, -0.19)):
        known = math.isfinite(value)
        length = (value if known else edge) - middle
        looks = {"color": colour} if known else {**_HATCHED, "edgecolor": colour}
        ax.barh(place + offset, length, left=middle, height=0.36, **looks)


def _label(each: Influence) -> str:
    p = each.parameter
    return f"{p.name}\n{words.amount(p, p.low)} .. {words.amount(p, p.high)}"


def _distributions(study: Study) -> PageFigure:
    shown = study.subject.main
    figure, axes = style.new(5.6, 2, 3)
    figure.subplots_adjust(left=0.06, wspace=0.25, hspace=0.6)
    for ax in axes.flat[len(shown) :]:
        ax.set_visible(False)
    limits = {r.metric.name: r.limit for r in study.request.requirements}
    for letter, ax, name in zip("abcdef", axes.flat, shown, strict=False):
        values = study.column(name)
        finite = values[np.isfinite(values)]
        metric = study.metric(name)
        if len(finite):
            ax.hist(finite, bins=_edges(finite, metric), rwidth=0.92, color=BLUE, alpha=0.75)
        if name in limits:
            ax.axvline(limits[name], color=RED, linewidth=1.2, linestyle="--")
        never, unknown = int(np.isposinf(values).sum()), int(np.isnan(values).sum())
        ax.text(
            0.98,
            0.95,
            f"{never} never\n{unknown} unknown",
            transform=ax.transAxes,
            ha="right",
            va="top",
            fontsize=7.5,
            color=_FAINT,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.5},
        )
        unit = f" [{metric.unit}]" if metric.unit else ""
        label = textwrap.fill(f"{metric.meaning}{unit}", _LABEL)
        style.finish(ax, f"({letter}) {name.replace('_', ' ')}", label)
        if metric.unit == "count":
            ax.xaxis.get_major_locator().set_params(integer=True)
        ax.xaxis.label.set_fontsize(7.5)
        ax.yaxis.get_major_locator().set_params(integer=True)
        ax.set_ylim(0.0, 1.3 * ax.get_ylim()[1])  # room for the counts
        if letter in "ad":
            ax.set_ylabel("machines", fontsize=8)
    return CAPTIONS["distributions"].page("distributions", figure)


def _edges(finite: Any, metric: Metric) -> Any:
    if metric.unit == "count":
        return np.arange(-0.5, finite.max() + 1.5)
    middle = float(np.median(finite))
    if np.ptp(finite) <= 1e-9 * abs(middle):  # equal except for rounding
        return middle + (0.5 * abs(middle) or 0.5) * np.linspace(-1.0, 1.0, 26)
    return 25


def _scatter(study: Study) -> PageFigure:
    name, ranked = strongest(study)
    first, second = ranked[0].parameter, ranked[1].parameter
    order = [u.name for u in study.subject.uncertain]
    amounts = study.sample.amounts[: len(study.rows)]
    x, y = (amounts[:, order.index(p.name)] for p in (first, second))
    requirement = next(r for r in study.request.requirements if r.metric.name == name)
    met = study.met(requirement)
    known = ~np.isnan(study.column(name))
    every = study.met(*study.request.requirements)
    stopped = study.column("fault") > 0.0
    figure, axes = style.new(3.9, 1, 2)
    titles = (f"(a) {requirement.metric.meaning}\n     {requirement.text}", "(b) everything")
    looks = ((GREEN, "o", "met"), (RED, "x", "not met"))
    groups = (
        ((met, known & ~met, ~known), (*looks, (BLACK, "+", "not known"))),
        ((every, ~every & ~stopped, stopped), (*looks, (BLACK, "+", "stopped by the guard"))),
    )
    below: Any = {"legend": "upper center", "bbox_to_anchor": (0.5, -0.16), "ncols": 3}
    for ax, title, (sets, styles) in zip(axes[0], titles, groups, strict=True):
        for chosen, (colour, marker, label) in zip(sets, styles, strict=True):
            points = (x[chosen], y[chosen])
            ax.scatter(*points, s=16, c=colour, marker=marker, label=label, linewidths=1.0)
        style.finish(ax, title, _axis(first), _axis(second), **below)
        ax.margins(0.03)
    figure.subplots_adjust(top=0.86, bottom=0.22)
    tried = len(study.subject.uncertain)
    one, other = (words.rank(each.correlation, tried) for each in ranked[:2])
    meaning = requirement.metric.meaning
    return CAPTIONS["scatter"].page("scatter", figure, meaning=meaning, one=one, other=other)


def _axis(each: Uncertain) -> str:
    return f"{each.name} [{'of nominal' if each.kind == FACTOR else each.unit}]"
