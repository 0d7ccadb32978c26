"""Gains of a machine of two axes: each axis by itself, then both for the path.

The distance from the path is the difference of the axes' errors, so equal lag of both axes stays
on a straight line. So both position gains at the lower of the two are tried as well.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.machines import planning as single
from macromicro.machines.joint.machine import Joint
from macromicro.machines.joint.planning import JointPlan
from macromicro.machines.joint.settings import AXES, of
from macromicro.machines.joint.trial import JointTrial, trials
from macromicro.schema.par import replaced, value_at
from macromicro.tuning import stage
from macromicro.tuning.evolution import minimise
from macromicro.tuning.stage import FAILED, ROUGH, WIDE, Budget, Objective

LEAST = 3 * stage.LEAST  # designs of a search
SHEETS, ALONE, MATCHED, PAIR = "sheets", "each alone", "matched", "pair"
POSITION = "controller.position"


class Version(NamedTuple):
    name: str  # one of `SHEETS`, `ALONE`, `MATCHED` and `PAIR`
    settings: Any  # of the machine
    found: JointTrial  # how they did
    cost: float  # um; of the contour, with penalties


class Tuning(NamedTuple):
    machine: Joint
    plan: JointPlan  # what it was judged by
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


def cost(found: JointTrial, settings: Any) -> float:
    if found.fault != 0.0 or found.missed > 0.0:
        return FAILED * (1.0 + found.missed)
    each = zip((found.rough_x, found.rough_y), of(settings), strict=True)
    rough = [100.0 * value / own.guard.effort for value, own in each]
    return float(found.rms_contour * (1.0 + ROUGH * float(np.mean(rough))))


def knobs(machine: Joint, settings: Any) -> tuple[str, ...]:
    return tuple(
        f"{name}.{path}"
        for name, own, tree in zip(AXES, machine.axes, of(settings), strict=True)
        for path in stage.knobs(own, tree)
    )


def matched(settings: Any) -> Any:
    """Both axes with the lower of their position gains."""
    if any(own.law != own._field_defaults["law"] for own in of(settings)):
        return settings
    lower = min(value_at(own, POSITION) for own in of(settings))
    for name in AXES:
        settings = replaced(settings, f"{name}.{POSITION}", lower)
    return settings


def search(
    machine: Joint,
    settings: Any,
    plan: JointPlan,
    objective: Objective,
    budget: Budget,
    progress: Callable[[int, float], None] = lambda done, best: None,
) -> Tuning:
    """Search a third of the designs for each axis on its usual moves, and a third for the pair."""
    if budget.evaluations < LEAST:
        raise InputError("--evaluations", budget.evaluations, f"{LEAST} or more")
    share, spent, alone = budget.evaluations // 3, 0, settings
    for name, own, tree in zip(AXES, machine.axes, of(settings), strict=True):
        moves = single.plan(single.usual(tree), tree)

        def tell(done: int, best: float, before: int = spent) -> None:
            progress(before + done, best)

        one = Budget(share, budget.seed, 0, 0, budget.workers)
        found = stage.search(own, tree, moves, objective, one, tell)
        alone, spent = alone._replace(**{name: found.tuned}), spent + found.evaluations
    searched = knobs(machine, settings)

    def tried(trees: Sequence[Any]) -> list[JointTrial]:
        return trials(machine, trees, plan, [budget.seed] * len(trees), budget.workers)

    known = [(SHEETS, settings), (ALONE, alone), (MATCHED, matched(alone))]
    results = tried([tree for _, tree in known])
    versions = [
        Version(name, tree, t, cost(t, settings))
        for (name, tree), t in zip(known, results, strict=True)
    ]
    begin = min(versions, key=lambda v: v.cost).settings
    start = np.array([value_at(begin, path) for path in searched])

    def on(design: Array) -> Any:
        tree = begin
        for path, value in zip(searched, start * WIDE ** (2.0 * design - 1.0), strict=True):
            tree = replaced(tree, path, float(f"{value:.{stage.DIGITS}g}"))
        return tree

    def costs(designs: Array) -> Array:
        trees = [on(design) for design in designs]
        good = [k for k, t in enumerate(trees) if not any(own.together() for own in of(t))]
        found = np.full(len(trees), 2.0 * FAILED)
        found[good] = [cost(t, settings) for t in tried([trees[k] for k in good])]
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
    versions.append(Version(PAIR, last, found_last, cost(found_last, settings)))
    return Tuning(
        machine,
        plan,
        objective,
        tuple(versions),
        searched,
        spent + pair.evaluations,
        budget.seed,
    )
