"""The Preisach model step by step (Section 2.4.1): its figures and procedure."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.drawing.exhibit import Drawn
from macromicro.drawing.style import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    RED,
    finish,
    line,
    new,
    note,
    single,
)
from macromicro.hysteresis import FodTable, Preisach, from_density
from macromicro.hysteresis.pictures import staircase
from macromicro.thesis.contents import caption
from macromicro.thesis.procedure import Lab

if TYPE_CHECKING:
    from matplotlib.figure import Figure


# The limiting triangle, alpha_0 = beta_0 = 1, and the grid of the model's table.
EXTENT, STEP = 1.0, 0.01
# u_1 to u_4 of Figures 2.13-2.16, and two more for a third trapezoid in Figure 2.17.
INPUTS = (0.7, -0.5, 0.4, -0.1)
FURTHER = (0.25, 0.1)
# alpha' and beta' of Figure 2.19.
FOD = (0.5, -0.3)
CENTRE, SPREAD = 0.3, 0.35


class Stage(NamedTuple):
    u: float
    f: float
    beta: Array  # of the staircase L(t)
    alpha: Array  # of the staircase L(t)
    path: Array  # inputs and outputs on the way there, shape (2, points)


class Trapezoid(NamedTuple):
    """Q_k: its corners M_k, m_k and m_(k-1), and its weight."""

    top: float
    low: float
    before: float
    integrated: float  # over the density
    readings: tuple[float, float]  # f_(M, m_k) and f_(M, m_(k-1)) of the model, for (2.10)

    @property
    def difference(self) -> float:
        """(2.10): half the difference of the two readings."""
        return 0.5 * (self.readings[0] - self.readings[1])


class Geometry(NamedTuple):
    stages: list[Stage]  # at u_0 = -beta_0 and after each of the inputs
    trapezoids: list[Trapezoid]  # of the last stage
    output: float  # f by (2.11) from them
    major: Array  # inputs, rising and falling branch, shape (3, points)
    fod: Array  # inputs and outputs down from alpha', shape (2, points)
    corner: tuple[float, float, float]  # f_alpha', f_alpha'beta' and the weight of T(alpha', beta')


def density(alpha: Array, beta: Array) -> Array:
    """mu(alpha, beta), not normalised: a hill about (0.3, -0.3), symmetric as f+ = -f-."""
    return np.asarray(
        np.exp(-((alpha - CENTRE) ** 2 + (beta + CENTRE) ** 2) / (2.0 * SPREAD**2)), dtype=float
    )


def model() -> Preisach:
    """The model: outputs from f- = -1 to f+ = 1, in negative saturation."""
    table = from_density(density, -EXTENT, STEP, round(2.0 * EXTENT / STEP) + 1)
    return Preisach(FodTable(table.lo, table.step, 2.0 * table.values, -1.0))


def geometry() -> Geometry:
    element = model()
    stages = [_stage(element, np.array([[element.u], [element.f]]))]
    for u in (*INPUTS, *FURTHER):
        inputs = np.linspace(element.u, u, 101)
        stages.append(_stage(element, np.stack((inputs, element.run(inputs)))))
    corners, reader = element.corners.tolist(), model()
    trapezoids, before = [], -EXTENT
    whole = weight(EXTENT, -EXTENT)
    for top, low in corners:
        integrated = (weight(top, before) - weight(top, low)) / whole
        readings = (fod(reader, top, low), fod(reader, top, before))
        trapezoids.append(Trapezoid(top, low, before, integrated, readings))
        before = low
    output = -1.0 + sum(q.readings[0] - q.readings[1] for q in trapezoids)
    alpha, beta = FOD
    down = np.linspace(alpha, -EXTENT, 151)
    curve = np.stack((down, [fod(reader, alpha, u) for u in down]))
    corner = (fod(reader, alpha, alpha), fod(reader, alpha, beta), weight(alpha, beta) / whole)
    return Geometry(stages, trapezoids, output, np.stack(element.table.major_loop), curve, corner)


def fod(element: Preisach, alpha: float, beta: float) -> float:
    """f_alpha'beta': from negative saturation up to `alpha`, down to `beta`; resets the model."""
    element.reset()
    element.step(alpha)
    return element.step(beta)


def weight(alpha: float, beta: float) -> float:
    """The integral of the density over the triangle T(alpha, beta), not normalised."""
    nodes, shares = np.polynomial.legendre.leggauss(64)
    up = 0.5 * (alpha + beta) + 0.5 * (alpha - beta) * nodes
    scale = SPREAD * math.sqrt(2.0)
    inner = [math.erf((u + CENTRE) / scale) - math.erf((beta + CENTRE) / scale) for u in up]
    hill = np.exp(-((up - CENTRE) ** 2) / scale**2)
    return float(
        0.25 * math.sqrt(math.pi) * scale * (alpha - beta) * np.sum(shares * hill * np.array(inner))
    )


def _stage(element: Preisach, path: Array) -> Stage:
    beta, alpha = staircase(element)
    return Stage(element.u, element.f, beta, alpha, path)


QS = (ORANGE, GREEN, PURPLE)


def plane(ax: Any, title: str, *, legend: bool = False) -> None:
    """Axes of the half-plane with the triangle T and its corner."""
    reach = 1.25 * EXTENT
    ax.plot([-reach, reach], [-reach, reach], color="0.5", linewidth=0.8, linestyle="--")
    ax.plot([-EXTENT, -EXTENT, EXTENT], [-EXTENT, EXTENT, EXTENT], color=BLACK, linewidth=1.0)
    ax.plot([-EXTENT, EXTENT], [-EXTENT, EXTENT], color=BLACK, linewidth=1.0)
    finish(ax, title, r"$\beta$", r"$\alpha$", legend=legend and "lower right")
    ax.set_xlim(-reach, reach)
    ax.set_ylim(-reach, reach)
    ax.set_aspect("equal")


def sets(ax: Any, stage: Stage) -> None:
    """S+ and S- at a stage, with L(t) between them."""
    corner = -EXTENT
    ax.fill([corner, EXTENT, corner], [corner, EXTENT, EXTENT], color="0.92", label="S- (off)")
    if stage.u > corner:
        beta, alpha = [*stage.beta, stage.u], [*stage.alpha, stage.u]
        ax.fill([*beta, corner], [*alpha, corner], color=BLUE, alpha=0.35, label="S+ (on)")
        ax.plot(beta, alpha, color=RED, linewidth=1.8, label="L(t)")


def word(ax: Any, text: str, place: tuple[float, float], **options: Any) -> None:
    centred = {"horizontalalignment": "center", "verticalalignment": "center"}
    ax.text(*place, text, **{"fontsize": 9, **centred, **options})


def corners(ax: Any, stage: Stage) -> None:
    """The corners (u_k, u_(k+1)) of L(t), where its input turned down."""
    for beta, alpha in zip(stage.beta[1::2], stage.alpha[1::2], strict=True):
        if alpha > beta:
            ax.plot(beta, alpha, "o", color=RED, markersize=4.5)


def step(data: Geometry, k: int) -> Figure:
    """Plane and output at stage `k`: Figures 2.12 (0) to 2.16 (4)."""
    figure, axes = new(4.3, 1, 2)
    left, right = axes[0]
    stage = data.stages[k]
    sets(left, stage)
    plane(left, "(a) Preisach plane" if k == 0 else f"(a) plane at u = u{k}", legend=k > 0)
    corners(left, stage)
    if k == 0:
        word(left, "T", (-0.45, 0.5), fontsize=13)
        word(left, r"$\alpha = \beta$", (0.3, 0.02), rotation=45)
        word(left, r"$(-\beta_0, \alpha_0)$", (-EXTENT, 1.12))
        word(left, r"$(\alpha, \beta)$", (0.02, 0.62))
        left.plot(-0.15, 0.62, "x", color=BLACK)
    else:
        rising = stage.u > data.stages[k - 1].u
        ends = ([-1.18, stage.u], [stage.u] * 2) if rising else ([stage.u] * 2, [-1.18, stage.u])
        left.plot(*ends, color="0.35", linewidth=0.8, linestyle=":")
        at = (-1.14, stage.u + 0.09) if rising else (stage.u + 0.12, -1.14)
        word(left, f"u{k}", at)
    _output(right, data, k)
    figure.subplots_adjust(left=0.06, wspace=0.1)
    return figure


def _output(ax: Any, data: Geometry, k: int) -> None:
    u, rising, falling = data.major
    for branch in (rising, falling):
        line(ax, u, branch, "0.7", "", linewidth=0.8)
    for stage in data.stages[1 : k + 1]:
        line(ax, stage.path[0], stage.path[1], BLUE, "")
    for j, stage in enumerate(data.stages[: k + 1]):
        ax.plot(stage.u, stage.f, "o", color=RED if j == k else BLACK, markersize=4.5)
        note(ax, f"u{j}", (stage.u, stage.f), (7, -9), fontsize=8.5)
    finish(ax, "(b) output (grey: major loop)", "input u", "output f")


def trapezoids(data: Geometry) -> Figure:
    figure, axes = new(4.3, 1, 2)
    left, right = axes[0]
    sets(left, data.stages[-1])
    plane(left, "(a) S+ in trapezoids")
    for k, (q, colour) in enumerate(zip(data.trapezoids, QS, strict=True), 1):
        trapezoid(left, q, colour)
        word(left, f"Q{k}", (0.5 * (q.before + q.low), 0.5 * (q.top + 0.5 * (q.before + q.low))))
        note(left, f"(M{k}, m{k})", (q.low, q.top), (6, 5), fontsize=8.5)
    word(left, "m0", (-1.0, -1.13))
    total, ticks = -EXTENT, []
    right.bar(0, total, color="0.75", width=0.6)
    for k, (q, colour) in enumerate(zip(data.trapezoids, QS, strict=True), 1):
        gain = q.readings[0] - q.readings[1]
        right.bar(k, gain, bottom=total, color=colour, width=0.6, alpha=0.7)
        total += gain
        ticks.append(f"Q{k}")
    right.axhline(data.stages[-1].f, color=RED, linewidth=1.0, linestyle="--")
    right.axhline(0.0, color=BLACK, linewidth=0.7)
    right.set_xticks(range(len(ticks) + 1), ["-f+", *ticks])
    finish(right, "(b) sum of (2.11); dashed: the model's output", "", "f")
    figure.subplots_adjust(left=0.06, wspace=0.1)
    return figure


def triangles(q: Trapezoid, k: int) -> Figure:
    figure, axes = new(3.5, 1, 3)
    shapes = (
        (f"(a) trapezoid Q{k}", None),
        (f"(b) T(M{k}, m{k - 1})", q.before),
        (f"(c) T(M{k}, m{k})", q.low),
    )
    for ax, (title, low), colour in zip(axes[0], shapes, QS, strict=True):
        plane(ax, title)
        if low is None:
            trapezoid(ax, q, colour)
        else:
            ax.fill([low, low, q.top], [low, q.top, q.top], color=colour, alpha=0.55)
            word(ax, f"({q.top:g}, {low:g})", (low - 0.05, q.top + 0.13))
    for ax in axes[0, 1:]:
        ax.set_ylabel("")
    return figure


def trapezoid(ax: Any, q: Trapezoid, colour: str) -> None:
    """Fill Q_k: beta from m_(k-1) to m_k, alpha from the diagonal to M_k."""
    beta, alpha = [q.before, q.before, q.low, q.low], [q.before, q.top, q.top, q.low]
    ax.fill(beta, alpha, color="1.0", linewidth=0)
    ax.fill(beta, alpha, color=colour, alpha=0.55, linewidth=0)


def collect(lab: Lab) -> Geometry:
    return geometry()


def _plane(number: str, k: int, data: Geometry) -> Drawn:
    return caption(number, step(data, k), stage=data.stages[k])


def plane_division(data: Geometry) -> Drawn:
    last = data.stages[-1]
    return caption("2.17", trapezoids(data), before=data.stages[-2].u, last=last, data=data)


def difference(data: Geometry) -> Drawn:
    k = 2
    q = data.trapezoids[k - 1]
    return caption(
        "2.18",
        triangles(q, k),
        k=k,
        before=k - 1,
        q=q,
        apart=abs(q.difference / q.integrated - 1.0),
    )


def first_order_curve(data: Geometry) -> Drawn:
    u, rising, falling = data.major
    alpha, beta = FOD
    first, second, integrated = data.corner
    figure, ax = single(3.8)
    line(ax, u, falling, "0.7", "descending branch", linewidth=0.9)
    line(ax, u, rising, BLUE, "ascending branch of the major loop", linewidth=1.3)
    line(ax, data.fod[0], data.fod[1], RED, "first-order descending curve", linewidth=1.3)
    for place, height, text in (
        (alpha, first, r"$f_{\alpha'}$"),
        (beta, second, r"$f_{\alpha'\beta'}$"),
    ):
        ax.plot([place, place], [-EXTENT, height], color="0.4", linewidth=0.8, linestyle=":")
        ax.plot(place, height, "o", color=BLACK, markersize=5)
        note(ax, text, (place, height), (9, -4), fontsize=11)
    ax.annotate(
        "",
        (beta, first),
        xytext=(beta, second),
        arrowprops={"arrowstyle": "<->", "color": ORANGE, "linewidth": 1.4},
    )
    ax.plot([beta, alpha], [first, first], color=ORANGE, linewidth=0.8, linestyle="--")
    finish(ax, "", "input u", "output f", legend=True)
    ax.set_xticks(
        [-1, beta, 0, alpha, 1],
        [r"$-\beta_0$", rf"$\beta' = {beta:g}$", "0", rf"$\alpha' = {alpha:g}$", r"$\alpha_0$"],
    )
    return caption(
        "2.19",
        figure,
        alpha=alpha,
        beta=beta,
        first=first,
        second=second,
        half=0.5 * (first - second),
        integrated=integrated,
    )


plane_at_rest = partial(_plane, "2.12", 0)
plane_after_one = partial(_plane, "2.13", 1)
plane_after_two = partial(_plane, "2.14", 2)
plane_after_three = partial(_plane, "2.15", 3)
plane_after_four = partial(_plane, "2.16", 4)
