"""Parts of a sweep computed by processes of this computer or by the workers of a cluster.

Workers get parameters and return metrics; they write no files.
"""

from __future__ import annotations

import importlib
from collections import Counter
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, wait
from concurrent.futures.process import BrokenProcessPool
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import MacromicroError
from macromicro.sweeps._provenance import Provenance, running
from macromicro.sweeps.processes import processes, submit

if TYPE_CHECKING:
    from distributed import Client

    from macromicro.batch import Job, Variants
    from macromicro.sweeps._spec import Spec
    from macromicro.sweeps.subject import Factory

FACTORY = "macromicro.batch:job"
CRASHES = 3  # of workers that a part may cause
AHEAD = 2  # parts for each worker, so that none waits for this process
CLUSTER_AHEAD = 1000  # parts submitted to a cluster, which may grow
KEPT = "Finished variants are kept; add --resume to continue"
NO_WORKERS = (
    "the worker processes end before they begin; they import the script that starts a sweep, "
    'which must do so under `if __name__ == "__main__":`'
)
_POLL = 0.2  # s between looks at `stop`
_MAX_WORDS = 500  # of an error's text


class SweepError(MacromicroError):
    """The sweep cannot continue, though its spec is sound; finished variants are kept."""


class Task(NamedTuple):
    """All that a worker must know of the sweep."""

    factory: str  # of the job, "module:function"
    spec: Spec  # without the parameters
    provenance: Provenance  # that all workers must have


class Part(NamedTuple):
    number: int
    first: int  # index of its first variant
    variants: Variants

    def __str__(self) -> str:
        return f"variants {self.first} to {self.first + len(self.variants.values) - 1}"


class Block(NamedTuple):
    rows: Array  # metrics of a part's variants, NaN where one is infeasible
    errors: dict[int, str]  # why rows are infeasible, by their place


Draw = Callable[[int], Part]  # the part of a number
Stop = Callable[[], bool]
Computed = Generator[tuple[Part, Block], None, None]


def factory(name: str) -> Factory:
    module, _, function = name.partition(":")
    made: Factory = getattr(importlib.import_module(module), function)
    return made


_jobs: dict[tuple[str, str], Job] = {}  # of this process, by factory and digest of the spec


def _job(task: Task) -> Job:
    """The job of a task, made once in a process."""
    from macromicro.sweeps.subject import laws

    if running() != task.provenance:
        raise SweepError(f"a worker has macromicro {running()}, the sweep {task.provenance}")
    key = task.factory, task.spec.digest
    if key in _jobs:
        return _jobs[key]
    job = factory(task.factory)(task.spec.job, **dict(task.spec.options))
    for law in laws(job):
        if law not in task.spec.files:
            raise SweepError(f"a worker has another {law[0]} (sources {law[1]})")
    _jobs.clear()
    _jobs[key] = job
    return job


def prepare(task: Task) -> None:
    """In a worker: import and compile, or load, what the job needs."""
    from macromicro.batch import Variants

    _job(task).evaluate(Variants((), np.empty((0, 0))))


def compute(task: Task, part: Part) -> Block:
    """In a worker: the metrics of a part."""
    try:
        errors: dict[int, str] = {}
        rows = _compute(_job(task), part.variants, part.first, 0, errors)
        return Block(rows[:, list(task.spec.columns)], errors)
    except Exception as error:  # other errors may not survive the way back
        raise SweepError(_words(error)) from None


def _compute(job: Job, variants: Variants, first: int, place: int, errors: dict[int, str]) -> Array:
    """One evaluation; halved where it fails, so that only infeasible rows are lost."""
    count = len(variants.values)
    try:
        return np.asarray(job.evaluate(variants, first + place), dtype=np.float64)
    except (MacromicroError, ArithmeticError) as error:
        if count == 1:
            errors[place] = _words(error) or type(error).__name__
            return np.full((1, len(job.metrics)), np.nan)
    halves = ((0, count // 2), (count // 2, count))
    return np.concatenate(
        [
            _compute(job, variants._replace(values=variants.values[a:b]), first, place + a, errors)
            for a, b in halves
        ]
    )


def by_processes(
    task: Task, numbers: Sequence[int], draw: Draw, workers: int, stop: Stop
) -> Computed:
    """Compute parts in worker processes; after a crash the lost ones are computed again.

    A crash ends all workers. A part that was in hand at two crashes is then computed alone, so that
    the guilty one is known.
    """
    left = dict.fromkeys(numbers)
    crashes: Counter[int] = Counter()
    while left and not stop():
        suspects = [number for number in left if crashes[number] >= CRASHES - 1]
        batch, ahead = (suspects, 1) if suspects else (list(left), AHEAD * workers)
        count = min(workers, ahead, len(batch))
        in_hand: dict[Future[Block], Part] = {}
        ready: list[Future[None]] = []
        try:
            with processes(count) as pool:
                for _ in range(count):  # while this process draws the first parts
                    ready.append(submit(pool, prepare, task))
                for part, block in _flow(pool, task, map(draw, batch), ahead, in_hand, stop):
                    del left[part.number]
                    yield part, block
        except BrokenProcessPool:
            for part in in_hand.values():
                crashes[part.number] += 1
                if crashes[part.number] >= CRASHES:
                    if not any(map(_has_answered, ready)):
                        raise SweepError(NO_WORKERS) from None
                    why = f"{part} crashed their worker {CRASHES} times"
                    raise SweepError(f"{why}; is the memory full? {KEPT}") from None


def _has_answered(future: Future[None]) -> bool:
    return not future.cancelled() and not isinstance(future.exception(), BrokenProcessPool)


def by_cluster(
    client: Client, task: Task, numbers: Sequence[int], draw: Draw, stop: Stop
) -> Computed:
    """The same by a cluster, which computes the parts of a lost worker again."""
    pool = client.get_executor(pure=False, retries=0)
    ahead = max(CLUSTER_AHEAD, AHEAD * sum(client.nthreads().values()))
    try:
        yield from _flow(pool, task, map(draw, numbers), ahead, {}, stop)
    except CancelledError:
        raise SweepError(f"the scheduler was lost. {KEPT}") from None
    finally:
        pool.shutdown(wait=False)


def _flow(
    pool: Executor, task: Task, waiting: Iterator[Part], ahead: int,
    in_hand: dict[Future[Block], Part], stop: Stop,
) -> Computed:  # fmt: skip
    """Parts with their metrics as they are finished; `in_hand` are those that are submitted."""
    while not stop():
        while len(in_hand) < ahead and (part := next(waiting, None)) is not None:
            in_hand[submit(pool, compute, task, part)] = part
        if not in_hand:
            return
        for future in wait(in_hand, _POLL, FIRST_COMPLETED).done:
            part = in_hand[future]
            try:
                block = future.result()
            except (BrokenProcessPool, CancelledError):
                raise
            except Exception as error:
                raise SweepError(f"{part}: {_words(error)}. {KEPT}") from None
            del in_hand[future]
            yield part, block


def _words(error: Exception) -> str:
    text = " ".join(str(error).split())[:_MAX_WORDS]
    expected = isinstance(error, MacromicroError | ArithmeticError)
    return text if expected else f"{type(error).__name__}: {text}"
