"""The whole study: the nominal machine, the sample, one parameter at a time."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from macromicro import batch
from macromicro.arrays import Array
from macromicro.batch import Job
from macromicro.robustness.job import variants
from macromicro.robustness.requirements import Requirement
from macromicro.settings import Settings
from macromicro.uncertainty.machines import Sample, centre, draw, refusal, settings_at
from macromicro.uncertainty.table import UNCERTAIN, Uncertain


class Request(NamedTuple):
    settings: Settings  # the nominal machine
    requirements: tuple[Requirement, ...]  # what machines must do
    samples: int  # machines to draw (`uncertainty.machines.counted`)
    # of the sample and the noise; run i of the sample has the noise of `seed` + i, the nominal
    # machine and the runs of the tornado that of `seed`
    seed: int
    workers: int  # threads
    uncertain: tuple[Uncertain, ...] = UNCERTAIN  # rows of the table, by default all of them


class Study(NamedTuple):
    request: Request  # what was asked for
    sample: Sample  # the machines
    nominal: Array  # of the settings themselves
    rows: Array  # of the first m of the sample's machines
    # each parameter alone at its low and high end, the rest nominal; NaN where it was not run
    single: Array
    impossible: dict[str, str]  # ends at which no machine is, with the reason
    interrupted: bool  # whether something is missing


def run(
    request: Request,
    job: Job,
    progress: Callable[[int, int], None] = lambda done, total: None,
    stop: Callable[[], bool] = lambda: False,
) -> Study:
    base, uncertain = request.settings, request.uncertain
    sample = draw(base, uncertain, request.samples, request.seed)
    ends, impossible = _ends(request)
    machines = [settings_at(base, uncertain, amounts) for amounts in sample.amounts]
    trees = [base, *machines, *ends.values()]
    seeds = [request.seed + i for i in range(len(machines))]
    seeds = [request.seed, *seeds, *[request.seed] * len(ends)]
    done: list[Array] = []
    for _, piece in batch.run(job, variants(uncertain, trees, seeds), request.workers):
        done.extend(piece)
        progress(len(done), len(trees))
        if stop():
            break
    table = np.array(done).reshape(-1, len(job.metrics))
    nominal = table[0] if len(table) else np.full(len(job.metrics), math.nan)
    single = np.full((len(uncertain), 2, table.shape[1]), math.nan)
    for place, row in zip(ends, table[1 + request.samples :], strict=False):
        single[place] = row
    rows = table[1 : 1 + request.samples]
    complete = len(table) == len(trees)
    return Study(request, sample, nominal, rows, single, impossible, not complete)


def _ends(request: Request) -> tuple[dict[tuple[int, int], Settings], dict[str, str]]:
    """The settings with one parameter at an end, and the ends that are impossible."""
    found, impossible = {}, {}
    middle = centre(request.settings, request.uncertain)
    for k, each in enumerate(request.uncertain):
        for side, end in enumerate((each.low, each.high)):
            amounts = middle.copy()
            amounts[k] = end
            tree = settings_at(request.settings, request.uncertain, amounts)
            why = refusal(tree, request.uncertain)
            if why is None:
                found[k, side] = tree
            else:
                impossible[f"{each.name} {('low', 'high')[side]}"] = why
    return found, impossible
