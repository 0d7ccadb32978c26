"""The event loop of all servers, on a thread of its own, and threads for what may block."""

from __future__ import annotations

import asyncio
import functools
import threading
from collections.abc import Callable, Coroutine
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, ParamSpec, TypeVar

THREADS = 64  # more than clients that may command: one that waits for a disk delays no other one
P = ParamSpec("P")
T = TypeVar("T")


class _Background:
    def __init__(self) -> None:
        self.loop = asyncio.SelectorEventLoop()  # everywhere: it watches plain sockets, too
        self.workers = ThreadPoolExecutor(THREADS, "worker")
        self.thread = threading.Thread(target=self.loop.run_forever, name="servers", daemon=True)
        self.thread.start()


_starting = threading.Lock()
_running: _Background | None = None


def _background() -> _Background:
    """The one of this process; the first call starts it."""
    global _running  # noqa: PLW0603
    with _starting:
        if _running is None or not _running.thread.is_alive():  # of a process that was forked
            _running = _Background()
        return _running


def submit(work: Coroutine[Any, Any, T]) -> Future[T]:
    """Run a coroutine in the event loop, from another thread."""
    return asyncio.run_coroutine_threadsafe(work, _background().loop)


def call(work: Coroutine[Any, Any, T]) -> T:
    """Run a coroutine in the event loop and wait for its result, from another thread."""
    return submit(work).result()


def call_soon(act: Callable[[], object]) -> None:
    """Have the event loop call a function, from any thread."""
    _background().loop.call_soon_threadsafe(act)


def on_loop(act: Callable[P, T]) -> Callable[P, T]:
    """Makes a function run in the event loop, from whichever thread it is called."""

    @functools.wraps(act)
    def run(*args: P.args, **kwargs: P.kwargs) -> T:
        if threading.current_thread() is _background().thread:
            return act(*args, **kwargs)

        async def there() -> T:
            return act(*args, **kwargs)

        return call(there())

    return run


async def in_thread(act: Callable[..., T], *given: object) -> T:
    """Run what may block on a thread of its own: files, programs, long computations."""
    return await asyncio.get_running_loop().run_in_executor(_background().workers, act, *given)
