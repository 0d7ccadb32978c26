"""Replies, events and ends of motions that the loop has reported; thread-safe."""

from __future__ import annotations

import math
import threading
from collections import deque

from macromicro.control.live.messages import Accepted, Event, Finished, Reply
from macromicro.serve._trail import Trail

EVENTS = 2_000
MOTIONS = 2_000


class Ledger:
    """The last `EVENTS` events, `MOTIONS` ends of motions and awaited replies."""

    def __init__(self, trail: Trail | None = None) -> None:
        self._trail = Trail() if trail is None else trail
        self._time = math.nan
        self._news = threading.Condition()
        self._events: deque[Event] = deque(maxlen=EVENTS)
        self._told = 0
        self._replies: dict[int, Reply | None] = {}
        self._serial = 0
        self._open: set[int] = set()
        self._finished: dict[int, Finished] = {}
        self._closed = True

    def open(self) -> None:
        """A loop begins, which counts its motions from 1."""
        with self._news:
            self._closed = False
            self._open.clear()
            self._finished.clear()
            self._replies.clear()

    def close(self, outcome: str, evidence: str) -> None:
        """End whatever was under way: the loop is gone."""
        with self._news:
            self._closed = True
            for motion in sorted(self._open):
                end = Finished(motion, outcome, math.nan, math.inf, {"cause": evidence})
                self._finished[motion] = end
            self._open.clear()
            self._news.notify_all()

    def serial(self) -> int:
        """A number for a request whose reply will be awaited."""
        with self._news:
            self._serial += 1
            self._replies[self._serial] = None
            return self._serial

    def forget(self, serial: int) -> None:
        """Drop a request that was not sent."""
        with self._news:
            self._replies.pop(serial, None)

    def reply(self, serial: int, reply: Reply) -> None:
        with self._news:
            if isinstance(reply, Accepted) and reply.id and reply.id not in self._finished:
                self._open.add(reply.id)
            if serial in self._replies:
                self._replies[serial] = reply
                self._news.notify_all()

    def await_reply(self, serial: int, timeout: float) -> Reply | None:
        """The reply; None after the timeout or the end of the loop."""
        with self._news:
            self._news.wait_for(
                lambda: self._closed or self._replies.get(serial) is not None, timeout
            )
            return self._replies.pop(serial, None)

    def event(self, event: Event) -> None:
        self._time = event.time
        self._trail.event(event)
        with self._news:
            self._events.append(event)
            self._told += 1
            self._news.notify_all()

    def end(self, finished: Finished) -> None:
        """Note the end of a motion, once."""
        self._trail.end(finished, self._time)
        with self._news:
            self._open.discard(finished.id)
            self._finished.setdefault(finished.id, finished)
            while len(self._finished) > MOTIONS:
                del self._finished[next(iter(self._finished))]
            self._news.notify_all()

    def events(self, since: int) -> tuple[int, list[Event]]:
        """Events after number `since` that are still kept, and the number of the last one."""
        with self._news:
            first = self._told - len(self._events)
            return self._told - 1, list(self._events)[max(since + 1 - first, 0) :]

    def finished(self, motion: int, timeout: float | None) -> Finished | None:
        """How a motion ended; None if it has not in time, or is unknown."""
        with self._news:
            self._news.wait_for(lambda: motion not in self._open, timeout)
            return self._finished.get(motion)
