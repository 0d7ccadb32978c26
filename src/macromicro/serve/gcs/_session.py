"""State of a GCS client: its last error, its motion, the start of its traces."""

from __future__ import annotations

from typing import Any

from macromicro.control.live import messages as m
from macromicro.control.live.messages import DONE, Refused
from macromicro.serve._instrument import Instrument
from macromicro.serve.client import Capacity, Client, Entry
from macromicro.serve.gcs import _errors
from macromicro.serve.gcs._errors import GcsError

NEVER = 1 << 60  # a row that has not come: nothing is copied
MOST = 10_000  # rows that a table holds


class Session(Client):
    """State of one connection; `axes` are "1", or the names of several stages in capitals."""

    def __init__(self, instrument: Instrument, name: str, address: str, capacity: Capacity) -> None:
        super().__init__(instrument, name, address, capacity)
        self.axes: tuple[str, ...] = tuple(a.upper() for a in instrument.axes) or ("1",)
        self.motion, self.homing, self.arrived = 0, False, True
        self._stopping = False  # it is being stopped by this client
        self.began = -1  # row of telemetry at which the traces begin
        self.rate = 1  # rows of telemetry for each of a table
        self._error = 0

    # Errors

    def fail(self, number: int) -> None:
        """Keep the first error until ERR? reads it."""
        self._error = self._error or number

    def error(self) -> int:
        """Read and clear the error."""
        self.poll()
        found, self._error = self._error, 0
        return found

    # Motions

    def poll(self) -> bool:
        """Whether a motion of this client is under way; a failed one sets the error."""
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
            self.fail(_errors.end_code(outcome, homing=self.homing))
        return False

    async def halt(self) -> None:
        """Stop at once; GCS reports this as an error of its own."""
        self._stopping = True
        await self.stop()
        self.fail(_errors.STOPPED)

    def on_target(self) -> bool:
        """Whether this client's last motion has arrived and nothing has moved since."""
        moving = self.poll()
        now = self.station.snapshot()
        return not moving and self.arrived and not now.motion and now.enabled

    @property
    def servo(self) -> bool:
        return self.station.snapshot().enabled

    async def order(self, request: m.Request, entry: Entry[Any]) -> int:
        """Pass a request on, taking control if it is free; the number of the motion, or 0."""
        if not self.authenticated:
            raise GcsError(_errors.PASSWORD, "the token is missing: CCL 1 TOKEN")
        reply = await self.command(request, entry)
        if isinstance(reply, Refused):
            raise _errors.refusal_error(reply, self.station.snapshot(), self.name)
        return reply.id

    async def move(self, request: m.Request, entry: Entry[Any]) -> None:
        """Begin a motion and its traces."""
        began = self._newest()
        motion = await self.order(request, entry)
        # One that it supersedes ends as this client wants it to.
        self.motion, self.arrived, self.began = motion, not motion, began
        self._stopping = False
        self.homing = isinstance(request, m.Home)

    def _newest(self) -> int:
        last, _, _ = self.station.telemetry(NEVER)
        return last
