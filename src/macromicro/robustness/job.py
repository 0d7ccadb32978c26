"""A programme on the whole bench, judged by this study's metrics."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from macromicro import simulate
from macromicro.batch import SEED, Variants
from macromicro.batch.bench_job import BenchJob
from macromicro.batch.scratch import Scratch
from macromicro.batch.whole_bench import ProgrammeJob
from macromicro.programme import Programme
from macromicro.robustness._metrics import COLUMNS, METRICS, measure
from macromicro.settings import Settings
from macromicro.simulate import Outcome
from macromicro.uncertainty.machines import columns
from macromicro.uncertainty.table import Uncertain


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


def variants(
    uncertain: Sequence[Uncertain], trees: Sequence[Settings], seeds: Sequence[int]
) -> Variants:
    paths, values = columns(uncertain, trees)
    return Variants((*paths, SEED), np.column_stack((values, np.array(seeds, dtype=float))))
