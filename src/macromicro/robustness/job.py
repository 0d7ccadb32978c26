"""A programme on the whole bench of the two-stage machine, judged by its metrics."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from macromicro import batch, simulate
from macromicro.arrays import Array
from macromicro.batch import SEED, Job, Variants
from macromicro.batch.bench_job import BenchJob
from macromicro.batch.scratch import Scratch
from macromicro.batch.whole_bench import ProgrammeJob
from macromicro.machines.compositions import UNNAMED
from macromicro.programme import Programme
from macromicro.robustness._metrics import COLUMNS, MAIN, METRICS, REQUIRED, measure
from macromicro.robustness.study import Subject
from macromicro.schema import config
from macromicro.settings import Settings
from macromicro.simulate import Outcome
from macromicro.uncertainty.machines import columns
from macromicro.uncertainty.table import UNCERTAIN, Uncertain


class RobustJob(BenchJob):
    """The same runs as `macromicro run`, bit for bit, on the batch engine.

    A bench with another Hall sensor is calibrated first, as in `macromicro run`.
    """

    name = "robust"
    metrics = METRICS
    columns = COLUMNS

    def __init__(self, programme: str, fan: bool = False, settings: Settings | None = None) -> None:
        super().__init__(settings, fan=fan)
        self._planned = ProgrammeJob(programme, settings=settings)

    def programme(self, settings: Settings) -> Programme:
        return self._planned.programme(settings)

    def compile(self) -> None:
        """Compile the bench, or load it from the cache."""
        settings = self.base()
        simulate.compile_bench(settings, self.programme(settings))

    def measure(self, place: Scratch, settings: Settings, outcome: Outcome) -> list[float]:
        found = measure(
            place.recording(), self.programme(settings), settings, int(outcome.watch.fault)
        )
        return [float(v) for v in found]


def subject(job: Job, workers: int, uncertain: Sequence[Uncertain] = UNCERTAIN) -> Subject:
    """The two-stage machine, run by a job of the batch engine in threads."""

    def evaluate(trees: Sequence[Any], seeds: Sequence[int], done: Callable[[int], bool]) -> Array:
        rows: list[Array] = []
        for _, piece in batch.run(job, variants(uncertain, trees, seeds), workers):
            rows.extend(piece)
            if done(len(rows)):
                break
        return np.array(rows)

    def as_toml(tree: Any) -> str:
        return config.changed_toml(tree, Settings())

    return Subject(
        UNNAMED, job.metrics, MAIN, evaluate, tuple(uncertain), REQUIRED, Settings(), as_toml
    )


def variants(
    uncertain: Sequence[Uncertain], trees: Sequence[Settings], seeds: Sequence[int]
) -> Variants:
    paths, values = columns(uncertain, trees)
    return Variants((*paths, SEED), np.column_stack((values, np.array(seeds, dtype=float))))
