"""A search for gains: on the machine itself or on several, judged before and after."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.tuning.evolution import minimise
from macromicro.tuning.subject import FAILED, Figures, Objective, Subject
from macromicro.uncertainty import machines

BEFORE, ALONE, AFTER = "before", "each alone", "after"
FRESH = 1  # number of the random stream that a search never draws from
LEAST = 10  # designs for each search of a machine with parts

Progress = Callable[[int, float], None]


class Budget(NamedTuple):
    """The extent of a search, and its machines."""

    evaluations: int = 300  # designs to try at most
    seed: int = 0  # of search, draws and noise
    machines: int = 1  # to search on: the nominal one and drawn ones; the worst counts
    fresh: int = 0  # further ones to judge by
    workers: int = 1  # threads
    named: Sequence[Any] = ()  # machines to search on as well, as settings


class Version(NamedTuple):
    name: str
    settings: Any
    runs: list[Figures]  # on each machine that was searched on, the nominal one first
    cost: float  # of the worst of them


class Fresh(NamedTuple):
    """Machines that the search has not seen, under the first gains and the best."""

    amounts: Array  # what was drawn
    runs: tuple[list[Figures], list[Figures]]
    costs: tuple[float, float]  # of the worst
    cheaper: int  # number of machines on which the best gains cost less


class Tuning(NamedTuple):
    subject: Subject
    objective: Objective
    weights: Mapping[str, float]  # of penalties, where they are not the usual ones
    budget: Budget
    amounts: Array  # drawn machines of the search
    versions: tuple[Version, ...]  # in the order in which they were found
    evaluations: int  # designs that were tried
    history: tuple[float, ...]  # the least cost after each generation
    rejected: int  # cheaper designs that were passed over
    fresh: Fresh | None

    @property
    def first(self) -> Version:
        return self.versions[0]

    @property
    def best(self) -> Version:
        """The least cost; the earlier one of two that are equal."""
        return min(self.versions, key=lambda version: version.cost)

    @property
    def verdict(self) -> tuple[float, float]:
        """Costs before and after: of fresh machines where there are any."""
        return (self.first.cost, self.best.cost) if self.fresh is None else self.fresh.costs

    @property
    def better(self) -> bool:
        before, after = self.verdict
        return after < before


class _Judge:
    """Runs and costs of settings on a set of machines."""

    def __init__(
        self,
        subject: Subject,
        objective: Objective,
        weights: Mapping[str, float],
        others: Sequence[Any],
        budget: Budget,
        *,
        nominal: bool = True,
    ) -> None:
        self.subject, self.objective, self.weights = subject, objective, weights
        self.others, self.workers, self.nominal = others, budget.workers, nominal
        self.seeds = [budget.seed + k for k in range(len(others) + nominal)]
        (self.first,) = self.runs([subject.start])

    def runs(self, trees: Sequence[Any]) -> list[list[Figures]]:
        """Figures of each of the settings on each machine."""
        each, subject = len(self.seeds), self.subject
        bodies = [
            body
            for tree in trees
            for body in (
                *([tree] if self.nominal else []),
                *(subject.under(tree, o) for o in self.others),
            )
        ]
        found = subject.runs(bodies, self.seeds * len(trees), self.workers)
        return [found[k : k + each] for k in range(0, len(found), each)]

    def costs(self, found: Sequence[Figures]) -> list[float]:
        return [
            self.objective.cost(run, first, self.weights)
            for run, first in zip(found, self.first, strict=True)
        ]

    def version(self, name: str, settings: Any) -> Version:
        (found,) = self.runs([settings])
        return Version(name, settings, found, max(self.costs(found)))


def search(
    subject: Subject,
    name: str,
    weights: Mapping[str, float],
    budget: Budget,
    progress: Progress = lambda done, best: None,
) -> Tuning:
    """Search for gains that cost less; `name` is that of the objective.

    A machine of several stages has each of them searched alone on an equal share of the designs,
    then all of them together from the best version so far.
    """
    subject.prepare()
    objective = subject.objective(name)
    amounts, drawn = draw(subject, budget.machines - 1, budget.seed)
    judge = _Judge(subject, objective, weights, [*drawn, *budget.named], budget)
    versions = [Version(BEFORE, subject.start, judge.first, max(judge.costs(judge.first)))]
    share, spent = budget.evaluations // (len(subject.parts) + 1), 0
    alone = subject.start
    for part, one in subject.parts:
        own = budget._replace(evaluations=share, fresh=0)
        found = search(one, name, weights, own, _after(progress, spent))
        alone = alone._replace(**{part: found.best.settings})
        spent += found.evaluations
    if subject.parts:
        further = [(ALONE, alone), *subject.further(alone)]
        versions += [judge.version(each, settings) for each, settings in further]
    begin = min(versions, key=lambda version: version.cost)
    last, counts = _evolve(judge, begin, share, budget.seed, _after(progress, spent))
    versions.append(last)
    found_last = Tuning(
        subject, objective, weights, budget, amounts, tuple(versions), spent + counts.evaluations,
        counts.history, counts.rejected, None,
    )  # fmt: skip
    if not budget.fresh:
        return found_last
    return found_last._replace(fresh=_try_fresh(found_last))


def _after(progress: Progress, spent: int) -> Progress:
    return lambda done, best: progress(spent + done, best)


def draw(subject: Subject, count: int, seed: int | tuple[int, int]) -> tuple[Array, list[Any]]:
    """Machines from the table of uncertain parameters: what was drawn, and their settings."""
    if count < 1:
        return np.empty((0, 0)), []
    rows = subject.uncertain
    amounts = machines.draw(subject.start, rows, count, seed).amounts
    return amounts, [machines.settings_at(subject.start, rows, each) for each in amounts]


class _Counts(NamedTuple):
    evaluations: int
    history: tuple[float, ...]
    rejected: int


def _evolve(
    judge: _Judge, begin: Version, evaluations: int, seed: int, progress: Progress
) -> tuple[Version, _Counts]:
    """The best gains about a version, or those of the version itself."""
    subject = judge.subject
    knobs = subject.knobs(begin.settings)
    start = np.array([knob.share for knob in knobs])

    def settings(design: Array) -> Any:
        if (design == start).all():
            return begin.settings  # to its last digit
        values = [knob.at(share) for knob, share in zip(knobs, design, strict=True)]
        return subject.applied(begin.settings, values)

    def costs(designs: Array) -> Array:
        trees = [settings(design) for design in designs]
        good = [k for k, tree in enumerate(trees) if subject.allowed(tree)]
        found = np.full(len(trees), 2.0 * FAILED)
        runs = judge.runs([trees[k] for k in good])
        found[good] = [max(judge.costs(each)) for each in runs]
        return found

    found = minimise(costs, start, evaluations, seed, progress)
    rejected, last = 0, begin._replace(name=AFTER)
    for design, cost in zip(found.ranked, found.costs, strict=True):
        if not cost < begin.cost:
            break
        tree = settings(design)
        if subject.accepted(tree):
            last = judge.version(AFTER, tree)
            break
        rejected += 1
    return last, _Counts(found.evaluations, found.history, rejected)


def _try_fresh(found: Tuning) -> Fresh:
    """The first gains and the best on machines that the search has not seen."""
    budget = found.budget
    amounts, drawn = draw(found.subject, budget.fresh, (budget.seed, FRESH))
    judge = _Judge(found.subject, found.objective, found.weights, drawn, budget, nominal=False)
    (best,) = judge.runs([found.best.settings])
    before, after = judge.costs(judge.first), judge.costs(best)
    cheaper = sum(a < b for a, b in zip(after, before, strict=True))
    return Fresh(amounts, (judge.first, best), (max(before), max(after)), cheaper)
