"""A programme on the whole bench, from parameters to metrics, for many variants."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from macromicro import loop, simulate
from macromicro.columns import COLUMNS
from macromicro.experiments import hall_calibration
from macromicro.kernel import compiled
from macromicro.loop import PERIOD
from macromicro.plant.bench import NOISES
from macromicro.programme import Programme
from macromicro.recording import Recording
from macromicro.robustness.metrics import measure
from macromicro.settings import Settings

POLL = 0.2  # how often an interruption is looked for [s]

Array = NDArray[np.float64]


class Task(NamedTuple):
    """One run: its settings and the seed of the sensors' noise."""

    settings: Settings
    seed: int


class Job(Protocol):
    """Whatever turns a task into a row of `metrics.METRICS`."""

    def __call__(self, task: Task) -> Array:
        """The metrics of one run."""


class ProgrammeJob(NamedTuple):
    """A programme under supervisor and guard, as `macromicro run` runs it, in memory."""

    programme: Programme
    fan: bool = False

    def __call__(self, task: Task) -> Array:
        """The metrics of one run: the same recording, bit for bit, as a run writes."""
        blocks: list[Array] = []
        outcome = simulate.simulate(
            task.settings,
            self.programme,
            _Blocks(blocks),
            seed=task.seed,
            fan=self.fan,
            table=hall_calibration.for_bench(task.settings),
        )
        rows = np.concatenate(blocks, axis=1)
        recording = Recording.from_arrays(COLUMNS, rows, PERIOD, {})
        return measure(recording, self.programme, task.settings, outcome.watch.fault)

    def compile(self, settings: Settings) -> None:
        """Compile the bench, or load it from the cache, before threads ask for it."""
        rolled = simulate.prepare(settings, self.programme, self.fan)
        nothing, block = np.empty((0, NOISES)), np.empty((loop.ROWS, 0))
        compiled(loop.rollout)(*rolled, nothing, block, PERIOD)


class _Blocks(NamedTuple):
    """A sink in memory."""

    blocks: list[Array]

    def append(self, block: Array) -> None:
        """Keep the block."""
        self.blocks.append(block)


def rows(
    job: Job, tasks: Sequence[Task], workers: int, stop: Callable[[], bool] = lambda: False
) -> Iterator[Array]:
    """The metrics of `tasks`, in order, computed by `workers` threads.

    The simulation holds no lock of the interpreter, so threads are as good as processes.
    When `stop` turns true no further task is begun; those at work are still given.
    """
    with ThreadPoolExecutor(workers) as pool:
        queue: list[Future[Array]] = []
        following = 0
        while following < len(tasks) or queue:
            if stop():
                following = len(tasks)
                queue = [f for f in queue if not f.cancel()]
            while following < len(tasks) and len(queue) < 2 * workers:
                queue.append(pool.submit(job, tasks[following]))
                following += 1
            if queue and wait(queue[:1], POLL, FIRST_COMPLETED).done:
                yield queue.pop(0).result()
