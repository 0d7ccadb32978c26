"""What GCS keeps of a client: its last error, its motion, where its traces begin."""

from __future__ import annotations

import threading
from typing import Any

from macromicro.control.live import messages as m
from macromicro.control.live.messages import DONE, Refused
from macromicro.serve.client import Client, Entry
from macromicro.serve.gcs import errors
from macromicro.serve.gcs.errors import GcsError
from macromicro.serve.instrument import Instrument

NEVER = 1 << 60  # a row that has not come: nothing is copied
MOST = 10_000  # rows that a table holds
_OFF = (m.MODES[m.DISABLED], m.MODES[m.FAULT], "off")


class Session(Client):
    """State of one connection. `axes`: "1", or "X" and "Y" of a machine of two."""

    def __init__(self, instrument: Instrument, name: str, address: str = "127.0.0.1") -> None:
        super().__init__(instrument, name, address)
        two = set(m.AXES) <= set(self.station.stages)
        self.axes: tuple[str, ...] = tuple(a.upper() for a in m.AXES) if two else ("1",)
        self.motion, self.homing, self.arrived = 0, False, True
        self._stopping = False  # it is being stopped by this client
        self.began = -1  # row of telemetry at which the traces begin
        self.rate = 1  # rows of telemetry for each of a table
        self._error, self._noting = 0, threading.Lock()

    # Errors

    def fail(self, number: int) -> None:
        """Keep an error until ERR? asks; the first one stays."""
        with self._noting:
            self._error = self._error or number

    def error(self) -> int:
        """The error since the last time, forgotten by that."""
        self.poll()
        with self._noting:
            found, self._error = self._error, 0
        return found

    # Motions

    def poll(self) -> bool:
        """Is a motion of this client under way? One that has ended otherwise than done is an
        error."""
        if not self.motion:
            return False
        running = self.station.snapshot().running
        end = self.station.finished(self.motion, 0.0)
        if end is None and running:
            return True
        outcome = m.FAULTED if end is None else end.outcome
        wanted = (DONE, m.STOPPED_BY_REQUEST) if self._stopping else (DONE,)
        self.motion, self.arrived = 0, outcome in wanted
        if not self.arrived:
            self.fail(errors.ended(outcome, homing=self.homing))
        return False

    def halt(self) -> None:
        """Stop, which this command set calls an error of its own; waits for nothing."""
        self._stopping = True
        self.stop()
        self.fail(errors.STOPPED)

    def on_target(self) -> bool:
        """Has this client's last motion arrived, and does nothing move or hold it off since?"""
        moving = self.poll()
        now = self.station.snapshot()
        return not moving and self.arrived and not now.motion and now.mode not in _OFF

    @property
    def servo(self) -> bool:
        """Is the machine enabled?"""
        return self.station.snapshot().mode not in _OFF

    def order(self, request: m.Request, entry: Entry[Any]) -> int:
        """Pass a request on, taking control where it is free; the number of the motion it began,
        or 0. Raises GcsError where it is refused."""
        if not self.authenticated:
            raise GcsError(errors.PASSWORD, "the token is missing: CCL 1 TOKEN")
        reply: m.Reply = m.Accepted()
        if self.station.holder != self.name:
            reply = self.station.acquire(self.name)
        if not isinstance(reply, Refused):
            reply = self.request(request, entry)
        if isinstance(reply, Refused):
            raise errors.refused(reply, self.station.snapshot(), self.name)
        return reply.id

    def move(self, request: m.Request, entry: Entry[Any]) -> None:
        """Begin a motion; the traces begin with it."""
        began = self._newest()
        motion = self.order(request, entry)
        # One that it supersedes ends as this client wants it to.
        self.motion, self.arrived, self.began = motion, not motion, began
        self._stopping = False
        self.homing = isinstance(request, m.Home)

    def _newest(self) -> int:
        """Number of the newest row of telemetry."""
        last, _, _ = self.station.telemetry(NEVER)
        return last
