"""Moves of two axes that are asked for together: one straight line, not one after the other."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

from macromicro.control.live import messages as m

GATHER_S = 0.05  # in which a scan that sets both at once has asked for both
Move = Callable[[str, m.Request, int], Awaitable[None]]


class Gathering:
    """Moves of the axes of a machine of two.

    The first one waits a moment for the other axis'; what has been asked for by then is one
    request. `asked`: the number of what is asked for now; `move`: moves, in turn with other
    motions, to the end: what moves, the request, and the number of when it was asked for.
    """

    def __init__(self, asked: Callable[[], int], move: Move) -> None:
        self._asked, self._move = asked, move
        self._goals: dict[str, float] = {}  # of what is being gathered, m
        self._task: asyncio.Task[None] | None = None

    async def go(self, axis: str, goal: float) -> None:
        """Move an axis to a place [m], and return at the end. Raises what `move` raises."""
        if self._task is None or axis in self._goals:
            self._goals = {}
            self._task = asyncio.create_task(self._begin(self._goals, self._asked()))
        self._goals[axis] = goal
        # One that gives up waiting takes nothing from the other one.
        await asyncio.shield(self._task)

    def close(self) -> None:
        """Nothing joins what has been asked for so far: a stop came, or it begins."""
        self._goals, self._task = {}, None

    async def _begin(self, goals: dict[str, float], asked: int) -> None:
        await asyncio.sleep(GATHER_S)
        if self._goals is goals:
            self.close()
        if len(goals) == len(m.AXES):
            x, y = (goals[axis] for axis in m.AXES)
            await self._move("both", m.MovePoint(x, y), asked)
            return
        ((axis, goal),) = goals.items()
        await self._move(axis, m.MoveAxis(axis, goal), asked)
