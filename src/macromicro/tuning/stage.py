"""Gains of a machine of one stage by search: on the machine as its sheets say, or on several."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from macromicro import place as places
from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.machines.machine import Machine
from macromicro.machines.sequence import Plan
from macromicro.machines.tree import gains_set
from macromicro.machines.trial import Trial, trials
from macromicro.place import LENGTH, Place
from macromicro.robustness import stage as machines
from macromicro.schema.keys import nearest
from macromicro.schema.par import entries, replaced, value_at
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
    "pi": ("controller.kp", "controller.ki", "controller.kaw"),
}
WIDE = 4.0  # a gain is searched from a fourth of its value to four times as much
FAILED = 1e6


class Objective(NamedTuple):
    """What is minimised.

    Attributes
    ----------
    name : str
        As the option names it.
    meaning : str
        For people.
    unit : str
        Of its value.
    value : Callable[[Trial, float], float]
        Of a run, and the tolerance, in um or mdeg.
    """

    name: str
    meaning: str
    unit: str
    value: Callable[[Trial, float], float]


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
    """How much is searched, and on what.

    Attributes
    ----------
    evaluations : int
        At most so many designs.
    seed : int
        Of search, draw and noise.
    others : int
        Machines that differ from the sheets to search on beside the nominal one; the worst counts.
    fresh : int
        Further ones to judge by.
    workers : int
        Threads.
    named : Sequence[Any]
        Machines to search on as well, as settings; their gains do not count.
    allowed : Callable[[Any], bool]
        Whether a design may be taken, from the nominal machine's settings with its gains.
    """

    evaluations: int = 300
    seed: int = 0
    others: int = 0
    fresh: int = 0
    workers: int = 1
    named: Sequence[Any] = ()
    allowed: Callable[[Any], bool] = lambda settings: True


class Tuning(NamedTuple):
    """What was found.

    Attributes
    ----------
    machine : Machine
        The machine.
    start, tuned : Any
        Settings before and after.
    plan : Plan
        The moves that it was judged by.
    objective : Objective
        What was minimised.
    before, after : list[Trial]
        On the machines that were searched on, the nominal one first.
    costs : tuple[float, float]
        Of both.
    evaluations : int
        Designs that were tried.
    fresh : tuple[list[Trial], list[Trial]]
        Before and after on fresh machines; empty without any.
    seed : int
        Of the search.
    """

    machine: Machine
    start: Any
    tuned: Any
    plan: Plan
    objective: Objective
    before: list[Trial]
    after: list[Trial]
    costs: tuple[float, float]
    evaluations: int
    fresh: tuple[list[Trial], list[Trial]]
    seed: int


def named(name: str, place: Place = LENGTH) -> Objective:
    """The objective of a name.

    Parameters
    ----------
    name : str
        As the option names it.
    place : Place, optional
        What the places of the machine are counted in.

    Returns
    -------
    Objective
        What is minimised.

    Raises
    ------
    InputError
        There is none.
    """
    for each in OBJECTIVES:
        if each.name == name:
            return each._replace(unit=place.named(each.unit))
    raise InputError("--objective", name, nearest(name, [o.name for o in OBJECTIVES]))


def knobs(machine: Machine, settings: Any) -> tuple[str, ...]:
    """The gains that are searched.

    Parameters
    ----------
    machine : Machine
        The machine.
    settings : Any
        Its settings.

    Returns
    -------
    tuple[str, ...]
        Paths: those of `KNOBS`, or of another law every gain above zero.

    Raises
    ------
    InputError
        The law has none.
    """
    if machine.law.name in KNOBS:
        return KNOBS[machine.law.name]
    which = gains_set(settings)
    found = tuple(
        e.path
        for e in entries(value_at(settings, which), f"{which}.")
        if isinstance(e.value, float) and e.value > 0.0
    )
    if not found:
        raise InputError(which, machine.law.name, "a law with a gain above zero to search")
    return found


def cost(objective: Objective, found: Trial, settings: Any) -> float:
    """What a run costs.

    Parameters
    ----------
    objective : Objective
        What is minimised.
    found : Trial
        The run.
    settings : Any
        Whose tolerance and limit scale the penalties.

    Returns
    -------
    float
        In the objective's unit; `FAILED` and more for a run that a fault stopped or whose moves
        did not all arrive.
    """
    if found.fault != 0.0 or found.missed > 0.0:
        return FAILED * (1.0 + found.missed)
    tolerance = settings.arrival.tolerance * places.of(settings).fines
    over = found.overshoot / tolerance
    rough = 100.0 * found.rough / settings.guard.effort
    return float(objective.value(found, tolerance) * (1.0 + OVERSHOOT * over + ROUGH * rough))


def search(
    machine: Machine,
    settings: Any,
    plan: Plan,
    objective: Objective,
    budget: Budget,
    progress: Callable[[int, float], None] = lambda done, best: None,
) -> Tuning:
    """Look for better gains.

    Parameters
    ----------
    machine : Machine
        The machine.
    settings : Any
        Its settings, whose gains are tried, too.
    plan : Plan
        The moves to judge by.
    objective : Objective
        What is minimised.
    budget : Budget
        How much is searched, and on what.
    progress : Callable[[int, float], None], optional
        Hears designs tried and the least cost.

    Returns
    -------
    Tuning
        What was found; the start itself where nothing was better.
    """
    evaluations, seed, others, fresh, workers, named, allowed = budget
    rows = machines.uncertain(machine, settings) if others or fresh else ()
    drawn = machines.machines(settings, rows, others, seed)[1] if others else []
    bodies = [settings, *drawn, *named]
    searched = knobs(machine, settings)
    start = np.array([value_at(settings, path) for path in searched])

    def gains(design: Array) -> Array:
        return start * WIDE ** (2.0 * design - 1.0)

    def on(design: Array, tree: Any) -> Any:
        for path, value in zip(searched, gains(design).tolist(), strict=True):
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

    middle = np.full(len(searched), 0.5)
    found = minimise(costs, middle, evaluations, seed, progress=progress)
    before, after = tried(middle, bodies), tried(found.design, bodies)
    paid = worst(before), worst(after)
    design = found.design if paid[1] < paid[0] else middle
    if design is middle:
        after, paid = before, (paid[0], paid[0])
    judged: tuple[list[Trial], list[Trial]] = ([], [])
    if fresh:
        new_ones = machines.machines(settings, rows, fresh, seed + 1)[1]
        judged = tried(middle, new_ones), tried(design, new_ones)
    tuned = on(design, settings)
    for path in searched:  # a gain claims no more than four digits
        tuned = replaced(tuned, path, float(f"{value_at(tuned, path):.4g}"))
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
