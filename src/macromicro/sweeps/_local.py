"""A sweep on this machine: worker processes, each with a journal of its own.

A worker gets chunks through a pipe, appends every finished block to its journal and then
reports it. After a crash its journal is read, and the rest of its chunk goes to a new worker.
"""

from __future__ import annotations

import itertools
import multiprocessing
import os
import signal
import time
from collections.abc import Callable, Iterator
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import TYPE_CHECKING, Any

from macromicro import threads
from macromicro.sweeps import _journal
from macromicro.sweeps._origin import running
from macromicro.sweeps._todo import Chunk, Todo
from macromicro.sweeps.folder import locked, next_number, spans
from macromicro.sweeps.work import Bench, SweepError, Task, foreign, sized, smoothed

if TYPE_CHECKING:
    from multiprocessing.context import SpawnProcess

Report = Callable[[int, int], None]
Stop = Callable[[], bool]

CHUNK = 1.0  # s of work in one message
GIVE_UP = 3  # workers that one chunk, or the start, may cost
_POLL = 0.1  # s between looks at `stop`
_PATIENCE = 30.0  # s that a worker has to finish a portion when it is asked to end


def run(task: Task, todo: Todo, folder: Path, workers: int, report: Report, stop: Stop) -> None:
    """Compute the open variants into new journals, by worker processes."""
    pool = _Pool(task, todo, folder, report)
    try:
        for _ in range(min(workers, max(1, todo.left))):
            pool.start()
        while pool.workers and not stop():
            pool.serve(_POLL)
        pool.dismiss()
    finally:
        pool.kill()


class _Worker:
    def __init__(self, process: SpawnProcess, pipe: Connection, path: Path) -> None:
        self.process = process
        self.pipe = pipe
        self.path = path
        self.chunk: Chunk | None = None
        self.finished = 0


