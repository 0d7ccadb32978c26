"""Gains of a machine of several axes: each by itself, then all together, for the path.

The distance from the path is the difference of the axes' errors, so equal lag of both axes stays
on a straight line. So both position gains at the lower of the two are tried as well.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from macromicro import place as places
from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.machines import planning as single
from macromicro.machines.composite import Composite, names
from macromicro.machines.planning import Schedule
from macromicro.machines.trial import trials
from macromicro.schema.par import changed, value_at
from macromicro.tuning import stage
from macromicro.tuning.evolution import minimise
from macromicro.tuning.stage import FAILED, ROUGH, WIDE, Budget, Objective

SHEETS, ALONE, MATCHED, PAIR = "sheets", "each alone", "matched", "pair"
POSITION = "controller.position"


class Version(NamedTuple):
    name: str  # one of `SHEETS`, `ALONE`, `MATCHED` and `PAIR`
    settings: Any  # of the machine
    found: Any  # how they did
    cost: float  # um; of the contour, with penalties


class Tuning(NamedTuple):
    machine: Composite
    plan: Schedule  # what it was judged by
    objective: Objective  # of each axis alone
    versions: tuple[Version, ...]  # in the order in which they were found
    knobs: tuple[str, ...]  # gains that were searched
    evaluations: int  # designs that were tried, of both axes and the pair
    seed: int  # of the search

    @property
    def best(self) -> Version:
        return min(self.versions, key=lambda v: v.cost)

    @property
    def better(self) -> bool:
        return self.best.name != SHEETS


def cost(machine: Composite, found: Any, settings: Any) -> float:
    """RMS contour, or where there is no path the largest error in tolerances, with penalties."""
    if found.fault != 0.0 or found.missed > 0.0:
        return float(FAILED * (1.0 + found.missed))
    stages = list(zip(names(machine), machine.trees(settings), strict=True))
    rough = [100.0 * getattr(found, f"rough_{name}") / own.guard.effort for name, own in stages]
    penalty = 1.0 + ROUGH * float(np.mean(rough))
    if machine.has_plane:
        return float(found.rms_contour * penalty)
    errors = [
        getattr(found, f"peak_error_{name}") / (own.arrival.tolerance * places.of(own).fines)
        for name, own in stages
    ]
    return float(max(errors) * penalty)


def fewest(machine: Composite) -> int:
    """Fewest designs of a search."""
    return (len(machine.stages) + 1) * stage.LEAST


def knobs(machine: Composite, settings: Any) -> tuple[str, ...]:
    return tuple(
        f"{name}.{path}"
        for (name, own), tree in zip(machine.stages, machine.trees(settings), strict=True)
        for path in stage.knobs(own, tree)
    )


def matched(machine: Composite, settings: Any) -> Any:
    """All axes with the lowest of their position gains, of a machine with a plane."""
    trees = machine.trees(settings)
    if not machine.has_plane or any(own.law != own._field_defaults["law"] for own in trees):
        return settings
    lower = min(value_at(own, POSITION) for own in trees)
    return changed(settings, {f"{name}.{POSITION}": lower for name in names(machine)})


def search(
    machine: Composite,
    settings: Any,
    plan: Schedule,
    objective: Objective,
    budget: Budget,
    progress: Callable[[int, float], None] = lambda done, best: None,
) -> Tuning:
    """Search an equal share of the designs for each axis on its usual moves, and for all."""
    least = fewest(machine)
    if budget.evaluations < least:
        raise InputError("--evaluations", budget.evaluations, f"{least} or more")
    share, spent, alone = budget.evaluations // (len(machine.stages) + 1), 0, settings
    for (name, own), tree in zip(machine.stages, machine.trees(settings), strict=True):
        moves = single.plan(single.usual(tree), tree)

        def tell(done: int, best: float, before: int = spent) -> None:
            progress(before + done, best)

        one = Budget(share, budget.seed, 0, 0, budget.workers)
        found = stage.search(own, tree, moves, objective, one, tell)
        alone, spent = alone._replace(**{name: found.tuned}), spent + found.evaluations
    searched = knobs(machine, settings)

    def tried(trees: Sequence[Any]) -> list[Any]:
        return trials(machine, trees, plan, [budget.seed] * len(trees), budget.workers)

    known = [(SHEETS, settings), (ALONE, alone), (MATCHED, matched(machine, alone))]
    results = tried([tree for _, tree in known])
    versions = [
        Version(name, tree, t, cost(machine, t, settings))
        for (name, tree), t in zip(known, results, strict=True)
    ]
    begin = min(versions, key=lambda v: v.cost).settings
    start = np.array([value_at(begin, path) for path in searched])

    def on(design: Array) -> Any:
        gains = [float(f"{g:.{stage.DIGITS}g}") for g in start * WIDE ** (2.0 * design - 1.0)]
        return changed(begin, dict(zip(searched, gains, strict=True)))

    def costs(designs: Array) -> Array:
        trees = [on(design) for design in designs]
        good = [
            k for k, t in enumerate(trees) if not any(own.together() for own in machine.trees(t))
        ]
        found = np.full(len(trees), 2.0 * FAILED)
        found[good] = [cost(machine, t, settings) for t in tried([trees[k] for k in good])]
        return found

    before = spent
    pair = minimise(
        costs,
        np.full(len(searched), 0.5),
        share,
        budget.seed,
        progress=lambda done, best: progress(before + done, best),
    )
    last = on(pair.design)
    found_last = tried([last])[0]
    versions.append(Version(PAIR, last, found_last, cost(machine, found_last, settings)))
    return Tuning(
        machine,
        plan,
        objective,
        tuple(versions),
        searched,
        spent + pair.evaluations,
        budget.seed,
    )
