"""A sweep on a cluster: chunks as tasks of dask.distributed, journaled here as they complete.

A task is a range of indices and the spec; the answer names the worker's code, which must
be the same as here. dask reassigns the tasks of a lost worker.
"""

from __future__ import annotations

import contextlib
import queue
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple
from urllib.parse import urlsplit

from macromicro.errors import InputError, ProblemError
from macromicro.extras import remedy
from macromicro.schema.text import printable
from macromicro.sweeps import _journal
from macromicro.sweeps._origin import Code, running
from macromicro.sweeps._todo import Chunk, Todo
from macromicro.sweeps.folder import locked, next_number
from macromicro.sweeps.work import Bench, SweepError, Task, foreign, sized, smoothed

if TYPE_CHECKING:
    from distributed import Client, Future

Report = Callable[[int, int], None]
Stop = Callable[[], bool]


class Answer(NamedTuple):
    code: Code  # with which it was computed
    where: str  # the worker's address
    size: int  # of the job's blocks
    block: _journal.Block  # the chunk's variants
    seconds: float  # that they took


CHUNK = 1.0  # s of work in a task
RATE = 100.0  # tasks per second that the scheduler and this process are spared more of
SCHEMES = ("tcp", "tls", "ws", "wss")
_CONNECT = 5.0  # s
_CLOSE = 1.0  # s for a client that found no scheduler
_WORKERS = 20.0  # s to wait for a first worker
_POLL = 0.2  # s between looks at `stop`
_AHEAD = 2  # tasks per thread of the cluster, so that none waits for this process
_COUNT_AGAIN = 5.0  # s between looks at how many threads there are
_SYNC = 1.0  # s of results that a power cut may take
_ACCEPTED = "Give the address of a running dask scheduler, such as tcp://HOST:8786."
_mine = threading.local()


def require() -> None:
    """Refuse to go on without dask.distributed."""
    try:
        import distributed  # noqa: F401
    except ImportError:
        missing = "dask.distributed is not installed"
        raise ProblemError("--scheduler", missing, f"Install it {remedy('cluster')}") from None


def checked(address: str) -> str:
    """Check that an address is SCHEME://HOST:PORT with a scheme of `SCHEMES`."""
    text = printable(address, 200)
    if not text.isascii() or " " in address or text != address:
        raise ProblemError(f"--scheduler {text}", "not an address", _ACCEPTED)
    full = address if "://" in address else f"tcp://{address}"
    where = f"--scheduler {address}"
    try:
        parts = urlsplit(full)
        host, port = parts.hostname, parts.port
    except ValueError as error:
        raise ProblemError(where, str(error), _ACCEPTED) from None
    if parts.scheme not in SCHEMES:
        raise InputError(where, parts.scheme, f"{' or '.join(SCHEMES)}, as in tcp://HOST:8786")
    if not host:
        raise ProblemError(where, "the host is missing", _ACCEPTED)
    if not port:
        raise ProblemError(where, "the port is missing", _ACCEPTED)
    if parts.path or parts.query or parts.fragment or "@" in parts.netloc:
        raise ProblemError(where, "only a host and a port are allowed", _ACCEPTED)
    return full


def connect(address: str, code: Code) -> Client:
    require()
    full, where = checked(address), f"--scheduler {address}"
    client = _reached(full, where)
    try:
        client.wait_for_workers(1, timeout=_WORKERS)
        found = client.run(running)
    except TimeoutError:
        client.close()
        raise ProblemError(where, "the scheduler has no workers", "Start at least one.") from None
    except Exception as error:
        client.close()
        accepted = f"Install macromicro {code} on the workers."
        raise ProblemError(where, _words(error), accepted) from None
    for worker, theirs in found.items():
        if theirs != code:
            client.close()
            accepted = f"Install macromicro {code} on every worker."
            raise ProblemError(f"{where}, worker {worker}", f"it has macromicro {theirs}", accepted)
    return client


def _reached(address: str, where: str) -> Client:
    """A client of a scheduler that answers.

    A failed one is closed here: the garbage collector would wait long and print a traceback.
    """
    from distributed import Client

    _silence()
    client = Client.__new__(Client)
    try:
        Client.__init__(client, address, timeout=_CONNECT, set_as_default=False)
    except BaseException as error:
        with contextlib.suppress(Exception):
            client.close(timeout=_CLOSE)
        client.status = "closed"
        if not isinstance(error, Exception):
            raise
        words = " ".join(str(error).split())[:200] or "nothing answers"
        raise ProblemError(where, words, _ACCEPTED) from None
    return client


def _silence() -> None:
    """Silence dask's tracebacks; our errors are one sentence."""
    import logging

    for name in [n for n in logging.root.manager.loggerDict if n.startswith("distributed")]:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)


