"""A server with its own event loop and thread."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import socket
import threading
from abc import ABC, abstractmethod
from typing import Self

from macromicro.errors import InputError, MacromicroError, ProblemError

ADDRESS = "an address of this computer, such as 127.0.0.1"


class Threaded(ABC):
    """Runs a server in a thread; a context manager. `address` is the true one once it listens."""

    def __init__(self, kind: str, host: str, port: int) -> None:
        self._kind = kind
        self._where = self.address = host, port
        self._thread: threading.Thread | None = None
        self._bound = threading.Event()
        self._failures: list[BaseException] = []
        self._loop: asyncio.AbstractEventLoop | None = None
        self._task: asyncio.Task[None] | None = None

    @abstractmethod
    async def _serve(self) -> None:
        """Serve until cancelled; calls `_listening`."""

    def _listening(self, host: str, port: int) -> None:
        """Let `start` return."""
        self.address = host, port
        self._bound.set()

    @property
    def failure(self) -> BaseException | None:
        """Why it ended by itself, or None."""
        return self._failures[0] if self._failures else None

    def start(self) -> None:
        """Listen."""
        if self._thread is not None:
            raise MacromicroError(f"the {self._kind} server runs already")
        self._bound.clear()
        self._failures.clear()
        self._thread = threading.Thread(target=self._run, name=self._kind.lower(), daemon=True)
        self._thread.start()
        self._bound.wait()
        if self._failures:
            self._thread.join()
            self._thread = None
            raise self._failures[0]

    def stop(self) -> None:
        """End all connections."""
        thread, loop, task = self._thread, self._loop, self._task
        if thread is None:
            return
        if loop is not None and task is not None:
            with contextlib.suppress(RuntimeError):  # it has ended by itself
                loop.call_soon_threadsafe(task.cancel)
        thread.join()
        self._thread = None

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def _run(self) -> None:
        try:
            asyncio.run(self._main())
        except BaseException as error:
            self._failures.append(error)
        finally:
            self._bound.set()

    async def _main(self) -> None:
        self._loop, self._task = asyncio.get_running_loop(), asyncio.current_task()
        await self._serve()


def check_port(port: int) -> None:
    if not 0 <= port <= 65535:
        raise InputError("port", port, "a whole number from 0 (any free one) to 65535")


def refused(host: str, port: int, error: OSError) -> InputError:
    """Why `host` and `port` cannot be listened at."""
    if isinstance(error, socket.gaierror):
        return InputError("host", host, ADDRESS)
    # asyncio words the error of each address anew, with the number kept.
    if error.errno == errno.EADDRINUSE:
        remedy = "Choose a free port, or 0 for any, or end the program that listens there."
        return ProblemError(f"port {port}", f"already in use on {host}", remedy)
    if error.errno == errno.EACCES:
        return ProblemError(f"port {port}", "not permitted", "Choose a port from 1024 on.")
    return ProblemError("host", f"cannot listen at {host} ({error.strerror})", f"Use {ADDRESS}.")
