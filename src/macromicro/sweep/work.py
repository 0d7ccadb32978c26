"""What a worker does, local or in a cluster: a range of indices in, blocks of metrics out."""

from __future__ import annotations

import importlib
import time
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import MacromicroError
from macromicro.sweep.journal import Block
from macromicro.sweep.origin import Code
from macromicro.sweep.sampling import Sampler
from macromicro.sweep.spec import Spec
from macromicro.sweep.subject import Factory, laws

FACTORY = "macromicro.batch:job"
PORTION = 0.1  # s of a core; blocks that are quicker are computed and journaled several at once
_MAX_WORDS = 500  # of an error's text


class SweepError(MacromicroError):
    """The sweep cannot go on, through no fault of its spec; what is finished is kept."""


class Task(NamedTuple):
    """What a worker must know.

    Attributes
    ----------
    spec : Spec
        The sweep.
    factory : str
        Where jobs come from, "module:function".
    code : Code or None
        That all variants are to be computed with; None where that is not looked at.
    """

    spec: Spec
    factory: str = FACTORY
    code: Code | None = None


def foreign(who: str, theirs: object, ours: Code) -> SweepError:
    """Make the error for a worker of other code: its results must not stand beside ours.

    Parameters
    ----------
    who : str
        The worker.
    theirs, ours : Code
        Its code, and the sweep's.

    Returns
    -------
    SweepError
        To be raised.
    """
    return SweepError(
        f"{who} has macromicro {theirs}, this sweep is of {ours}; what is finished is kept, "
        "--resume goes on where all have that code"
    )


def factory(name: str) -> Factory:
    """Find the function that makes jobs.

    Parameters
    ----------
    name : str
        "module:function".

    Returns
    -------
    callable
        The function.
    """
    module, _, function = name.partition(":")
    made: Factory = getattr(importlib.import_module(module), function)
    return made


class Bench:
    """A task's job, ready to compute; one per thread.

    Parameters
    ----------
    task : Task
        What a worker must know.
    """

    def __init__(self, task: Task) -> None:
        self.spec = task.spec
        self.job = factory(task.factory)(task.spec.job, **dict(task.spec.options))
        for law in laws(self.job):
            if law not in task.spec.files:
                words = f"a worker has another {law[0]} (sources {law[1]})"
                raise SweepError(f"{words}; what is finished is kept, --resume goes on")
        self._sampler = Sampler(task.spec)
        self._columns = list(task.spec.columns)
        self._portion = self.job.block

    def blocks(self, first: int, count: int) -> Iterator[Block]:
        """Compute variants, portion by portion.

        Parameters
        ----------
        first, count : int
            Which.

        Yields
        ------
        Block
            As they are done.
        """
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
        """Compute variants together.

        Parameters
        ----------
        first, count : int
            Which.

        Returns
        -------
        Block
            A row of NaN and its words where a variant is impossible.
        """
        errors: dict[int, str] = {}
        rows = self._computed(first, count, 0, errors)
        return Block(first, rows, errors)

    def _computed(self, first: int, count: int, place: int, errors: dict[int, str]) -> Array:
        """One evaluation; halves where it fails, so that only impossible rows are lost."""
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
        """Towards `PORTION` seconds, in whole blocks; doubled at most at a time."""
        block = self.job.block
        requested = int(PORTION / max(each, 1e-9)) // block * block
        self._portion = max(block, min(requested, 2 * self._portion))


def sized(each: float | None, seconds: float, block: int, share: int) -> int:
    """Give the size of a chunk.

    Parameters
    ----------
    each : float or None
        Seconds per variant as measured; None before the first is done.
    seconds : float
        Of work that is requested.
    block : int
        Variants that are computed together.
    share : int
        At most so many variants.

    Returns
    -------
    int
        Whole blocks, one at least.
    """
    requested = block if each is None else int(seconds / max(each, 1e-9))
    return max(1, -(-min(requested, share) // block)) * block


def smoothed(each: float | None, new: float) -> float:
    """Smooth the seconds per variant.

    They go down at once, for what takes long is often a first call that compiles, and up slowly.

    Parameters
    ----------
    each : float or None
        So far; None before the first.
    new : float
        A new measurement.

    Returns
    -------
    float
        Of both.
    """
    return new if each is None or new < each else 0.7 * each + 0.3 * new
