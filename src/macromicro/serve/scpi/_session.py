"""State of an SCPI client: errors, status, motions."""

from __future__ import annotations

from typing import Any

from macromicro.control.live import messages as m
from macromicro.control.live.messages import DONE, FAULTED, LIMIT, STALLED, Finished, Refused
from macromicro.control.supervisor import Plan
from macromicro.place import LENGTH, Place
from macromicro.serve._instrument import Instrument
from macromicro.serve.capturing import Wanted
from macromicro.serve.client import Capacity, Client, Entry
from macromicro.serve.scpi import status
from macromicro.serve.scpi.errors import (
    OPERATION_COMPLETE,
    POWER_ON,
    ErrorQueue,
    ScpiError,
    event_bit,
)
from macromicro.serve.scpi.status import Register
from macromicro.serve.snapshot import Snapshot

_HARDWARE = (FAULTED, LIMIT, STALLED)


class Session(Client):
    """State of one connection: its errors, status registers, format and programme memory."""

    def __init__(self, instrument: Instrument, name: str, address: str, capacity: Capacity) -> None:
        super().__init__(instrument, name, address, capacity)
        self.errors: ErrorQueue = ErrorQueue()
        self.events: int = POWER_ON  # standard event status register
        self.event_enable: int = 0
        self.service_enable: int = 0
        self.operation: Register = Register()
        self.questionable: Register = Register()
        self.pending: dict[int, str] = {}
        self.completing = False  # *OPC was given
        self.answered = False  # this message has answered something already
        self.format: tuple[str, int] = ("ASC", 0)
        self.swapped: bool = False
        self.programme: tuple[str, Plan] | None = None
        self.wanted = Wanted(())  # the capture that CAPTure:STARt begins
        self.running = 0
        self.failed = 0  # errors so far
        self.entry: Entry[Any] | None = None  # the message under way, as it waited
        self._told, _ = self.station.events(-1)
        self.event_place = self._told

    # Errors and status

    def fail(self, error: ScpiError) -> None:
        """Queue an error and set its bit of the standard event status register."""
        self.failed += 1
        queued = self.errors.put(error)
        self.events |= event_bit(error.number) | event_bit(queued)

    def snapshot(self) -> Snapshot:
        """The machine now, also seen by the status registers."""
        now = self.station.snapshot()
        self._told, events = self.station.events(self._told)
        recording = self.operation.condition & (1 << 12)
        for event in events:  # modes that came and went between two looks
            if event.kind == "mode":
                self.operation.see(status.of_mode(event.to_mode) | recording)
        self.operation.see(status.operation(now))
        self.questionable.see(status.questionable(now))
        return now

    def status_byte(self) -> int:
        """As *STB? answers it (IEEE 488.2, 11.2), bit 6 the master summary."""
        byte = status.ERRORS if len(self.errors) else 0
        byte |= status.QUESTIONABLE if self.questionable.summary else 0
        byte |= status.MESSAGE if self.answered else 0
        byte |= status.EVENT if self.events & self.event_enable else 0
        byte |= status.OPERATION if self.operation.summary else 0
        return byte | (status.MASTER if byte & self.service_enable else 0)

    # Motions

    def began(self, motion: int, words: str) -> None:
        """Note a motion of this client (0: none)."""
        if motion:
            self.pending[motion] = words

    def ends(self, motion: int) -> None:
        """Note that this client ends the motion itself, so that its end is no error."""
        if motion:
            self.pending.setdefault(motion, "")

    def poll(self) -> bool:
        """Note ended motions, with an error for each failure; True if none is under way."""
        for motion in list(self.pending):
            end = self.station.finished(motion, 0.0)
            if end is None and self.station.snapshot().running:
                continue
            words = self.pending.pop(motion)
            if not words:
                continue
            if end is None:
                self.fail(ScpiError(-240, f"{words}: the loop process has ended"))
            elif end.outcome != DONE:
                self.fail(motion_error(end, words, self.instrument.place))
        if not self.pending and self.completing:
            self.completing = False
            self.events |= OPERATION_COMPLETE
        return not self.pending

    # Orders

    async def order(self, request: m.Request) -> int:
        """Pass a request on; the motion's number, or 0. Raises ScpiError -203, -221, -222, -240."""
        reply = await self.request(request, self.entry)
        if not isinstance(reply, Refused):
            return reply.id
        now = self.station.snapshot()
        number = -240 if not now.running else -203 if now.holder != self.name else -221
        if reply.beyond:
            number = -222
        raise ScpiError(number, f"{reply.reason}; {reply.remedy}")


def motion_error(end: Finished, words: str, place: Place = LENGTH) -> ScpiError:
    """The error of a failed motion."""
    told = f" at {end.position * place.per:.3f} {place.unit}"
    where = told if abs(end.position) < 1e3 else ""
    number = -240 if end.outcome in _HARDWARE else -200
    return ScpiError(number, f"{words} (motion {end.id}) ended as {end.outcome}{where}")
