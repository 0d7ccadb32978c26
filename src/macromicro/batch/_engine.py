"""Variants through a job, in pieces over threads: results stream out in order.

Kernels release the interpreter's lock, so threads scale like processes and share all tables.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np

from macromicro import portable
from macromicro.arrays import Array
from macromicro.batch.variants import Job, Variants
from macromicro.errors import InputError

AHEAD = 2  # pieces a thread that may wait for their turn to be given
_BLOCKS = 4  # most blocks in a piece: enough work to pay for handing it to a thread


def cores() -> int:
    """Number of cores that this process may use.

    Returns
    -------
    int
        1 or more.

    Examples
    --------
    >>> from macromicro import batch
    >>> batch.cores() >= 1
    True
    """
    return portable.cores()


def run(
    job: Job, variants: Variants | Iterable[Variants], threads: int | None = None
) -> Iterator[tuple[int, Array]]:
    """Evaluate all variants.

    The metrics are the same bits whatever the division and the number of threads.

    Parameters
    ----------
    job : Job
        The job to run.
    variants : Variants or iterable of Variants
        One set, or sets that are taken only as far ahead as the threads need, so that memory stays
        bounded however many there are.
    threads : int, optional
        None for all cores.

    Returns
    -------
    iterator of (int, ndarray, shape (m, k))
        The number of the first variant and the metrics of one piece after another.

    Raises
    ------
    InputError
        A number of threads below 1; or variants that the job refuses, after the results before
        them.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro import batch
    >>> job = batch.job("macro-bench")
    >>> gains = batch.Variants(("controller.pd_tuned.now",), np.array([[0.012], [0.0125], [0.013]]))
    >>> for first, metrics in batch.run(job, gains, threads=1):
    ...     print(metrics[:, 0].round(3))  # settling time, s
    [0.77  0.62  0.556]
    """
    count = cores() if threads is None else threads
    if isinstance(count, bool) or not isinstance(count, int) or count < 1:
        raise InputError("threads", threads, "a whole number from 1, or None for all cores")
    sets = [variants] if isinstance(variants, Variants) else variants
    pieces = _pieces(sets, job.block, count)
    return _serial(job, pieces) if count == 1 else _parallel(job, pieces, count)


def _pieces(sets: Iterable[Variants], block: int, threads: int) -> Iterator[tuple[int, Variants]]:
    """The variants in pieces of a few blocks, with the number of each piece's first one."""
    first = 0
    for paths, values in sets:
        if np.ndim(values) != 2:
            raise InputError("variants, shape of the values", np.shape(values), "(n, paths)")
        n = len(values)
        size = max(1, min(_BLOCKS * block, -(-n // threads)))  # few: each thread its share
        for k in range(0, n, size):
            yield first + k, Variants(paths, values[k : k + size])
        first += n


def _serial(job: Job, pieces: Iterable[tuple[int, Variants]]) -> Iterator[tuple[int, Array]]:
    for first, piece in pieces:
        yield first, job.evaluate(piece, first)


def _parallel(
    job: Job, pieces: Iterable[tuple[int, Variants]], threads: int
) -> Iterator[tuple[int, Array]]:
    """The same on `threads` threads. Pieces not begun are dropped when the caller stops."""
    waiting: deque[tuple[int, Future[Array]]] = deque()
    pool = ThreadPoolExecutor(threads, "macromicro-batch")
    try:
        for first, piece in pieces:
            if first == 0:  # none of them: the job gets its kernels ready, by one thread
                job.evaluate(Variants(piece.paths, piece.values[:0]))
            waiting.append((first, pool.submit(job.evaluate, piece, first)))
            if len(waiting) > AHEAD * threads:
                number, done = waiting.popleft()
                yield number, done.result()
        while waiting:
            number, done = waiting.popleft()
            yield number, done.result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
