"""Gains of a machine of two axes: each axis by itself first, then both for the path that they make.

The distance from the path is the difference of the axes' errors, so two equal axes that follow
equally late stay on a straight line. That is tried, too: the position gain of both at the lower of
the two.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.machines import planning as single
from macromicro.machines.joint.machine import Joint
from macromicro.machines.joint.planning import JointPlan
from macromicro.machines.joint.settings import AXES, of
from macromicro.machines.joint.trial import JointTrial, trials
from macromicro.schema.par import replaced, value_at
from macromicro.tuning import stage
from macromicro.tuning.evolution import minimise
from macromicro.tuning.stage import FAILED, ROUGH, WIDE, Budget, Objective

SHEETS, ALONE, MATCHED, PAIR = "sheets", "each alone", "matched", "pair"
POSITION = "controller.position"


class Version(NamedTuple):
    """Gains that were tried on the pair.

    Attributes
    ----------
    name : str
        One of `SHEETS`, `ALONE`, `MATCHED` and `PAIR`.
    settings : Any
        Of the machine.
    found : JointTrial
        How they did.
    cost : float
        um; of the contour, with penalties.
    """

    name: str
    settings: Any
    found: JointTrial
    cost: float


class Tuning(NamedTuple):
    """What was found.

    Attributes
    ----------
    machine : Joint
        The machine.
    plan : JointPlan
        What it was judged by.
    objective : Objective
        Of each axis alone.
    versions : tuple[Version, ...]
        In the order in which they were found.
    knobs : tuple[str, ...]
        Gains that were searched.
    evaluations : int
        Designs that were tried, of both axes and the pair.
    seed : int
        Of the search.
    """

    machine: Joint
    plan: JointPlan
    objective: Objective
    versions: tuple[Version, ...]
    knobs: tuple[str, ...]
    evaluations: int
    seed: int

    @property
    def best(self) -> Version:
        """The version of least cost; of equals the first."""
        return min(self.versions, key=lambda v: v.cost)


def cost(found: JointTrial, settings: Any) -> float:
    """What a run of the pair costs.

    Parameters
    ----------
    found : JointTrial
        The run.
    settings : Any
        Whose limits scale the penalties.

    Returns
    -------
    float
        um: the rms distance from the path, and a share of it for each percent of the limit that an
        effort changes by from period to period; `FAILED` and more for a run that a fault stopped or
        whose moves did not all arrive.
    """
    if found.fault != 0.0 or found.missed > 0.0:
        return FAILED * (1.0 + found.missed)
    each = zip((found.rough_x, found.rough_y), of(settings), strict=True)
    rough = [100.0 * value / own.guard.effort for value, own in each]
    return float(found.rms_contour * (1.0 + ROUGH * float(np.mean(rough))))


def knobs(machine: Joint, settings: Any) -> tuple[str, ...]:
    """The gains of both axes that are searched.

    Parameters
    ----------
    machine : Joint
        The machine.
    settings : Any
        Its settings.

    Returns
    -------
    tuple[str, ...]
        Paths.
    """
    return tuple(
        f"{name}.{path}"
        for name, own, tree in zip(AXES, machine.axes, of(settings), strict=True)
        for path in stage.knobs(own, tree)
    )


def matched(settings: Any) -> Any:
    """Both axes with the lower one of their position gains.

    Parameters
    ----------
    settings : Any
        Of the machine.

    Returns
    -------
    Any
        A copy; the same where an axis has another law.
    """
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
    """Look for better gains: a third of the designs for each axis by itself, on its usual moves,
    and a third for the pair.

    Parameters
    ----------
    machine : Joint
        The machine.
    settings : Any
        Its settings.
    plan : JointPlan
        What the pair is judged by.
    objective : Objective
        Of each axis by itself.
    budget : Budget
        How much is searched; machines that differ from the sheets are not drawn.
    progress : Callable[[int, float], None], optional
        Hears designs tried and the least cost.

    Returns
    -------
    Tuning
        What was found.
    """
    share, spent, alone = max(budget.evaluations // 3, 10), 0, settings
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
            tree = replaced(tree, path, float(f"{value:.4g}"))  # claims no more than four digits
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
