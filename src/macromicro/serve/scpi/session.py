"""One client: its errors, its status, its motions, and the doing of its commands."""

from __future__ import annotations

import math
import threading
from typing import Any

from macromicro.control.live.messages import DONE, FAULTED, LIMIT, STALLED, Finished, Refused, Stop
from macromicro.control.supervisor import Plan
from macromicro.errors import InputError, MacromicroError
from macromicro.serve.scpi import status
from macromicro.serve.scpi.command import ALWAYS, CHANGE, CONTROL, WATCH, Answer, Call
from macromicro.serve.scpi.device import Device
from macromicro.serve.scpi.errors import (
    OPERATION_COMPLETE,
    POWER_ON,
    ErrorQueue,
    ScpiError,
    event_bit,
)
from macromicro.serve.scpi.message import Unit
from macromicro.serve.scpi.status import Register
from macromicro.serve.sending import Stops
from macromicro.serve.snapshot import Snapshot

_HARDWARE = (FAULTED, LIMIT, STALLED)


class Session:
    """State of one connection from `address`. Its commands come one after the other, from any
    thread; `emergency` and `stop` may come at the same time.

    Errors, status registers, format and the programme in memory are the connection's own, so
    that no client reads or clears what belongs to another one.
    """

    def __init__(self, device: Device, client: str, address: str = "127.0.0.1") -> None:
        self.device: Device = device
        self.client: str = client
        self.address: str = address
        self.errors: ErrorQueue = ErrorQueue()
        self.events: int = POWER_ON  # standard event status register
        self.event_enable: int = 0
        self.service_enable: int = 0
        self.operation: Register = Register()
        self.questionable: Register = Register()
        self.pending: dict[int, str] = {}
        self.completing = False  # *OPC was given
        self.answered = False  # this message has answered something already
        self.authenticated = device.token.open
        self.failures = 0
        self.watchdog: float = 0.0
        self.format: tuple[str, int] = ("ASC", 0)
        self.swapped: bool = False
        self.programme: tuple[str, Plan] | None = None
        self.running = 0
        self.gone = threading.Event()
        self.stops = 0
        self.since: Stops | None = None  # the station's, when the message under way came
        self.failed = 0  # errors so far
        self._ordering = threading.Lock()
        self._noting = threading.Lock()
        self._told, _ = device.station.events(-1)
        self.event_place = self._told

    # Errors and status

    def fail(self, error: ScpiError) -> None:
        """Queue an error, and set its bit of the standard event status register; that of -350,
        too, where the queue overflows."""
        with self._noting:
            self.failed += 1
            queued = self.errors.put(error)
            self.events |= event_bit(error.number) | event_bit(queued)

    def snapshot(self) -> Snapshot:
        """The machine now; the registers see it."""
        now = self.device.station.snapshot()
        self._told, events = self.device.station.events(self._told)
        with self._noting:
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
        """A motion of this client is under way (0: the request began none)."""
        if motion:
            self.pending[motion] = words

    def ends(self, motion: int) -> None:
        """A motion is coming to its end as this client wants it to, so however it ends is no
        error, unless it was to be done."""
        if motion:
            self.pending.setdefault(motion, "")

    def poll(self) -> bool:
        """Note what motions of this client have ended; True if none is under way any more.

        Each that ended otherwise than done is an error.
        """
        for motion in list(self.pending):
            end = self.device.station.finished(motion, 0.0)
            if end is None and self.device.station.snapshot().running:
                continue
            words = self.pending.pop(motion, "")  # another thread may have told of it
            if not words:
                continue
            if end is None:
                self.fail(ScpiError(-240, f"{words}: the loop process has ended"))
            elif end.outcome != DONE:
                self.fail(ended(end, words))
        if not self.pending and self.completing:
            self.completing = False
            self.events |= OPERATION_COMPLETE
        return not self.pending

    # Doing

    def run(self, unit: Unit) -> Answer:
        """Do one command: its response data, None if it has none. Raises ScpiError only."""
        command = unit.command
        try:
            if command.access != ALWAYS:  # a stop waits for nothing
                self.poll()
            if command.access not in (WATCH, ALWAYS) and not self.authenticated:
                raise ScpiError(-203, "SYSTem:AUTHenticate first")
            return command.act(Call(self, unit.values, unit.suffixes))
        except ScpiError:
            raise
        except InputError as error:
            raise ScpiError(-224, str(error)) from error
        except MacromicroError as error:
            raise ScpiError(-200, str(error)) from error
        except Exception as error:
            raise ScpiError(-310, f"{type(error).__name__}: {error}") from error

    def attempt(self, unit: Unit, stops: int, failed: int) -> Answer:
        """As `run`, but an error goes to the queue. `stops`, `failed`: of this client when
        the message came, and when its first command was begun; what needs control is not done
        behind a later stop, nor behind an error in the same message."""
        access, header = unit.command.access, unit.command.header
        try:
            if access == CONTROL:
                with self._ordering:
                    if self.stops != stops:
                        raise ScpiError(-200, f"{header} not done: it came before a stop")
                    if self.failed != failed:
                        raise ScpiError(-200, f"{header} not done: error before it")
                    return self._unless_gone(unit)
            return self._unless_gone(unit) if access == CHANGE else self.run(unit)
        except ScpiError as error:
            self.fail(error)
            return None

    def _unless_gone(self, unit: Unit) -> Answer:
        if self.gone.is_set():
            raise ScpiError(-200, f"{unit.command.header} not done: the client is gone")
        answer = self.run(unit)
        if self.gone.is_set():  # it went while it was given control, perhaps
            self.device.station.disconnect(self.client)
        return answer

    def order(self, request: Any) -> int:
        """Pass a request on; the number of the motion it began, or 0.

        Raises ScpiError -203 without control, -222 for what is out of range, -221 where the
        machine refuses in its present state, -240 where it does not run.
        """
        reply = self.device.station.request(self.client, request, self.since)
        if not isinstance(reply, Refused):
            return reply.id
        now = self.device.station.snapshot()
        number = -240 if not now.running else -203 if now.holder != self.client else -221
        if reply.beyond:
            number = -222
        raise ScpiError(number, f"{reply.reason}; {reply.remedy}")

    def stop(self) -> None:
        """Decelerate; waits for nothing. An order of this client that is on its way comes
        before it, or is refused because of it."""
        self.stops += 1
        reply = self.device.station.request(self.client, Stop(self.client))
        if isinstance(reply, Refused):
            raise ScpiError(-221, f"{reply.reason}; {reply.remedy}")
        self.ends(self.device.station.snapshot().motion)

    def emergency(self) -> None:
        """Emergency stop; waits for nothing. Raises ScpiError -240 where no loop answers."""
        self.stops += 1
        if math.isnan(self.device.station.emergency(self.client)):
            raise ScpiError(-240, "the loop did not answer; switch the machine's supply off")

    def close(self) -> None:
        """The client is gone. The station does to the machine what a lost client does."""
        if not self.gone.is_set():
            self.gone.set()
            self.device.station.disconnect(self.client)


def ended(end: Finished, words: str) -> ScpiError:
    """The error of a motion that ended otherwise than done."""
    where = f" at {end.position * 1e3:.3f} mm" if abs(end.position) < 1e3 else ""
    number = -240 if end.outcome in _HARDWARE else -200
    return ScpiError(number, f"{words} (motion {end.id}) ended as {end.outcome}{where}")
