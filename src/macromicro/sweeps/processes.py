"""Worker processes that end with their parent."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing.connection import Connection
from typing import Any, TypeVar

from macromicro.threads import one_for_blas

T = TypeVar("T")

# A terminal sends these to the whole group; only the parent acts on them.
_OF_THE_GROUP = {signal.SIGINT, getattr(signal, "SIGHUP", signal.SIGINT)}


@contextmanager
def processes(count: int) -> Iterator[ProcessPoolExecutor]:
    """A pool whose workers end at once when the block or this process ends."""
    context = multiprocessing.get_context("spawn")  # a fork would inherit locks and threads
    theirs, ours = context.Pipe(duplex=False)
    pool = ProcessPoolExecutor(count, context, _begin, (theirs,))
    try:
        yield pool
    finally:
        ours.close()
        pool.shutdown(cancel_futures=True)
        theirs.close()


def submit(pool: Executor, function: Callable[..., T], *arguments: Any) -> Future[T]:
    """Submit a call; a worker that this starts ignores the signals of a terminal."""
    if not hasattr(signal, "pthread_sigmask"):
        return pool.submit(function, *arguments)
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _OF_THE_GROUP)
    try:
        return pool.submit(function, *arguments)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin(parent: Connection) -> None:
    one_for_blas()  # the cores are the workers'
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: Connection) -> None:
    parent.poll(None)  # until the other end is closed
    os._exit(1)
