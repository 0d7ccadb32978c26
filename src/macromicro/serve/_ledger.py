"""Events, ends of motions and the settings in force, as the loop has reported them; their log."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import math
import threading
from collections import deque
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Event, Finished, Refused, Reply
from macromicro.recording_format import Noted
from macromicro.schema.par import entries, replaced
from macromicro.schema.text import printable
from macromicro.serve import _background, telling
from macromicro.serve._background import on_loop
from macromicro.serve.bucket import Bucket

if TYPE_CHECKING:
    from macromicro.serve.settings import AnySettings


LOG = logging.getLogger("macromicro.serve")
LOG.addHandler(logging.NullHandler())
RATE, BURST = 20.0, 500.0  # entries a second that clients may cause, and at once
KEPT = 5000  # entries that wait to be recorded
LONGEST = 300  # characters of a fact
_LEVELS = {"fault": logging.ERROR, "token": logging.WARNING, "foreign": logging.WARNING}
_BAD = ("client lost", "died", "trouble", "not kept", "failed", "lost")


class Trail:
    """Log with rate limits for what clients cause; thread-safe, never waits for a disk."""

    def __init__(self, control: Any = None) -> None:
        self._control = control
        self._lock = threading.Lock()
        self._buckets = {done: Bucket(RATE, BURST) for done in (True, False)}
        self._left_out = 0
        self._waiting: deque[Noted] | None = None

    # What is noted

    def event(self, event: Event) -> None:
        facts = dict(telling.event(event, self._control).evidence)
        who = str(facts.pop("client", ""))
        if event.from_mode != event.to_mode:
            facts = {"from": event.from_mode, "to": event.to_mode, **facts}
        entry = Noted(event.time, event.kind, who, event.cause, facts)
        fault = event.to_mode == m.MODES[m.FAULT] != event.from_mode
        bad = fault or event.kind == "fault" or "reason" in facts or event.cause in _BAD
        self._note(entry, logging.ERROR if fault else logging.WARNING if bad else logging.INFO)

    def end(self, end: Finished, time: float) -> None:
        facts = {"position_m": end.position, **end.evidence}
        fine = end.outcome in (m.DONE, m.STOPPED_BY_REQUEST)
        level = logging.INFO if fine else logging.WARNING
        self._note(Noted(time, "end", "", f"motion {end.id} {end.outcome}", facts), level)

    def order(self, time: float, client: str, request: Any, reply: Reply) -> None:
        facts = {k: _plain(v) for k, v in telling.request(request, self._control).items()}
        if isinstance(reply, Refused):
            facts["refused"] = reply.reason
        elif reply.id:
            facts["motion"] = reply.id
        entry = Noted(time, "order", client, type(request).__name__, facts)
        self._bounded(entry, logging.INFO, done=not isinstance(reply, Refused))

    def client(self, kind: str, who: str, what: str, **facts: Any) -> None:
        """A client came, left, gave a wrong token ("token") or is foreign ("foreign")."""
        level = _LEVELS.get(kind, logging.INFO)
        self._bounded(Noted(float("nan"), kind, who, what, facts), level, done=False)

    # Into a recording

    def begin(self) -> None:
        """Keep entries for `take` from now on."""
        with self._lock:
            self._waiting = deque(maxlen=KEPT)

    def end_recording(self) -> None:
        with self._lock:
            self._waiting = None

    def take(self) -> list[Noted]:
        """Entries since the last call, oldest first."""
        with self._lock:
            if not self._waiting:
                return []
            found, self._waiting = list(self._waiting), deque(maxlen=KEPT)
            return found

    def _bounded(self, entry: Noted, level: int, *, done: bool) -> None:
        with self._lock:
            bucket = self._buckets[done]
            if bucket.spend() > 0.0:
                bucket.spend(-1.0)
                self._left_out += 1
                return
            left_out, self._left_out = self._left_out, 0
        if left_out:
            self._note(Noted(entry.t, "log", "", f"{left_out} entries left out", {}), level)
        self._note(entry, level)

    def _note(self, entry: Noted, level: int) -> None:
        with self._lock:
            if self._waiting is not None:
                self._waiting.append(entry)
        LOG.log(level, "%s", as_line(entry))


def as_line(entry: Noted) -> str:
    """An entry as a printable line."""
    facts = ", ".join(f"{key} {_plain(value)}" for key, value in entry.facts.items())
    who = f" by {entry.who}" if entry.who else ""
    return printable(f"{entry.kind}: {entry.what}{who}" + (f" ({facts})" if facts else ""), 1000)


def _plain(value: Any) -> str | float | int:
    if isinstance(value, bool | int | float):
        return value
    if isinstance(value, Mapping):
        value = ", ".join(f"{key} {item}" for key, item in value.items())
    if type(value).__name__ == "Plan":
        return f"{len(value.target)} moves"
    return printable(value, LONGEST)


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
