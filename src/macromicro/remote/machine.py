"""The synchronous client."""

from __future__ import annotations

import asyncio
import os
import threading
from collections.abc import Callable, Coroutine, Iterator
from concurrent import futures
from typing import Any, Self, TypeVar

from macromicro.remote._client import Client
from macromicro.remote._state import State, Traces
from macromicro.remote.asynchronous import AsyncMachine, AsyncMotion
from macromicro.remote.capturing import Capture
from macromicro.remote.failures import ConnectionLost
from macromicro.remote.following import AsyncStream, Stream
from macromicro.serve.hosts import HOST, WEB_PORT

T = TypeVar("T")
ALIVE_S = 1.0  # between looks whether the connection's thread is alive


class Motion:
    """A motion that has begun. `number`: the server's; `words`: what was asked for."""

    def __init__(self, machine: Machine, inner: AsyncMotion) -> None:
        self._machine, self._inner = machine, inner
        self.number, self.words = inner.number, inner.words

    def wait(self, timeout: float | None = None) -> dict[str, Any]:
        """Wait for its end.

        Parameters
        ----------
        timeout : float | None, optional
            Longest wait, s; the motion goes on after it.

        Returns
        -------
        dict[str, Any]
            How it ended: `outcome`, `position`, `uncertainty`, `evidence`.

        Raises
        ------
        MotionFailed
            It failed.
        ConnectionLost
            The server no longer answers.
        TimeoutError
            It is still under way.
        """
        return self._machine.run(asyncio.wait_for(self._inner.wait(), timeout))


class Machine(Client[Motion, None, Capture]):
    """A served machine; a context manager that at its end stops what it moves.

    What waits (a move, homing) also stops the machine where it is interrupted by Ctrl-C. The
    connection lives in a thread of its own; methods may be called from any thread.

    Parameters
    ----------
    inner : AsyncMachine
        What it drives, not yet open.
    """

    def __init__(self, inner: AsyncMachine) -> None:
        self._inner, self.link = inner, inner.link
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(
            target=self._loop.run_forever, name="macromicro client", daemon=True
        )
        self._thread.start()
        try:
            self.run(inner.open())
        except BaseException:
            self._end()
            raise

    @property
    def state(self) -> State:
        """The machine now, asked of the server."""
        return self.run(self._inner.state())

    @property
    def position(self) -> float:
        """Of the whole positioner now, m or rad; NaN where it is not known."""
        return self.state.position

    def ready(self) -> None:
        self.run(self._inner.ready())

    def traces(self, span: float = 10.0) -> Iterator[Traces]:
        shown = self._inner.traces(span)
        try:
            while True:
                yield self.run(anext(shown))  # type: ignore[arg-type]
        finally:
            self.run(shown.aclose())  # type: ignore[attr-defined]

    def save_recording(self, path: str | os.PathLike[str]) -> int:
        return self.run(self._inner.save_recording(path))

    def follow(self, stage: str = "", *, hold: float = 0.1) -> Stream:
        return Stream(self, AsyncStream(self._inner, stage, hold))

    def _capture(self, fields: dict[str, Any]) -> Capture:
        return Capture(self, self.run(self._inner._capture(fields)))

    def close(self) -> None:
        """Stop what this client moves, wait for rest, give control back, disconnect. Does nothing
        where that was done.

        Raises
        ------
        StopNotConfirmed
            The server does not confirm the stop; the connection is closed all the same.
        """
        if self._thread.is_alive():
            try:
                self.run(self._inner.close())
            finally:
                self._end()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def run(self, what: Coroutine[Any, Any, T]) -> T:
        """Do something of the client for asyncio, and wait for it.

        Parameters
        ----------
        what : Coroutine[Any, Any, T]
            One of `AsyncMachine`; cancelled where this is interrupted.

        Returns
        -------
        T
            Its result.

        Raises
        ------
        ConnectionLost
            This client was closed.
        """
        if not self._thread.is_alive():
            what.close()
            raise ConnectionLost("this client was closed", "connect again")
        future = asyncio.run_coroutine_threadsafe(what, self._loop)
        try:
            while not futures.wait([future], ALIVE_S).done:
                if not self._thread.is_alive():  # another thread has closed it meanwhile
                    raise ConnectionLost("this client was closed", "connect again")
            return future.result()
        except BaseException:
            future.cancel()
            raise

    def _soon(self, what: Callable[..., Any], *given: Any) -> None:
        """Call something in the thread of the connection, without waiting for it."""
        self._loop.call_soon_threadsafe(what, *given)

    def _end(self) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def _motion(self, name: str, *args: Any, wait: bool, replace: bool = False) -> Motion:
        begun = self._inner._motion(name, *args, wait=wait, replace=replace)
        return Motion(self, self.run(begun))

    def _order(self, name: str, *args: Any, **fields: Any) -> None:
        self.run(self._inner._order(name, *args, **fields))


def connect(
    host: str = HOST,
    port: int = WEB_PORT,
    *,
    token: str | None = None,
    control: bool = True,
    timeout: float = 10.0,
) -> Machine:
    """Connect to a served machine.

    Parameters
    ----------
    host : str, optional
        Where `macromicro serve` runs.
    port : int, optional
        Of its page.
    token : str | None, optional
        The server's token; by default MACROMICRO_TOKEN, if set.
    control : bool, optional
        Whether to take control; else this client watches, and may stop.
    timeout : float, optional
        Longest wait, s, for the connection, for an answer and, during a motion, for
        a sign of life of the server. A machine that is starting is waited for up to
        two minutes longer.

    Returns
    -------
    Machine
        A context manager that at its end stops what it moves.

    Raises
    ------
    ConnectionLost
        Nobody answers there.
    RequestRefused
        The token is wrong, or another client holds control.

    Examples
    --------
    >>> from macromicro import connect
    >>> connect("127.0.0.1", 1)  # where no machine is served
    Traceback (most recent call last):
        ...
    macromicro.remote.failures.ConnectionLost: ...
    """
    return Machine(AsyncMachine(host, port, token=token, control=control, timeout=timeout))
