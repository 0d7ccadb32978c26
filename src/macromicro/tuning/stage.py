"""Gains of a machine of one stage by search, on the machine of its sheets or on several."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from macromicro import place as places
from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.machines.machine import Machine
from macromicro.machines.sequence import Plan
from macromicro.machines.tree import gains_set
from macromicro.machines.trial import Trial, trials
from macromicro.place import LENGTH, Place
from macromicro.robustness import stage as machines
from macromicro.schema.keys import nearest
from macromicro.schema.par import changed, entries, replaced, value_at
from macromicro.tuning.evolution import minimise

# Gains that are searched, by law.
KNOBS = {
    "cascade": (
        "controller.position",
        "controller.velocity",
        "controller.integral",
        "controller.observer",
    ),
    "integral": ("controller.integral", "controller.drift", "controller.ahead_velocity"),
    "pi": ("controller.kp", "controller.ki", "controller.ahead_velocity"),
}
WIDE = 4.0  # a gain is searched from a fourth of its value to four times as much
FAILED = 1e6
DIGITS = 4  # of a gain, as it is tried, shown and written
LEAST = 10  # designs of a search


class Objective(NamedTuple):
    name: str  # as the option names it
    meaning: str  # for people
    unit: str  # of its value
    value: Callable[[Trial, float], float]  # of a run, and the tolerance, in um or mdeg


OBJECTIVES = (
    Objective(
        "settling",
        "mean time from the end of a profile to the arrival, and 1 ms for each tolerance of rms "
        "error on the way",
        "s",
        lambda t, tolerance: t.mean_settling + 1e-3 * t.rms_error / tolerance,
    ),
    Objective(
        "error", "rms distance from the set point on the way", "um", lambda t, _: t.rms_error
    ),
    Objective("rest", "largest true error at rest", "um", lambda t, _: t.true_error),
)
# Beside any objective: a share of it for each tolerance of overshoot, and for each percent of the
# limit that the effort changes by, rms, from period to period.
OVERSHOOT, ROUGH = 0.5, 0.2


class Budget(NamedTuple):
    """The extent of a search, and its machines."""

    evaluations: int = 300  # at most so many designs
    seed: int = 0  # of search, draw and noise
    # machines that differ from the sheets to search on beside the nominal one; the worst counts
    others: int = 0
    fresh: int = 0  # further ones to judge by
    workers: int = 1  # threads
    # machines to search on as well, as settings; their gains do not count
    named: Sequence[Any] = ()
    # whether a design may be taken, from the nominal machine's settings with its gains
    allowed: Callable[[Any], bool] = lambda settings: True


class Tuning(NamedTuple):
    machine: Machine
    # start, tuned: settings before and after
    start: Any
    tuned: Any
    plan: Plan  # the moves that it was judged by
    objective: Objective  # what was minimised
    # before, after: on the machines that were searched on, the nominal one first
    before: list[Trial]
    after: list[Trial]
    costs: tuple[float, float]  # of both: the objective with its penalties, of the worst machine
    evaluations: int  # designs that were tried
    fresh: tuple[list[Trial], list[Trial]]  # before and after on fresh machines; empty without any
    seed: int  # of the search

    @property
    def better(self) -> bool:
        return self.costs[1] < self.costs[0]


def named(name: str, place: Place = LENGTH) -> Objective:
    for each in OBJECTIVES:
        if each.name == name:
            return each._replace(unit=place.named(each.unit))
    raise InputError("--objective", name, nearest(name, [o.name for o in OBJECTIVES]))


def knobs(machine: Machine, settings: Any) -> tuple[str, ...]:
    if machine.law.name in KNOBS:
        return KNOBS[machine.law.name]
    which = gains_set(settings)
    found = tuple(
        e.path
        for e in entries(value_at(settings, which), f"{which}.")
        if isinstance(e.value, float) and e.value > 0.0
    )
    if not found:
        raise ProblemError(which, f"{machine.law.name} has no gain above zero to search")
    return found


def cost(objective: Objective, found: Trial, settings: Any) -> float:
    if found.fault != 0.0 or found.missed > 0.0:
        return FAILED * (1.0 + found.missed)
    return sum(value for _, value in terms(objective, found, settings))


def terms(objective: Objective, found: Trial, settings: Any) -> list[tuple[str, float]]:
    tolerance = settings.arrival.tolerance * places.of(settings).fines
    value = float(objective.value(found, tolerance))
    over = found.overshoot / tolerance
    rough = 100.0 * found.rough / settings.guard.effort
    return [
        (objective.name, value),
        ("penalty for overshoot", value * OVERSHOOT * over),
        ("penalty for a rough effort", value * ROUGH * rough),
    ]


def search(
    machine: Machine,
    settings: Any,
    plan: Plan,
    objective: Objective,
    budget: Budget,
    progress: Callable[[int, float], None] = lambda done, best: None,
) -> Tuning:
    evaluations, seed, others, fresh, workers, named, allowed = budget
    rows = machines.uncertain(machine, settings) if others or fresh else ()
    drawn = machines.machines(machine, settings, rows, others, seed)[1] if others else []
    bodies = [settings, *drawn, *named]
    searched = knobs(machine, settings)
    start = np.array([value_at(settings, path) for path in searched])
    middle = np.full(len(searched), 0.5)  # the start itself, to its last digit

    def gains(design: Array) -> Array:
        return start * WIDE ** (2.0 * design - 1.0)

    def on(design: Array, tree: Any) -> Any:
        if (design == middle).all():
            return tree
        rounded = [float(f"{value:.{DIGITS}g}") for value in gains(design)]
        values = dict(zip(searched, rounded, strict=True))
        if tree is settings:  # what follows from the gains follows, as in the file that is written
            return changed(tree, values)
        for path, value in values.items():
            tree = replaced(tree, path, value)
        return tree

    def tried(design: Array, trees: Sequence[Any]) -> list[Trial]:
        made = [on(design, tree) for tree in trees]
        seeds = [seed + k for k in range(len(made))]
        return trials(machine, made, plan, seeds, workers)

    def worst(found: Sequence[Trial]) -> float:
        each = [cost(objective, t, settings) for t in found]
        return FAILED if any(map(math.isnan, each)) else max(each)

    def costs(designs: Array) -> Array:
        return np.array(
            [2.0 * FAILED if refused(on(d, settings)) else worst(tried(d, bodies)) for d in designs]
        )

    def refused(tree: Any) -> bool:
        return bool(tree.together()) or not allowed(tree)

    found = minimise(costs, middle, evaluations, seed, progress=progress)
    before, after = tried(middle, bodies), tried(found.design, bodies)
    paid = worst(before), worst(after)
    design = found.design if paid[1] < paid[0] else middle
    if design is middle:
        after, paid = before, (paid[0], paid[0])
    judged: tuple[list[Trial], list[Trial]] = ([], [])
    if fresh:
        new_ones = machines.machines(machine, settings, rows, fresh, seed + 1)[1]
        judged = tried(middle, new_ones), tried(design, new_ones)
    tuned = on(design, settings)
    return Tuning(
        machine,
        settings,
        tuned,
        plan,
        objective,
        before,
        after,
        paid,
        found.evaluations,
        judged,
        seed,
    )