class _Pool:
    def __init__(self, task: Task, todo: Todo, folder: Path, report: Report) -> None:
        self._task, self._todo, self._folder, self._report = task, todo, folder, report
        self._context = multiprocessing.get_context("spawn")
        self.workers: list[_Worker] = []
        self._each: float | None = None
        self._size = 0
        self._block = 1
        self._stillborn = 0
        self._dismissed = False
        self._names = itertools.count(next_number(folder))

    def start(self) -> None:
        here, there = self._context.Pipe()
        path = self._folder / f"{next(self._names):06d}{_journal.SUFFIX}"
        process = self._context.Process(
            target=work, args=(there, self._task, path, os.getpid()), daemon=True
        )
        # A worker that Ctrl-C reaches before it can ignore it would end with a traceback. The
        # tracker is started first: as it starts, it unblocks the signal.
        resource_tracker.ensure_running()
        mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        there.close()
        self.workers.append(_Worker(process, here, path))
        self._size = max(self._size, len(self.workers))

    def serve(self, seconds: float) -> None:
        """Handle messages of workers for these seconds."""
        ready = wait([w.pipe for w in self.workers], seconds)
        for worker in [w for w in self.workers if w.pipe in ready]:
            if not self._heard(worker, 0.0):
                self._bury(worker)

    def _heard(self, worker: _Worker, seconds: float) -> bool:
        """Handle all messages of a worker; false when it has ended."""
        while True:
            try:
                if not worker.pipe.poll(seconds):
                    return True
                received = worker.pipe.recv()
            except (EOFError, OSError):
                return False
            self._hear(worker, received)

    def _hear(self, worker: _Worker, received: tuple[Any, ...]) -> None:
        match received:
            case ("block", count, impossible, seconds):
                worker.finished += count
                self._each = smoothed(self._each, seconds / count)
                self._report(count, impossible)
            case ("ready", block):
                self._block = block
                if not self._dismissed:
                    self._next(worker)
            case ("failed", words):
                raise SweepError(words)

    def _next(self, worker: _Worker) -> None:
        """Assign another chunk; the last ones are smaller, so that all workers end together."""
        worker.chunk, worker.finished = None, 0
        if not self._todo:
            self._send(worker, None)
            return
        share = max(1, self._todo.left // (2 * self._size))
        size = sized(self._each, CHUNK, self._block, share)
        worker.chunk = self._todo.take(size, self._block)
        self._send(worker, (worker.chunk.first, worker.chunk.size))

    @staticmethod
    def _send(worker: _Worker, what: tuple[int, int] | None) -> None:
        try:
            worker.pipe.send(what)
        except OSError:  # it died; its pipe says so at the next turn
            return

    def _bury(self, worker: _Worker) -> None:
        """Remove a worker that ended, and take over its unfinished variants."""
        self.workers.remove(worker)
        worker.pipe.close()
        worker.process.join()
        chunk, code = worker.chunk, worker.process.exitcode
        if code == 0 and chunk is None:
            return
        if chunk is None:
            self._stillborn += 1
            if self._stillborn >= GIVE_UP:
                raise SweepError(f"{GIVE_UP} workers ended before they began ({_cause(code)})")
        else:
            self._take_over(worker, chunk, code)
        if self._todo:
            self.start()

    def _take_over(self, worker: _Worker, chunk: Chunk, code: int | None) -> None:
        done = spans([worker.path], self._task.spec)
        left = _journal.gaps(done, chunk.first, chunk.first + chunk.size)
        found = chunk.size - sum(high - low for low, high in left)
        if found > worker.finished:  # appended, but not reported any more
            self._report(found - worker.finished, 0)
        deaths = chunk.deaths + 1 if not found else 1
        if left and deaths >= GIVE_UP:
            raise SweepError(
                f"variants {chunk.first} to {chunk.first + chunk.size - 1} ended {deaths} workers "
                f"({_cause(code)}). Finished variants are kept; add --resume to continue"
            )
        for low, high in reversed(left):
            self._todo.give_back(Chunk(low, high - low, deaths))

    def dismiss(self) -> None:
        """Ask all workers to end after their present portion, and wait for them."""
        self._dismissed = True
        for worker in self.workers:
            self._send(worker, None)
        end = time.monotonic() + _PATIENCE
        while self.workers and time.monotonic() < end:
            for worker in list(self.workers):
                if not self._heard(worker, _POLL):
                    worker.process.join()
                    self.workers.remove(worker)

    def kill(self) -> None:
        for worker in self.workers:
            worker.process.kill()
            worker.process.join()
            worker.pipe.close()


def _cause(code: int | None) -> str:
    if code is not None and code < 0:
        return f"killed by signal {-code}, {signal.Signals(-code).name}"
    return f"exit status {code}"


def work(pipe: Connection, task: Task, path: Path, parent: int) -> None:
    """Run a worker until it is ordered to end, or its parent has ended."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group
    for name in (*threads.BLAS, "NUMBA_NUM_THREADS"):
        os.environ[name] = "1"  # the cores are the workers'
    try:
        if task.code is not None and running() != task.code:
            pipe.send(("failed", str(foreign("a worker", running(), task.code))))
            return
        bench = Bench(task)
        spec = task.spec
        # Nobody else may begin here while a worker is still at it.
        with locked(path.parent.parent):
            # Once it has its share: a run that goes on counts the journals before it starts
            # workers, and one made behind its back would bear the name of one of its own.
            if os.getppid() != parent:
                os._exit(1)
            with _journal.Writer(path, spec.digest, len(spec.metrics)) as writer:
                pipe.send(("ready", bench.job.block))
                for first, count in _orders(pipe):
                    _chunk(pipe, bench, writer, (first, count), parent)
    except (EOFError, BrokenPipeError, ConnectionResetError):
        os._exit(1)  # the parent is gone
    except Exception as error:  # whatever it is, the parent says it
        words = f"{type(error).__name__}: {error}" if str(error) else repr(error)
        pipe.send(("failed", " ".join(f"a worker failed: {words}".split())[:2000]))


def _orders(pipe: Connection) -> Iterator[tuple[int, int]]:
    while (received := pipe.recv()) is not None:
        yield received


def _chunk(
    pipe: Connection, bench: Bench, writer: _journal.Writer, order: tuple[int, int], parent: int
) -> None:
    started = time.perf_counter()
    for block in bench.blocks(*order):
        writer.append(block)
        now = time.perf_counter()
        pipe.send(("block", len(block.rows), len(block.errors), now - started))
        started = now
        if pipe.poll():  # ordered to end
            return
        if os.getppid() != parent:
            os._exit(1)
    writer.sync()
    pipe.send(("ready", bench.job.block))
