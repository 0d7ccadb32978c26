"""The whole study: the nominal machine, the sample, one parameter at a time."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from macromicro.arrays import Array
from macromicro.batch import Metric
from macromicro.batch.variants import FAULT
from macromicro.robustness.requirements import Requirement
from macromicro.robustness.statistics import Share, share
from macromicro.robustness.subject import Subject
from macromicro.runs.trials import trials
from macromicro.uncertainty.machines import Sample, centre, check_count, draw, refusal, settings_at


class Request(NamedTuple):
    settings: Any  # the nominal machine
    requirements: tuple[Requirement, ...]  # what machines must do
    samples: int  # machines to draw (`uncertainty.machines.counted`)
    # of the sample and the noise; run i of the sample has the noise of `seed` + i, the nominal
    # machine and the runs of the tornado that of `seed`
    seed: int
    single: bool = True  # whether each parameter is tried alone at its ends as well


class Study(NamedTuple):
    request: Request  # what was asked for
    subject: Subject
    sample: Sample  # the machines
    nominal: Array  # of the settings themselves
    rows: Array  # of the first m of the sample's machines
    # each parameter alone at its low and high end, the rest nominal; NaN where it was not run
    single: Array
    impossible: dict[str, str]  # ends at which no machine is, with the reason
    interrupted: bool  # whether something is missing

    @property
    def quantities(self) -> tuple[Metric, ...]:
        """The metrics but the code of the fault, which nothing is ranked or limited by."""
        return self.subject.metrics[:-1]

    def metric(self, name: str) -> Metric:
        return self.subject.metrics[self.at(name)]

    def at(self, name: str) -> int:
        """The column of a metric."""
        return [m.name for m in self.subject.metrics].index(name)

    def column(self, name: str) -> Array:
        """A metric of all machines."""
        found: Array = self.rows[:, self.at(name)]
        return found

    def met(self, *requirements: Requirement) -> NDArray[np.bool_]:
        """Which machines meet requirements; a metric that is not known is not met."""
        found = np.ones(len(self.rows), dtype=bool)
        for each in requirements:
            found &= self.column(each.metric.name) <= each.limit
        return found

    def arrived(self) -> Share:
        """Share of the machines on which all moves arrive and no fault stops the run."""
        names = [m.name for m in self.quantities if m == FAULT or m.name.endswith("missed")]
        good = np.all([self.column(name) == 0.0 for name in names], axis=0)
        return share(int(good.sum()), len(self.rows))

    def settings(self, machine: int) -> Any:
        """The settings of a machine of the sample."""
        tree = settings_at(
            self.request.settings, self.subject.uncertain, self.sample.amounts[machine]
        )
        return self.subject.kept(tree)


def run(
    request: Request,
    subject: Subject,
    progress: Callable[[int, int], bool] = lambda done, total: False,
) -> Study:
    """Run all machines; `progress` gets runs done and in all, and returns whether to end early."""
    check_count(request.samples)
    base, uncertain = request.settings, subject.uncertain
    sample = draw(base, uncertain, request.samples, request.seed)
    ends, impossible = _ends(request, subject) if request.single else ({}, {})
    machines = [subject.kept(settings_at(base, uncertain, amounts)) for amounts in sample.amounts]
    trees = [base, *machines, *ends.values()]
    seeds = [request.seed + i for i in range(len(machines))]
    seeds = [request.seed, *seeds, *[request.seed] * len(ends)]
    found = trials(
        subject.run, trees, seeds, subject.workers, lambda done: progress(done, len(trees))
    )
    table = np.array(found, dtype=float).reshape(-1, len(subject.metrics))
    nominal = table[0] if len(table) else np.full(len(subject.metrics), math.nan)
    single = np.full((len(uncertain), 2, table.shape[1]), math.nan)
    for place, row in zip(ends, table[1 + request.samples :], strict=False):
        single[place] = row
    rows = table[1 : 1 + request.samples]
    complete = len(table) == len(trees)
    return Study(request, subject, sample, nominal, rows, single, impossible, not complete)


def _ends(request: Request, subject: Subject) -> tuple[dict[tuple[int, int], Any], dict[str, str]]:
    """The settings with one parameter at an end, and the ends that are impossible."""
    found, impossible = {}, {}
    middle = centre(request.settings, subject.uncertain)
    for k, each in enumerate(subject.uncertain):
        for side, end in enumerate((each.low, each.high)):
            amounts = middle.copy()
            amounts[k] = end
            tree = subject.kept(settings_at(request.settings, subject.uncertain, amounts))
            why = refusal(tree, subject.uncertain)
            if why is None:
                found[k, side] = tree
            else:
                impossible[f"{each.name} {('low', 'high')[side]}"] = why
    return found, impossible
