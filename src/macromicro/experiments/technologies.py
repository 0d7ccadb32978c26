"""Costs of the micro-stage and of its rivals (Tables 2.1, 6.1, 6.2): claims D9 and D10."""

from __future__ import annotations

from typing import NamedTuple

from macromicro.design import costs
from macromicro.design.costs import Technology
from macromicro.experiments.claim import Claim, holds
from macromicro.experiments.statements import stated

COST = 255.0
COSTS = (255.0, 1500.0, 4000.0, 4000.0, 8000.0)


def claims() -> list[Claim]:
    """D9 and D10. The parts' and the rivals' prices are the thesis' tables; sums are ours."""
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
    finer = min(1.0 / a.accuracy for a in against)
    return [
        stated("D9", summed, holds(summed == COST)),
        stated(
            "D10",
            row,
            holds(row == list(COSTS)),
            "the other technologies' prices are the table's own, so they equal it by construction; "
            "only the first is a sum. The others cost "
            f"{against[0].cheapest:.1f} to {against[-1].dearest:.1f} times as much and are at "
            f"least {finer:.0f} times finer. "
            f"The tables disagree: {'; '.join(apart)}.",
        ),
    ]


class Words(NamedTuple):
    """A technology in words, as the tables print it; "-" where they are silent."""

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
