"""Geometry of the Preisach model (Section 2.4.1): Figures 2.12 to 2.19."""

from __future__ import annotations

from collections.abc import Iterator

from macromicro.drawing.exhibit import Drawn
from macromicro.drawing.style import BLACK, BLUE, ORANGE, RED, finish, line, new
from macromicro.experiments import preisach_geometry
from macromicro.experiments.claim import Claim
from macromicro.experiments.preisach_geometry import EXTENT, FOD, Geometry
from macromicro.experiments.procedure import Lab, Procedure
from macromicro.experiments.procedures import _preisach_planes as planes

_MOVES = (
    "Negative saturation, u = -beta_0: every relay is off. T is the limiting triangle; a relay is "
    "a point (alpha, beta) above the diagonal.",
    "The input has risen to u1: the relays with alpha below it are on, and L(t) is a level line.",
    "The input has fallen to u2: the relays with beta above it are off again. L(t) has the corner "
    "(alpha, beta) = (u1, u2).",
    "The input has risen again, to u3 below u1: a second level link.",
    "The input has fallen to u4 above u2: a second corner, (u3, u4). The corners are the input's "
    "past extremes, which the model remembers.",
)


def collect(lab: Lab) -> Geometry:
    """Drive a Preisach model through the inputs of the figures."""
    return preisach_geometry.collect()


def claims(data: Geometry) -> list[Claim]:
    """None: the section derives, it prints no figures."""
    return []


def draw(data: Geometry) -> Iterator[Drawn]:
    """Figures 2.12 to 2.19."""
    for k, words in enumerate(_MOVES):
        stage = data.stages[k]
        title = "Preisach plane" if k == 0 else f"Preisach plane with u(t) = u{k}"
        caption = f"{words} A model of a smooth relay density gives f = "
        yield Drawn(
            f"2.{12 + k}",
            title,
            f"{caption}{stage.f:.4f} at u{k} = {stage.u:g}.",
            planes.step(data, k),
        )
    last = data.stages[-1]
    yield Drawn(
        "2.17",
        "S+ divided into trapezoids",
        f"After two more turns, at {data.stages[-2].u:g} and {last.u:g}. (b) What each trapezoid "
        "adds to -f+, read off first-order descending curves of the model by (2.10). The sum "
        f"(2.11) is {data.output:.6f}, the output of the model that was driven there "
        f"{last.f:.6f}.",
        planes.trapezoids(data),
    )
    k = 2
    q = data.trapezoids[k - 1]
    yield Drawn(
        "2.18",
        "A trapezoid as the difference of two triangles",
        f"Q{k} of Figure 2.17. (2.7) with (2.9): half the difference of f_M,m for m{k} and for "
        f"m{k - 1}, ({q.readings[0]:.4f} - ({q.readings[1]:.4f})) / 2 = {q.difference:.5f}. The "
        f"density integrated over Q{k}, apart from the model: {q.integrated:.5f}, which differs "
        f"by {abs(q.difference / q.integrated - 1.0):.1e} of it, from the model's grid.",
        planes.triangles(q, k),
    )
    yield _fod(data)


def _fod(data: Geometry) -> Drawn:
    """Figure 2.19."""
    u, rising, falling = data.major
    alpha, beta = FOD
    first, second, integrated = data.corner
    figure, axes = new(3.8, 1)
    ax = axes[0, 0]
    line(ax, u, falling, "0.7", "descending branch", linewidth=0.9)
    line(ax, u, rising, BLUE, "ascending branch of the major loop", linewidth=1.3)
    line(ax, data.fod[0], data.fod[1], RED, "first-order descending curve", linewidth=1.3)
    for place, height, text in (
        (alpha, first, r"$f_{\alpha'}$"),
        (beta, second, r"$f_{\alpha'\beta'}$"),
    ):
        ax.plot([place, place], [-EXTENT, height], color="0.4", linewidth=0.8, linestyle=":")
        ax.plot(place, height, "o", color=BLACK, markersize=5)
        ax.annotate(text, (place, height), xytext=(9, -4), textcoords="offset points", fontsize=11)
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
        [
            r"$-\beta_0$",
            rf"$\beta' = {beta:g}$",
            "0",
            rf"$\alpha' = {alpha:g}$",
            r"$\alpha_0$",
        ],
    )
    return Drawn(
        "2.19",
        "Notation of first-order descending curves",
        f"From negative saturation up to alpha' = {alpha:g}, then down to beta' = {beta:g}: "
        f"f_alpha' = {first:.4f}, f_alpha'beta' = {second:.4f}. Half their difference (2.8), "
        f"{0.5 * (first - second):.5f}, is the weight of the triangle T(alpha', beta'); integrated "
        f"over the density it is {integrated:.5f}.",
        figure,
    )


PROCEDURE = Procedure(
    name="preisach-geometry",
    title="Geometry of the Preisach model",
    sections=("2.4.1",),
    channels=(),
    ids=(),
    figures=("2.12", "2.13", "2.14", "2.15", "2.16", "2.17", "2.18", "2.19"),
    diagrams=("2.11",),
    seconds=1.5,
    collect=collect,
    claims=claims,
    draw=draw,
)