def run(client: Client, task: Task, todo: Todo, folder: Path, report: Report, stop: Stop) -> None:
    """Compute the open variants; the results go into one new journal."""
    spec = task.spec
    path = folder / f"{next_number(folder):06d}{_journal.SUFFIX}"
    with locked(folder.parent), _journal.Writer(path, spec.digest, len(spec.metrics)) as writer:
        flow = _Flow(client, task, todo)
        synced = time.monotonic()
        try:
            while flow.fill() and not stop():
                for chunk, block in flow.completed():
                    writer.append(block)
                    report(len(block.rows), len(block.errors))
                    flow.pending.pop(chunk.first)
                if time.monotonic() - synced >= _SYNC:
                    writer.sync()
                    synced = time.monotonic()
        finally:
            flow.cancel()
            writer.sync()


class _Flow:
    """Submitted tasks, enough for every thread, and their answers."""

    def __init__(self, client: Client, task: Task, todo: Todo) -> None:
        self._client, self._task, self._todo = client, task, todo
        self.pending: dict[int, tuple[Chunk, Future]] = {}
        self._done: queue.SimpleQueue[int] = queue.SimpleQueue()
        self._each: float | None = None
        self._block = 1
        self._threads, self._counted = 1, -_COUNT_AGAIN

    def fill(self) -> bool:
        """Submit tasks up to the limit; false when nothing is left to wait for."""
        now = time.monotonic()
        if now - self._counted >= _COUNT_AGAIN:
            self._threads = self._count()
            self._counted = now
        while self._todo and len(self.pending) < _AHEAD * self._threads:
            seconds = max(CHUNK, self._threads / RATE)
            share = max(1, self._todo.left // (2 * self._threads))
            chunk = self._todo.take(sized(self._each, seconds, self._block, share), self._block)
            future = self._client.submit(
                compute, self._task, chunk.first, chunk.size, pure=False, retries=0
            )
            self.pending[chunk.first] = (chunk, future)
            future.add_done_callback(lambda _, first=chunk.first: self._done.put(first))
        return bool(self.pending)

    def _count(self) -> int:
        try:
            return max(1, sum(int(n) for n in self._client.nthreads().values()))
        except Exception as error:  # whatever it is, it is the connection
            raise _lost(error) from None

    def completed(self) -> Iterator[tuple[Chunk, _journal.Block]]:
        """The answers of a moment; workers with other code then end the sweep."""
        try:
            firsts = [self._done.get(timeout=_POLL)]
        except queue.Empty:
            if self._client.status != "running":
                raise _lost(self._client.status) from None
            return
        while not self._done.empty():
            firsts.append(self._done.get())
        chunks, futures = zip(*(self.pending[first] for first in firsts), strict=True)
        answers = self._fetched(chunks, futures)
        ours, others = self._task.code, None
        for chunk, answer in zip(chunks, answers, strict=True):
            if ours is not None and getattr(answer, "code", None) != ours:
                others = answer
                continue
            self._block = answer.size
            self._each = smoothed(self._each, answer.seconds / chunk.size)
            yield chunk, answer.block
        if others is not None and ours is not None:
            theirs = getattr(others, "code", "of another version")
            raise foreign(f"worker {getattr(others, 'where', '')}".rstrip(), theirs, ours)

    def _fetched(self, chunks: Sequence[Chunk], futures: Sequence[Future]) -> list[Answer]:
        from distributed import KilledWorker

        for chunk, future in zip(chunks, futures, strict=True):
            if future.status != "error":
                continue
            error = future.exception()
            last = chunk.first + chunk.size - 1
            if isinstance(error, KilledWorker):
                raise SweepError(
                    f"variants {chunk.first} to {last} ended several workers. Finished "
                    "variants are kept; add --resume to continue"
                )
            raise SweepError(f"variants {chunk.first} to {last}: {_words(error)}")
        try:
            found: list[Answer] = self._client.gather(list(futures))
        except Exception as error:  # whatever it is, it is the connection
            raise _lost(error) from None
        return found

    def cancel(self) -> None:
        if self.pending:
            try:
                self._client.cancel([future for _, future in self.pending.values()])
            except Exception:  # without a scheduler nothing is on its way
                return


def compute(task: Task, first: int, count: int) -> Answer:
    from distributed import get_worker

    if getattr(_mine, "task", None) != task:
        _mine.task, _mine.bench = task, Bench(task)
    bench: Bench = _mine.bench
    started = time.perf_counter()
    block = _journal.joined(list(bench.blocks(first, count)))
    seconds = time.perf_counter() - started
    return Answer(running(), get_worker().address, bench.job.block, block, seconds)


def _lost(why: object) -> SweepError:
    words = why if isinstance(why, str) else _words(why)
    return SweepError(
        f"the scheduler was lost ({words}). Finished variants are kept; add --resume to continue"
    )


def _words(error: object) -> str:
    text = " ".join(str(error).split())[:300]
    return f"{type(error).__name__}: {text}" if text else type(error).__name__
