"""The loop: read, accept, control, guard, write, show, wait; without file or network access."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, cast

from macromicro.control.live import messages as m
from macromicro.serve import faults, requests
from macromicro.serve._machine import Machine, StageView, View
from macromicro.serve._pacing import Pacer
from macromicro.serve.link import Outbox
from macromicro.serve.persist import Evident, Kept, restore
from macromicro.serve.requests import Order
from macromicro.serve.settings import ServeSettings
from macromicro.serve.shared import EMERGENCY, POINT, SAFE_SINCE, SEEN, Shared, Vitals, telemetry
from macromicro.types import SAFE, Command, Sample

PERIODS = 5  # without a value that count as silence


class Silence:
    """Watches the laser, if `present`."""

    def __init__(self, present: bool) -> None:
        self._present = present
        self._missing = 0

    def look(self, laser: float, time: float) -> m.Event | None:
        """The event of this reading: laser lost or back."""
        if not math.isnan(laser):
            was, self._missing = self._missing, 0
            if was < PERIODS or not self._present:
                return None
            return m.Event(time, "sensor", "", "", "laser back", {"silent_periods": was})
        self._missing += 1
        if self._missing != PERIODS or not self._present:
            return None
        words = "the position is now known to half a count only; the laser's column is empty"
        remedy = "clear its beam and check its controller; zero it again before use"
        return m.Event(time, "sensor", "", "", "laser lost", {"effect": words, "remedy": remedy})


if TYPE_CHECKING:
    from macromicro.rig import guarded
    from macromicro.serve._machine import Guard
    from macromicro.serve.stage import rig as stage_rig

Witness = Callable[[Sample], Evident]

ORDERED, ORPHANED = "ordered", "orphaned"


class Loop:
    """The loop around an opened rig."""

    def __init__(
        self,
        rig: Guard,
        machine: Machine,
        shared: Shared,
        outbox: Outbox,
        settings: ServeSettings,
        dt: float,
        paced: bool,
        timed: bool = False,
    ) -> None:
        self.pacer = Pacer(dt, round(settings.miss_window / dt))
        self.orphaned = False  # set by a signal handler when the serving process dies
        self._rig, self._machine = rig, machine
        self._shared, self._cells = shared, shared.cells
        self._outbox = outbox
        self._settings = settings
        self._dt, self._paced, self._timed = dt, paced, timed
        self._lines: Callable[[], Sequence[float]] = getattr(rig, "lines", _nothing)
        self._lamps: Callable[[], Sequence[Sequence[float]]] = getattr(rig, "lamps", _nothing)
        self._views: Callable[[], Sequence[StageView]] = getattr(machine, "views", _nothing)
        # A law that runs beside the rig tells itself what it remembers, before one of the machine.
        told = getattr(rig, "own", None) or getattr(machine, "own", None)
        self._own: Callable[[], Sequence[float] | None] = told or _nothing
        # Stages' laws give the outputs by themselves; the two-stage machine gives its own.
        self._driving = cast("stage_rig.Guarded", rig) if hasattr(rig, "drive") else None
        self._direct = None if self._driving else cast("guarded.Guarded", rig)
        self._laser = Silence("laser" in rig.channels)
        self._emergency = self._commands = self._heartbeat = self._renewed = self._point = 0
        self._heard = time.monotonic()
        self.silence = 0.0  # s, of the serving process, where that was the end
        self._fault = (0.0, 0.0, 0.0, 0.0)
        self._now = math.nan  # of the sample of this period, s
        self._replies: list[tuple[int, m.Reply]] = []  # of this period

    def run(self, kept: Kept | str, rig_name: str, witness: Witness) -> str:
        """Loop until ordered to leave or until the serving process is dead; which of them."""
        first = self._rig.read()
        readings = getattr(self._machine, "readings", lambda: (first.encoder,))
        count, *others = readings()
        restored = restore(kept, rig_name, count, witness(first), others)
        self._machine.begin(first, restored)
        self._outbox.send(("begun", restored))
        self.pacer.start()
        self._heard = time.monotonic()
        began = self._rig.clock.now()
        sample: Sample | None = first
        while True:
            ending = self._tick(self._rig.read() if sample is None else sample)
            if ending:
                self._rig.stop()
                return ending
            sample = None
            if self._paced:
                done = time.monotonic()
                self._pass()
                now = self._rig.clock.now() if self._timed else math.nan
                missed = self.pacer.begun(done, now - began)
                began = now
            else:
                self._pass()
                missed = self.pacer.wait()
            if missed:
                self._judge()

    def rehearse(self, requests: Sequence[tuple[Any, int]]) -> None:
        """Run every request and its periods without waiting, on a bench of its own."""
        for request, periods in requests:
            order = Order(0, request, time.monotonic_ns(), 2**63 - 1)
            self._handle(order._replace(trial=True))
            self._handle(order)
            for _ in range(periods):
                self._tick(self._rig.read())
                self._pass()
                self._heard = time.monotonic()
        self._halt(0)

    def _pass(self) -> None:
        """The rest of the period: laws and guards on the set points, or the rig's clock alone."""
        if self._driving is None:
            self._rig.clock.wait(self._dt)
        else:
            self._driving.drive(self._machine.courses)

    def _flags(self) -> list[int]:
        flags: list[int] = self._cells[EMERGENCY : POINT + 1].tolist()
        return flags

    def _tick(self, sample: Sample) -> str:
        """One period; why it was the last, or ""."""
        emergency, commands, heartbeat, leave, renewed, point = self._flags()
        halted = emergency != self._emergency
        if halted:
            self._halt(emergency)
        now = time.monotonic()
        if heartbeat != self._heartbeat:
            self._heartbeat, self._heard = heartbeat, now
        elif now - self._heard > self._settings.parent_timeout:
            self.silence = now - self._heard
            return ORPHANED
        if leave or self.orphaned:
            return ORDERED if leave else ORPHANED
        self._hear(commands, renewed, point)
        self._now = sample.t
        command, requested, notices = self._machine.step(sample, self._dt)
        if self._direct is not None:
            self._direct.expect(command)
            self._direct.write(SAFE if halted or self._fault[0] else requested)
        found = self._machine.found()
        if found is not None and not self._fault[0]:
            self._fault = (float(faults.LOST_COUNTS), *found, sample.t)
        if self._rig.tripped and not self._fault[0]:
            self._fault = self._rig.evidence()
            fault, blind = self._rig.fault()
            notices += self._machine.fail(fault.name, {"evidence": fault.evidence}, blind)
        notices += self._machine.doubt(self._rig.doubt)
        if self._fault[0]:
            notices += self._overlooked()
        laser = self._laser.look(sample.laser, sample.t)
        if laser is not None:
            notices += (laser,)
        self._show(sample, command)  # before the notices, whose readers may ask for the fault
        self._report(notices)
        for serial, reply in self._replies:  # last: the reader of a reply can see its effect
            self._outbox.send(("reply", serial, reply))
        self._replies.clear()
        self._outbox.flush()
        return ""

    def _hear(self, commands: int, renewed: int, point: int) -> None:
        """Take the orders, signs of life and set points that have come."""
        if renewed != self._renewed:
            self._renewed = renewed
            self._machine.renew()
        if point != self._point:  # before orders: the last one of a motion comes before its end
            self._follow(point)
        while commands != self._commands:
            self._commands += 1
            self._take()

    def _halt(self, stamp: int) -> None:
        """Emergency stop: outputs safe first."""
        fan = self._rig.given.fan
        self._rig.stop()
        self._cells[SAFE_SINCE] = time.monotonic_ns()
        self._cells[SEEN] = stamp
        self._emergency = stamp
        _, notices = self._machine.accept(m.EmergencyStop())
        if fan and not notices:  # disabled already: what has changed is reported all the same
            mode = m.MODES[int(self._machine.view().mode)]
            facts = {"on": False, "client": ""}
            notices = (m.Event(self._rig.clock.now(), "fan", mode, mode, "emergency stop", facts),)
        self._report(notices)

    def _report(self, notices: Iterable[m.Notice]) -> None:
        """Send the events of this period."""
        for notice in notices:
            ended = isinstance(notice, m.Finished)
            told = notice._replace(time=self._now) if ended else notice
            self._outbox.send(("notice", told))

    def _follow(self, turn: int) -> None:
        """Hand the newest streamed set point to the machine."""
        found = self._shared.point(turn)
        if found is not None:
            self._point = turn
            point, at = found
            age = 1e-9 * (time.monotonic_ns() - at)
            self._report(self._machine.heard(point, age))

    def _take(self) -> None:
        order = self._outbox.receive()
        if order is not None:
            self._handle(order)

    def _handle(self, order: Order) -> None:
        refusal = requests.void(order, self._emergency, time.monotonic_ns())
        if refusal is None and not order.trial:
            self._answer(order.serial, order.request)
            return
        try:
            reply = refusal or self._machine.refusal(order.request) or m.Accepted()
        except Exception as error:
            reply = _defect(error)
        self._replies.append((order.serial, reply))

    def _answer(self, serial: int, request: Any) -> None:
        if isinstance(request, m.EmergencyStop):
            self._rig.stop()
        if isinstance(request, m.ClearFault):
            if self._fault[0]:  # renewing the guard for nothing would outwit its timers
                self._renew()
            request = request._replace(gone=True)
        try:
            reply, notices = self._machine.accept(request)
        except Exception as error:  # a defect: it must not take the machine with it
            reply, notices = _defect(error), ()
        self._replies.append((serial, reply))
        self._report(notices)

    def _renew(self) -> None:
        self._rig.renew()
        self._fault = (0.0, 0.0, 0.0, 0.0)
        self.pacer.forget()

    def _overlooked(self) -> tuple[m.Notice, ...]:
        """Handle counts that may have been missed while a fault is latched."""
        why = self._rig.overlooked()
        return self._machine.lose(why) if why else ()

    def _judge(self) -> None:
        """Trip if too many periods were missed."""
        share, limit = self.pacer.share, self._settings.miss_share
        if share <= limit or limit >= 1.0 or self._fault[0]:
            return
        self._rig.stop()
        now = float(self._rig.clock.now())
        self._fault = (float(faults.LATE), share, limit, now)
        self._shared.set_status(self._status(self._machine.view(), self._views()))
        trouble = faults.describe(faults.LATE, share, limit, now)
        self._report(self._machine.fail(trouble.name, {"evidence": trouble.evidence}, False))

    def _show(self, sample: Sample, command: Command) -> None:
        """Telemetry and status of this period."""
        rig, pacer, view = self._rig, self.pacer, self._machine.view()
        vitals = Vitals(rig.temperature, self._fault[0], pacer.late, pacer.worked)
        views = self._views()
        row = telemetry(sample, command, rig.given, view, vitals)
        row.extend(self._lines())
        for each in views[1:]:
            row.extend(each.row())
        row.extend(self._own() or ())
        self._shared.show(row, self._status(view, views))

    def _status(self, view: View, views: Sequence[StageView]) -> list[float]:
        pacer = self.pacer
        status = [
            pacer.periods,
            pacer.missed,
            pacer.share,
            pacer.latest,
            pacer.longest,
            *self._fault,
            view.offset,
            *view.limits,
            view.target,
        ]
        stages: Sequence[Any] = views or (view,)
        for each, lamps in zip(stages, self._lamps(), strict=False):
            status += (each.offset, each.target, *lamps)
        return status


def _nothing() -> tuple[Any, ...]:
    return ()


def _defect(error: Exception) -> m.Refused:
    """The answer to a request that raised an error; the state is unchanged."""
    return m.Refused(f"it cannot be judged: {type(error).__name__}: {error}"[:300], "report this")
