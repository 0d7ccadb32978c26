"""Positions of a calibration and of its verification (ISO 230-2), and the moves to them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.machines import composite, moves, planning
from macromicro.machines.composite import AnyMachine, Composite
from macromicro.machines.moves import Course, Move
from macromicro.machines.planning import Planned

RUNS = 5  # in both directions, as ISO 230-2 has it
MARGIN = 0.02  # of the travel at either end, for the approaches from outside
HOLD = 0.3  # s
REST = 0.1  # s; the last of the hold, in which the position is measured


class Visits(NamedTuple):
    """The positions in the order in which they are visited; one row a visit."""

    run: Array  # from 1 on; 0: an approach that is not measured
    direction: Array  # 1: from below, -1: from above
    target: Array  # m, one column a stage


def positions(tree: Any, count: int, random: np.random.Generator) -> Array:
    """Positions along the travel, evenly spaced but for a random part of the spacing."""
    low, high = span(tree)
    edges = np.linspace(low, high, count + 1)
    found = edges[:-1] + np.diff(edges) * random.uniform(0.1, 0.9, count)
    found[0], found[-1] = low, high
    return np.asarray(found)


def span(tree: Any) -> tuple[float, float]:
    """The calibrated part of the travel."""
    low, high = float(tree.travel.low), float(tree.travel.high)
    margin = MARGIN * (high - low)
    return low + margin, high - margin


def along(tree: Any, places: Array, runs: int) -> Visits:
    """Each run goes up through all positions, then down, past both ends of the travel between."""
    low, high = float(tree.travel.low), float(tree.travel.high)
    up = [(0, 1.0, low), *((1, 1.0, place) for place in places)]
    down = [(0, -1.0, high), *((1, -1.0, place) for place in places[::-1])]
    rows = [(run * own, way, place) for run in range(1, runs + 1) for own, way, place in up + down]
    run, way, target = np.array(rows).T
    return Visits(run, way, target[:, None])


def over(trees: Sequence[Any], places: Sequence[Array], runs: int) -> Visits:
    """Each run goes through a grid of two axes, along the first axis up and down on every line."""
    rows: list[tuple[float, float, float, float]] = []
    x, y = places
    low, high = (float(trees[0].travel.low), float(trees[0].travel.high))
    for run in range(1, runs + 1):
        for way, lines in ((1.0, y), (-1.0, y[::-1])):
            outside = float(trees[1].travel.low if way > 0.0 else trees[1].travel.high)
            rows.append((0, way, low, outside))
            for line in lines:
                rows += [(0, way, low, line), *((run, 1.0, place, line) for place in x)]
                rows += [(0, way, high, line), *((run, -1.0, place, line) for place in x[::-1])]
    run_, way_, first, second = np.array(rows).T
    return Visits(run_, way_, np.stack((first, second), axis=1))


def plan_visits(machine: AnyMachine, settings: Any, visits: Visits) -> Planned:
    """The moves to all positions, each from the one before, with a hold at each."""
    if isinstance(machine, Composite):
        legs = tuple(Move("line", tuple(row), HOLD) for row in visits.target.tolist())
        course = moves.in_order(machine, Course("calibration", legs, "the calibration"))
        return moves.plan(machine, settings, course)
    ends = [(target, settings.motion.velocity) for target in visits.target[:, 0].tolist()]
    return planning.stops(ends, HOLD, settings, "the calibration")


def names(machine: AnyMachine) -> tuple[str, ...]:
    """What columns of the stages begin with."""
    return tuple(f"{name}_" if name else "" for name in composite.names(machine))
