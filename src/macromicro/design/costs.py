"""Costs of a stage compared with other technologies (Tables 2.1, 6.1 and 6.2), in USD."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from macromicro.design._checks import DATA, positive, sheet
from macromicro.errors import InputError, ProblemError


class Technology(NamedTuple):
    """A way to position, in the tables' words where no unit is given.

    Examples
    --------
    >>> from macromicro.design import Technology, compare, micro_stage
    >>> motor = Technology("stepper", accuracy=(1e-5, 5e-5), cost=(510.0, 1020.0))  # m, USD
    >>> round(compare(micro_stage(), [motor])[0].accuracy)  # times as coarse
    10
    """

    name: str  #: name of the technology
    #: from best to worst, m; equal where one figure is given, best 0 where only "below" is
    accuracy: tuple[float, float]
    cost: tuple[float, float]  #: from lowest to highest, USD; equal where one figure is given
    travel: str = ""  #: in words
    speed: str = ""  #: in words
    load: str = ""  #: in words


class Comparison(NamedTuple):
    """Another technology against ours: above 1 it costs more, or is coarser."""

    name: str  #: name of the technology
    cheapest: float  #: its lowest cost over ours
    dearest: float  #: its highest cost over ours
    accuracy: float  #: its worst over ours


def total(parts: Mapping[str, float]) -> float:
    """Sum of the parts' costs.

    Parameters
    ----------
    parts : Mapping[str, float]
        USD by name.

    Returns
    -------
    float
        USD.

    Raises
    ------
    ProblemError
        No parts.
    InputError
        A cost is not above 0.

    Examples
    --------
    >>> from macromicro.design import total
    >>> total({"wires": 12.0, "sensor": 3.5, "magnet": 2.0})  # USD
    17.5
    """
    if not parts:
        raise ProblemError("costs", "no parts", "Give one part or more.")
    return sum(positive(f"costs, {name}", cost, "USD") for name, cost in parts.items())


def compare(own: Technology, others: Sequence[Technology]) -> list[Comparison]:
    """Compare technologies with one; both ends of their costs over its largest.

    Parameters
    ----------
    own : Technology
        The reference.
    others : Sequence[Technology]
        Technologies to compare with it.

    Returns
    -------
    list[Comparison]
        One per `others`, in their order.

    Raises
    ------
    InputError
        Not a `Technology`; or a cost or an accuracy that is not above 0, or whose best exceeds
        its worst.

    Examples
    --------
    >>> from macromicro.design import Technology, compare, micro_stage
    >>> piezo = Technology("piezo stage", accuracy=(1e-9, 1e-8), cost=(2000.0, 10_000.0))
    >>> against = compare(micro_stage(), [piezo])[0]
    >>> round(against.cheapest, 1), round(against.accuracy, 4)
    (7.8, 0.002)
    """
    for each in (own, *others):
        _check(each)
    cost, accuracy = own.cost[1], own.accuracy[1]
    return [
        Comparison(o.name, o.cost[0] / cost, o.cost[1] / cost, o.accuracy[1] / accuracy)
        for o in others
    ]


def _check(t: Technology) -> None:
    sheet("technology", t, Technology)
    for word, unit, (low, high) in (("cost", "USD", t.cost), ("accuracy", "m", t.accuracy)):
        positive(f"{t.name}, {word}", high, unit)
        if not 0.0 <= low <= high:
            raise InputError(f"{t.name}, {word}", (low, high), f"best and worst, 0 {unit} or more")


def _technologies(table: str) -> tuple[Technology, ...]:
    pairs = ("accuracy", "cost")
    rows = [row | {name: tuple(row[name]) for name in pairs} for row in DATA[table]]
    return tuple(Technology(**row) for row in rows)


MICRO_STAGE: dict[str, float] = DATA["parts"]  # Table 6.1
TABLE_2_1 = _technologies("survey")
TABLE_6_2 = _technologies("compared")


def micro_stage(accuracy: float = 5e-6) -> Technology:
    """The SMA micro-stage: Table 6.1 summed.

    Parameters
    ----------
    accuracy : float, optional
        m; 5 um in Table 6.2.

    Returns
    -------
    Technology
        With its cost.

    Raises
    ------
    InputError
        `accuracy` is not above 0.

    Examples
    --------
    >>> from macromicro.design import micro_stage
    >>> round(micro_stage().cost[1])  # USD
    255
    """
    accuracy, cost = positive("SMA micro-stage, accuracy", accuracy, "m"), total(MICRO_STAGE)
    return Technology("SMA micro-stage", (accuracy, accuracy), (cost, cost), travel="4 mm")
