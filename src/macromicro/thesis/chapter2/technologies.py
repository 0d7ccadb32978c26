"""Micro-positioning technologies and their costs: Tables 2.1, 6.1 and 6.2."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from macromicro.design import costs
from macromicro.design.costs import Technology
from macromicro.drawing.exhibit import Drawn, Grid
from macromicro.drawing.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, finish, single
from macromicro.thesis.claims import Claim, state
from macromicro.thesis.contents import caption
from macromicro.thesis.procedure import Lab

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# What "below 1 nm" is drawn down to; the table gives no lower end.
LOWEST = 0.1e-9


def measure() -> list[Claim]:
    own = costs.micro_stage()
    summed = own.cost[0]
    row = [summed, *(t.cost[0] for t in costs.TABLE_6_2)]
    against = costs.compare(own, costs.TABLE_6_2)
    survey = {t.name: t for t in costs.TABLE_2_1}
    apart = [
        f"{t.name}: {_span(survey[t.name].cost)} in Table 2.1, {_span(t.cost)} in Table 6.2"
        for t in costs.TABLE_6_2
        if survey[t.name].cost != t.cost
    ]
    return [
        state("D9", summed),
        state(
            "D10",
            row,
            cheapest=against[0].cheapest,
            dearest=against[-1].dearest,
            finer=min(1.0 / a.accuracy for a in against),
            apart="; ".join(apart),
        ),
    ]


class Words(NamedTuple):
    """A technology in words, as the tables print it; "-" for unknown."""

    name: str
    accuracy: str
    travel: str
    speed: str
    load: str
    cost: str


def words(t: Technology) -> Words:
    """The technology's name, accuracy [nm], range, speed, load and cost [USD]."""
    return Words(
        t.name, _accuracy(t.accuracy), t.travel or "-", t.speed or "-", t.load or "-", _span(t.cost)
    )


def table() -> list[Words]:
    """Table 2.1 with our stage first."""
    return [words(t) for t in (costs.micro_stage(), *costs.TABLE_2_1)]


def _span(cost: tuple[float, float]) -> str:
    low, high = cost
    return f"{low:g} USD" if low == high else f"{low:g}-{high:g} USD"


def _accuracy(accuracy: tuple[float, float]) -> str:
    best, worst = (1e9 * a for a in accuracy)
    if best == worst:
        return f"{worst:g} nm"
    return f"below {worst:g} nm" if best == 0.0 else f"{best:g}-{worst:g} nm"


def collect(lab: Lab) -> None:
    """Nothing: the tables are data of the design sheets."""


def claims(_: None) -> list[Claim]:
    return measure()


def technology_table(_: None) -> Drawn:
    return caption(
        "Table 2.1",
        Grid(
            ("technology", "accuracy", "range", "speed", "load", "cost"),
            [tuple(row) for row in table()],
        ),
    )


def parts(_: None) -> Drawn:
    parts: list[tuple[str, ...]] = [
        (name, f"{cost:g} USD") for name, cost in costs.MICRO_STAGE.items()
    ]
    return caption(
        "Table 6.1",
        Grid(("part", "cost"), [*parts, ("total", f"{costs.total(costs.MICRO_STAGE):g} USD")]),
    )


def cost_table(_: None) -> Drawn:
    own = costs.micro_stage()
    against = {c.name: c for c in costs.compare(own, costs.TABLE_6_2)}
    rows: list[tuple[str, ...]] = []
    for t in (own, *costs.TABLE_6_2):
        c = against.get(t.name)
        times, finer = ("", "") if c is None else (f"{c.cheapest:.1f}", f"{1.0 / c.accuracy:g}")
        rows.append((t.name, words(t).accuracy, words(t).cost, times, finer))
    return caption(
        "Table 6.2",
        Grid(
            ("technology", "accuracy", "cost", "times as expensive", "times finer, at least"), rows
        ),
    )


def cost_against_accuracy(_: None) -> Drawn:
    return caption("Table 6.2 (plot)", _plot(costs.micro_stage()))


def _plot(own: Technology) -> Figure:
    figure, ax = single(3.6)
    names = [own.name, *(t.name for t in costs.TABLE_2_1)]
    colours = dict(zip(names, (BLACK, BLUE, ORANGE, GREEN, PURPLE), strict=True))
    for table, marker, size in (((own, *costs.TABLE_2_1), "o", 5), (costs.TABLE_6_2, "x", 8)):
        for t in table:
            best, worst = (1e9 * max(a, LOWEST) for a in t.accuracy)
            middle = (best * worst) ** 0.5
            label = t.name if marker == "o" else ""
            style = {"color": colours[t.name], "linewidth": 1.6}
            cost = sum(t.cost) / 2.0
            ax.plot([best, worst], [cost, cost], **style)
            ax.plot([middle, middle], t.cost, **style)
            ax.plot(middle, cost, marker, markersize=size, color=style["color"], label=label)
    ax.set_xscale("log")
    ax.set_yscale("log")
    finish(ax, "", "accuracy [nm]", "cost [USD]", legend="lower left")
    ax.set_xlim(1e9 * LOWEST * 0.8, 3e9 * own.accuracy[1])
    ax.set_ylim(150.0, 15000.0)
    return figure
