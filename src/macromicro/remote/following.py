"""Set points streamed to a machine that follows them."""

from __future__ import annotations

import asyncio
import contextlib
import time
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any, Self

from macromicro.control.live.messages import ALL
from macromicro.remote import _orders
from macromicro.remote.failures import RequestError, RequestRefused
from macromicro.serve.requests import stream_requests

if TYPE_CHECKING:
    from macromicro.remote.asynchronous import AsyncMachine, AsyncMotion
    from macromicro.remote.machine import Machine, Motion

Values = float | str | tuple[float | str, ...]


class SetPoints(ABC):
    """What both streams take."""

    @abstractmethod
    def put(self, position: Values, velocity: Values | None = None) -> None:
        """Send a set point; it goes on with its velocity until the next one.

        One that is put before the last one has been sent takes its place.

        Parameters
        ----------
        position : Values
            Position in base units, or as text with a unit; of all axes a tuple.
        velocity : Values | None, optional
            Velocity in base units per second, or as text; 0 by default.

        Raises
        ------
        MotionFailed
            The motion has ended: as lost where no set point came in time.
        InputError
            It is no position.
        """


class AsyncStream(SetPoints):
    """Set points of one motion; `async with` begins it and ends it at the last set point."""

    def __init__(self, machine: AsyncMachine, stage: str, hold: float) -> None:
        self._machine, self._hold = machine, hold
        stages = machine.about["stages"]
        axes = _orders.axes_of(machine.about)
        self._stage = stage or (ALL if axes else stages[0])
        self._kind = stream_requests(axes)["points" if self._stage == ALL else "point"]
        self._newest: dict[str, Any] | None = None
        self._wake = asyncio.Event()
        self._tasks: list[asyncio.Task[Any]] = []
        self.motion: AsyncMotion

    async def __aenter__(self) -> Self:
        machine = self._machine
        self.motion = await machine._motion("follow", self._stage, self._hold, wait=False)
        self._tasks = [asyncio.create_task(each) for each in (self.motion.wait(), self._send())]
        return self

    async def __aexit__(self, kind: type[BaseException] | None, *_: object) -> None:
        over, sending = self._tasks
        try:
            if kind is not None:
                if not over.done():
                    await asyncio.shield(self._machine.stop())
                return
            while self._newest is not None and not sending.done():
                await asyncio.sleep(0.0)
            with contextlib.suppress(RequestRefused):  # its motion has ended, which `over` tells
                await self._machine.link.order("end follow")
            await over
        finally:
            for task in self._tasks:
                task.cancel()
            await asyncio.gather(*self._tasks, return_exceptions=True)

    def put(self, position: Values, velocity: Values | None = None) -> None:
        self._take(self._message(position, velocity))

    def _message(self, position: Values, velocity: Values | None = None) -> dict[str, Any]:
        """A set point with its time."""
        over = self._tasks[0]
        if over.done():
            over.result()
            raise RequestRefused("the motion has ended", "follow again")
        values = position if isinstance(position, tuple) else (position,)
        speeds = velocity if isinstance(velocity, tuple) else (velocity,)
        if velocity is not None:
            values = (*values, *speeds)
        kind, place = self._kind, self._machine.place
        order = _orders.order(kind, _orders.check(kind, values, place), place)
        return {"do": kind.name, "time": time.monotonic(), **order}

    def _take(self, message: dict[str, Any]) -> None:
        """Send a message as soon as the link is free."""
        self._newest = message
        self._wake.set()

    async def _send(self) -> None:
        with contextlib.suppress(RequestError):  # a lost connection ends the motion's wait
            while True:
                await self._wake.wait()
                self._wake.clear()
                if self._newest is not None:
                    message, self._newest = self._newest, None
                    await self._machine.link.tell(message)


class Stream(SetPoints):
    """Set points of one motion; `with` begins it and ends it at the last set point."""

    def __init__(self, machine: Machine, inner: AsyncStream) -> None:
        self._machine, self._inner = machine, inner

    @property
    def motion(self) -> Motion:
        """The motion that follows; its `wait` tells how it has ended."""
        from macromicro.remote.machine import Motion

        return Motion(self._machine, self._inner.motion)

    def __enter__(self) -> Self:
        self._machine.run(self._inner.__aenter__())
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._machine.run(self._inner.__aexit__(kind))

    def put(self, position: Values, velocity: Values | None = None) -> None:
        message = self._inner._message(position, velocity)
        self._machine._soon(self._inner._take, message)
