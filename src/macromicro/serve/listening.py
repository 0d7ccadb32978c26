"""A server in the event loop of all servers."""

from __future__ import annotations

import asyncio
import errno
import socket
import threading
from abc import ABC, abstractmethod
from concurrent.futures import Future
from typing import Self

from macromicro.errors import InputError, MacromicroError, ProblemError
from macromicro.serve import _background

END_S = 60.0  # for the farewell of all clients
ADDRESS = "an address of this computer, such as 127.0.0.1"


class Listener(ABC):
    """Runs a server in the background; a context manager. `address` is known once it listens."""

    def __init__(self, kind: str, host: str, port: int) -> None:
        self._kind = kind
        self._where = self.address = host, port
        self._bound: Future[None] = Future()
        self._ended = threading.Event()
        self._task: asyncio.Task[None] | None = None
        self.failure: BaseException | None = None  # why it ended by itself

    @abstractmethod
    async def _serve(self) -> None:
        """Serve until cancelled; calls `_listening`."""

    def _listening(self, host: str, port: int) -> None:
        """Let `start` return."""
        self.address = host, port
        if not self._bound.done():
            self._bound.set_result(None)

    def start(self) -> None:
        """Listen. What takes its time, such as imports, is done before: not in the event loop."""
        if self._task is not None:
            raise MacromicroError(f"the {self._kind} server runs already")
        self._bound, self.failure = Future(), None
        self._ended.clear()
        _background.submit(self._run())
        try:
            self._bound.result()
        except BaseException:
            self.stop()
            raise

    def stop(self) -> None:
        """End all connections."""
        if self._task is not None:
            _background.call_soon(self._task.cancel)
            if not self._ended.wait(END_S):
                raise MacromicroError(f"the {self._kind} server did not end within {END_S:g} s")
            self._task = None

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    async def _run(self) -> None:
        self._task = asyncio.current_task()
        try:
            await self._serve()
        except asyncio.CancelledError:
            pass
        except BaseException as error:
            self.failure = error
            if not self._bound.done():
                self._bound.set_exception(error)
        finally:
            self._ended.set()


def check_port(port: int) -> None:
    if not 0 <= port <= 65535:
        raise InputError("port", port, "a whole number from 0 (any free one) to 65535")


def listen_error(host: str, port: int, error: OSError) -> InputError:
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
