"""Events, ends of motions and the settings in force, as the loop has reported them."""

from __future__ import annotations

import asyncio
import contextlib
import math
from collections import deque
from typing import TYPE_CHECKING, Any

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Event, Finished, Reply
from macromicro.schema.par import entries, replaced
from macromicro.serve import _background
from macromicro.serve._background import on_loop
from macromicro.serve._trail import Trail

if TYPE_CHECKING:
    from macromicro.serve.settings import AnySettings


class InForce:
    """The controller's settings, and the maximum speed of moves of each stage."""

    def __init__(self, settings: AnySettings) -> None:
        self._settings = settings
        self.control: Any = settings.controller
        self._speeds: dict[str, float] = settings.facts.speeds

    def speed(self, stage: str) -> float:
        """Maximum speed of moves of a stage [m/s]; NaN if its law sets the speed."""
        return self._speeds.get(stage, math.nan)

    def follow(self, event: Event) -> None:
        """Take over what an event has changed."""
        if event.kind == "loop" and event.cause == "started":
            self.control, self._speeds = self._settings.controller, self._settings.facts.speeds
        elif event.kind == "gains":
            known = {e.path for e in entries(self.control)}
            for path, change in event.evidence.items():
                if path in known:
                    self.control = replaced(self.control, path, change["new"])
        elif event.kind == "speed":
            self._speeds = {s: _speed(s, v, event.evidence) for s, v in self._speeds.items()}


def _speed(stage: str, before: float, evidence: dict[str, Any]) -> float:
    prefix = "" if stage == m.MACRO else f"{stage}_"
    for unit in ("m", "rad"):
        before = evidence.get(f"{prefix}speed_{unit}_per_s", before)
    return before


EVENTS = 2_000
MOTIONS = 2_000


class Ledger:
    """The last `EVENTS` events and `MOTIONS` ends of motions; belongs to the servers' loop."""

    def __init__(self, trail: Trail, in_force: InForce) -> None:
        self._trail, self.in_force = trail, in_force
        self._time = math.nan
        self._news = asyncio.Event()
        self._events: deque[Event] = deque(maxlen=EVENTS)
        self._told = 0
        self._open: set[int] = set()
        self._finished: dict[int, Finished] = {}

    def open(self) -> None:
        """A loop begins, which counts its motions from 1."""
        self._open.clear()
        self._finished.clear()

    def close(self, outcome: str, evidence: str) -> None:
        """End whatever was under way: the loop is gone."""
        for motion in sorted(self._open):
            end = Finished(motion, outcome, math.nan, math.inf, {"cause": evidence})
            self._finished[motion] = end
        self._open.clear()
        self.wake()

    def replied(self, reply: Reply) -> None:
        """Note the motion that a reply has begun."""
        if isinstance(reply, Accepted) and reply.id and reply.id not in self._finished:
            self._open.add(reply.id)

    @on_loop
    def event(self, event: Event) -> None:
        self._time = event.time
        self._trail.event(event)
        self.in_force.follow(event)
        self._events.append(event)
        self._told += 1
        self.wake()

    def end(self, finished: Finished) -> None:
        """Note the end of a motion, once."""
        self._trail.end(finished, self._time)
        self._open.discard(finished.id)
        self._finished.setdefault(finished.id, finished)
        while len(self._finished) > MOTIONS:
            del self._finished[next(iter(self._finished))]
        self.wake()

    def wake(self) -> None:
        """Let all look who wait for news."""
        self._news.set()
        self._news.clear()

    async def news(self) -> None:
        """Wait for the next event, end of a motion or end of the loop."""
        await self._news.wait()

    @on_loop
    def events(self, since: int) -> tuple[int, list[Event]]:
        """Events after number `since` that are still kept, and the number of the last one."""
        first = self._told - len(self._events)
        return self._told - 1, list(self._events)[max(since + 1 - first, 0) :]

    def finished(self, motion: int) -> Finished | None:
        """How a motion ended; None if it has not, or is unknown."""
        return self._finished.get(motion)

    def awaited(self, motion: int, timeout: float | None) -> Finished | None:
        """As `finished`, waiting for the end of a motion under way; from another thread."""
        return _background.call(self._awaited(motion, timeout))

    async def _awaited(self, motion: int, timeout: float | None) -> Finished | None:
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(timeout):
                while motion in self._open:
                    await self.news()
        return self.finished(motion)
