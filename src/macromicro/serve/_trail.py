"""Log of orders and their results, also for the recording under way."""

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Mapping
from typing import Any

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Event, Finished, Refused, Reply
from macromicro.recording_format import Noted
from macromicro.schema.text import printable
from macromicro.serve import telling
from macromicro.serve.bucket import Bucket

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
        LOG.log(level, "%s", shown(entry))


def shown(entry: Noted) -> str:
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
