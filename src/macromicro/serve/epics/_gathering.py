"""Joins simultaneous moves of several stages into one straight line."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

from macromicro.control.live import messages as m

GATHER_S = 0.05  # s within which a scan that moves several stages has set them
Move = Callable[[str, m.Request, int], Awaitable[None]]


class Gathering:
    """Combines moves of stages that arrive within a moment into one straight-line move."""

    def __init__(self, asked: Callable[[], int], move: Move) -> None:
        self._asked, self._move = asked, move
        self._goals: dict[str, float] = {}  # of what is being gathered, m
        self._task: asyncio.Task[None] | None = None

    async def go(self, axis: str, goal: float) -> None:
        """Move an axis to a place [m] and return at the end."""
        if self._task is None or axis in self._goals:
            self._goals = {}
            self._task = asyncio.create_task(self._begin(self._goals, self._asked()))
        self._goals[axis] = goal
        # One that gives up waiting takes nothing from the other one.
        await asyncio.shield(self._task)

    def close(self) -> None:
        """Let no further move join those pending."""
        self._goals, self._task = {}, None

    async def _begin(self, goals: dict[str, float], asked: int) -> None:
        await asyncio.sleep(GATHER_S)
        if self._goals is goals:
            self.close()
        if len(goals) > 1:
            await self._move("together", m.MovePoint(goals), asked)
            return
        ((axis, goal),) = goals.items()
        await self._move(axis, m.MoveAxis(axis, goal), asked)
