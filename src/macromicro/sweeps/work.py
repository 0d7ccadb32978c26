"""A worker's computation, local or in a cluster: a range of indices in, blocks of metrics out."""

from __future__ import annotations

import importlib
import time
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import MacromicroError
from macromicro.sweeps._journal import Block
from macromicro.sweeps._origin import Code
from macromicro.sweeps._sampling import Sampler
from macromicro.sweeps._spec import Spec
from macromicro.sweeps.subject import Factory, laws

FACTORY = "macromicro.batch:job"
PORTION = 0.1  # s of a core; blocks that are quicker are computed and journaled several at once
_MAX_WORDS = 500  # of an error's text


class SweepError(MacromicroError):
    """The sweep cannot continue, though its spec is sound; finished variants are kept."""


class Task(NamedTuple):
    spec: Spec  # the sweep
    factory: str = FACTORY  # where jobs come from, "module:function"
    # that all variants are to be computed with; None where that is not looked at
    code: Code | None = None


def foreign(who: str, theirs: object, ours: Code) -> SweepError:
    """The error for a worker with other code, whose results must not be mixed with ours."""
    return SweepError(
        f"{who} has macromicro {theirs}, this sweep is of {ours}; what is finished is kept, "
        "--resume goes on where all have that code"
    )


def factory(name: str) -> Factory:
    module, _, function = name.partition(":")
    made: Factory = getattr(importlib.import_module(module), function)
    return made


class Bench:
    """A task's job, ready to compute; one per thread."""

    def __init__(self, task: Task) -> None:
        self.spec = task.spec
        self.job = factory(task.factory)(task.spec.job, **dict(task.spec.options))
        for law in laws(self.job):
            if law not in task.spec.files:
                words = f"a worker has another {law[0]} (sources {law[1]})"
                raise SweepError(f"{words}. Finished variants are kept; add --resume to continue")
        self._sampler = Sampler(task.spec)
        self._columns = list(task.spec.columns)
        self._portion = self.job.block

    def blocks(self, first: int, count: int) -> Iterator[Block]:
        last = first + count
        while first < last:
            # Portions end where the job's blocks do, so that no lane stays empty.
            end = min(last, first + self._portion - first % self.job.block)
            # Of this thread: where others share the core, portions must not get smaller.
            started = time.thread_time()
            block = self.block(first, end - first)
            self._resize((time.thread_time() - started) / (end - first))
            yield block
            first = end

    def block(self, first: int, count: int) -> Block:
        errors: dict[int, str] = {}
        rows = self._computed(first, count, 0, errors)
        return Block(first, rows, errors)

    def _computed(self, first: int, count: int, place: int, errors: dict[int, str]) -> Array:
        """One evaluation; halved where it fails, so that only impossible rows are lost."""
        try:
            rows = self.job.evaluate(self._sampler.variants(first, count), first)
            return np.asarray(rows, dtype=np.float64)[:, self._columns]
        except (MacromicroError, ArithmeticError) as error:
            if count == 1:
                errors[place] = " ".join(str(error).split())[:_MAX_WORDS] or type(error).__name__
                return np.full((1, len(self._columns)), np.nan)
        half = count // 2
        parts = ((first, half, place), (first + half, count - half, place + half))
        return np.concatenate([self._computed(*part, errors) for part in parts])

    def _resize(self, each: float) -> None:
        """Approach `PORTION` seconds, in whole blocks; at most doubled at a time."""
        block = self.job.block
        requested = int(PORTION / max(each, 1e-9)) // block * block
        self._portion = max(block, min(requested, 2 * self._portion))


def sized(each: float | None, seconds: float, block: int, share: int) -> int:
    requested = block if each is None else int(seconds / max(each, 1e-9))
    return max(1, -(-min(requested, share) // block)) * block


def smoothed(each: float | None, new: float) -> float:
    """Smoothed seconds per variant: down at once (the first call compiles), up slowly."""
    return new if each is None or new < each else 0.7 * each + 0.3 * new
