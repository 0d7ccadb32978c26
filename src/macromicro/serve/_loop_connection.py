"""The connection to one loop process at a time."""

from __future__ import annotations

import asyncio
import contextlib
import math
import os
import socket
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from macromicro.control.live import alone
from macromicro.control.live import messages as m
from macromicro.control.live.messages import Event, Finished
from macromicro.errors import MacromicroError
from macromicro.serve import _background, _safing, _watching, faults, link, persist
from macromicro.serve._background import in_thread
from macromicro.serve._launching import Child, Spec, launch
from macromicro.serve._ledger import LOG, InForce, Ledger, Trail
from macromicro.serve._machine import Point
from macromicro.serve._sending import Sender
from macromicro.serve.persist import PositionStore, Shown
from macromicro.serve.settings import AnySettings
from macromicro.serve.shared import HEARTBEAT, LEAVE, RENEWED, WRITTEN, Shared
from macromicro.serve.snapshot import Trouble

LOOKS = 10  # in the time that is allowed


class Pulse:
    """Measures silence by its own looks, so that a halt of this process does not count."""

    def __init__(self, allowed: float, count: int, now: float) -> None:
        self.pause = allowed / LOOKS
        self._count, self._looked = count, now
        self.silent = 0.0

    def look(self, count: int, now: float) -> float:
        """Silence at the time `now`, with the loop's period count."""
        passed = min(now - self._looked, 2.0 * self.pause)
        self._looked = now
        self.silent = self.silent + passed if count == self._count else 0.0
        self._count = count
        return self.silent


END_S = 3.0
LOOK_S = 0.5  # between looks whether a process that says nothing has ended


class LoopConnection:
    """The serving process' side. `start`, `stop` and `reopen` block: not for the event loop."""

    def __init__(
        self, rig: str, seed: int, settings: AnySettings, state: Path | None, machine: str
    ) -> None:
        self._path = state or persist.default_path(settings.place(rig))
        self._rig, self._seed, self._settings, self._machine = rig, seed, settings, machine
        self.shared: Shared | None = None
        self.trail = Trail(settings.controller)
        self.ledger = Ledger(self.trail, InForce(settings))
        self.trouble: Trouble | None = None
        self.trust = "not started"
        self.realtime = ""
        self.running = False
        self.switched_off = True  # was that the last order to the rig, and did it return?
        self.ended: Callable[[str], None] = lambda reason: None  # called in a thread at the end
        self._leaving = False
        self._left: str | None = None  # what became of the rig's stop, by the loop process
        self._how = ""  # how a loop that did not end by itself was ended
        self.stages: tuple[str, ...] = m.STAGES
        self.channels: tuple[str, ...] = ()
        self._child: Child | None = None
        self._store: PositionStore | None = None
        self._lock: persist.Lock | None = None
        alive, wait = lambda: self.running, settings.serve.reply_timeout
        self.sender = Sender(wait, alive, self._report)
        self._attending: asyncio.Task[None] | None = None

    # Start and end

    def start(self) -> None:
        """Lock the state file, start the loop process, listen and beat."""
        lock = persist.Lock(self._path)
        lock.take()
        shared = None
        try:
            settings = self._settings
            shared = Shared.create(form=settings.telemetry)
            kept = persist.load(self._path)
            spec = Spec(self._rig, self._seed, settings, kept, self._machine, os.getpid())
            child = launch(spec, shared, lock.fd)
        except BaseException:
            if shared is not None:
                shared.close()
            lock.drop()
            raise
        lock.write(f"process {os.getpid()}, its loop is process {child.process.pid}")
        self.trouble, self.trust = None, "not known yet"
        self._leaving, self._left, self._how, self.switched_off = False, None, "", False
        self.realtime, self.stages = child.realtime, alone.stages(child.channels)
        self.channels = tuple(child.channels)
        self._lock, self._child, self.shared = lock, child, shared
        self._store = PositionStore(
            self._path, settings.kept_as(self._rig), self._shown, self._report
        )
        _background.call(self._begin(child, shared))

    async def _begin(self, child: Child, shared: Shared) -> None:
        outbox = link.Outbox(child.end)
        assert self._store is not None
        self.sender.begin(child, shared, self._store, outbox, self.stages)
        self.ledger.open()
        self.tell("loop", "started", {"process": child.process.pid, "realtime": self.realtime})
        self.running = True
        self._attending = asyncio.create_task(self._attend(child, shared, outbox))

    def stop(self) -> None:
        """End the loop process with outputs safe, or kill it."""
        child, shared = self._child, self.shared
        if child is None or shared is None:
            return
        shared.cells[LEAVE] = 1
        try:
            child.process.wait(END_S)
        except subprocess.TimeoutExpired:
            self._how = f"it did not end within {END_S:g} s; {_safing.end(child.process)}"
        _background.call(self._attended())
        shared.close()
        if self._lock is not None:
            self._lock.drop()
        self._child, self._lock = None, None

    async def _attended(self) -> None:
        """Wait until all is done about the end of the loop process."""
        if self._attending is not None:
            await asyncio.wait([self._attending])

    @property
    def rig_failed(self) -> bool:
        trouble = self.trouble
        return not self.running and trouble is not None and trouble.code == faults.RIG_FAILED

    def reopen(self) -> None:
        """Start again after a failure of the rig, if its `stop` works again."""
        _background.call(self._attended())  # `_over` sees to the rig first
        self.stop()
        if not _safing.stop(self._settings.rigs(self._rig), self._seed).done:
            return
        try:
            self.start()
        except (MacromicroError, OSError) as error:
            self.tell("loop", "not started again", {"reason": str(error)})
        else:
            self.tell("loop", "rig back", {"rig": self._rig})

    def renew(self) -> None:
        """Keep a jog under way."""
        if self.shared is not None:
            self.shared.cells[RENEWED] += 1

    def point(self, point: Point, at: int) -> None:
        """Show the loop a streamed set point."""
        if self.shared is not None:
            self.shared.set_point(point, at)

    def under_way(self, motion: int) -> bool:
        """Whether this motion is under way."""
        shared = self.shared
        return bool(motion and self.running and shared and shared.motion() == motion)

    # What comes by itself

    @property
    def moving(self) -> bool:
        """Whether a motion is under way or the carriage coasts."""
        shown = self._shown()
        return self.running and shown is not None and shown[1].moving

    async def keep(self) -> None:
        """Update the position file."""
        if self._store is not None and self.running:
            await self._store.update()

    def tell(self, kind: str, cause: str, evidence: dict[str, Any]) -> None:
        """Report an event of the server at the machine's time."""
        self.ledger.event(Event(self.time, kind, "", "", cause, evidence))

    @property
    def time(self) -> float:
        """The machine's time; NaN before its first row."""
        row = self.shared.last() if self.shared is not None else None
        return float(row[0]) if row is not None else math.nan

    def _report(self, text: str) -> None:
        self.tell("loop", "trouble", {"reason": text})

    def _shown(self) -> Shown | None:
        return (
            _watching.place(self.shared, self.trust, self._settings)
            if self.shared is not None
            else None
        )

    async def _attend(self, child: Child, shared: Shared, outbox: link.Outbox) -> None:
        """Beat, watch and listen until the loop process has ended; then see to what is left."""
        beat = asyncio.create_task(self._beat(shared, outbox))
        watch = asyncio.create_task(self._watch(child, shared))
        said = await self._listen(child, outbox)
        self.running = False
        beat.cancel()
        if self.trouble and self.trouble.code == faults.LOOP_SILENT:
            await watch  # which is ending it
        else:
            watch.cancel()
            with contextlib.suppress(subprocess.TimeoutExpired):
                await in_thread(child.process.wait, END_S)
        child.end.close()
        await self._over(child, shared, said)

    async def _listen(self, child: Child, outbox: link.Outbox) -> str:
        """Hear the loop's messages until it has ended; what it has said about its end."""
        loop, ended, said = asyncio.get_running_loop(), asyncio.Event(), ""

        def hear() -> None:
            nonlocal said
            while (message := outbox.receive()) is not None:
                kind, *rest = message
                said = self._hear(kind, rest) or said
            if outbox.ended:
                loop.remove_reader(child.end)
                ended.set()

        loop.add_reader(child.end, hear)
        while not ended.is_set():
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(LOOK_S):
                    await ended.wait()
            # Whoever inherited its end of the link by mistake would keep that open.
            if not ended.is_set() and child.process.poll() is not None:
                hear()
                loop.remove_reader(child.end)
                break
        return said

    async def _beat(self, shared: Shared, outbox: link.Outbox) -> None:
        pause = min(self._settings.serve.parent_timeout / 10.0, 0.05)
        while True:
            shared.cells[HEARTBEAT] += 1
            outbox.flush()
            await asyncio.sleep(pause)

    async def _watch(self, child: Child, shared: Shared) -> None:
        """End a loop process that shows no period."""
        allowed = self._settings.serve.loop_timeout
        pulse = Pulse(allowed, int(shared.cells[WRITTEN]), time.monotonic())
        while not shared.cells[LEAVE]:
            silent = pulse.look(int(shared.cells[WRITTEN]), time.monotonic())
            if silent > (END_S if self._leaving else allowed):
                await self._silent(child, silent, allowed)
                with contextlib.suppress(OSError):  # one that does not end keeps its end open
                    child.end.shutdown(socket.SHUT_RDWR)
                return
            await asyncio.sleep(pulse.pause)

    async def _silent(self, child: Child, silent: float, allowed: float) -> None:
        last = _watching.last_written(self.shared)
        text = f"no period for {silent:.2f} s, allowed {allowed:g} s; {last}"
        self._fault(faults.failure(faults.LOOP_SILENT, text))
        self.trust = "the loop does not respond"
        self.running = False
        self._close(m.FAULTED, text)
        self._how = await in_thread(_safing.end, child.process)

    def _close(self, outcome: str, evidence: str) -> None:
        """End the motion under way and answer what waits."""
        self.ledger.close(outcome, evidence)
        self.sender.close()

    def _fault(self, trouble: Trouble) -> None:
        self.trouble = trouble
        self.tell("fault", trouble.name, {"evidence": trouble.evidence})

    def _hear(self, kind: str, rest: list[Any]) -> str:
        if kind == "reply":
            serial, reply = rest
            self.ledger.replied(reply)
            self.sender.reply(serial, reply)
        elif kind == "notice":
            notice = self.sender.signed(rest[0])
            if isinstance(notice, Finished):
                self.ledger.end(notice)
            else:
                if notice.kind == "trust":
                    self.trust = notice.cause
                self.ledger.event(notice)
        elif kind == "begun":
            self.trust = rest[0].why
            self.tell("trust", self.trust, {"trusted": rest[0].trusted})
        elif kind == "traceback":
            LOG.error("the controller ended with an error\n%s", rest[0])
        elif kind == "trouble":
            self._fault(rest[0])
        elif kind == "leaving":
            self._leaving = True
        elif kind == "left":
            self._left = rest[0]
        elif kind == "ended":
            return str(rest[0])
        return ""

    async def _over(self, child: Child, shared: Shared, said: str) -> None:
        """Report the end of the loop process and see to the rig."""
        if child.process.poll() is None and not self._how:
            self._how = await in_thread(_safing.end, child.process)
        status = child.process.poll() or 0
        if shared.cells[LEAVE] and self._left == "":
            self.switched_off, self.trust = True, "the server was stopped"
            self._close(m.STOPPED_BY_REQUEST, "the server was stopped")
            await in_thread(self.ended, "the server was stopped")
            self.tell("loop", "stopped", {"status": status})
            return
        how = said or (f"signal {-status}" if status < 0 else f"exit status {status}")
        trouble = self.trouble
        if trouble is None:
            text = f"it ended unexpectedly: {how}; {_watching.last_written(self.shared)}"
            trouble = faults.failure(faults.LOOP_DIED, text)
            self._fault(trouble)
        self.trust = trouble.name
        outcome = m.LOST if trouble.code == faults.LOOP_DIED else m.FAULTED
        self._close(outcome, trouble.evidence)
        self.tell("trust", self.trust, {"trusted": False})
        await self._see_to_rig(trouble)
        await in_thread(self.ended, (self.trouble or trouble).evidence)
        self.tell("loop", "died", {"status": status})

    async def _see_to_rig(self, trouble: Trouble) -> None:
        """Add the state of the outputs to the evidence; stop the rig if the loop did not."""
        words = "the rig's stop returned; nothing read the outputs back"
        evidence = f"{trouble.evidence}; {self._how}" if self._how else trouble.evidence
        self.switched_off = self._left == ""
        if trouble.code == faults.RIG_FAILED or not self.switched_off:
            left = "" if self.switched_off else "the loop ended without closing its rig: "
            with contextlib.suppress(MacromicroError):
                if self._store is not None:
                    await self._store.lose(f"{left}{trouble.name}")
        if not self.switched_off:
            before = f"{self._left}; " if self._left else ""
            now = "a fresh process is stopping the rig"
            self.trouble = trouble._replace(evidence=f"{evidence}; {before}{now}")
            safed = await in_thread(_safing.stop, self._settings.rigs(self._rig), self._seed)
            self.switched_off, words = safed.done, before + safed.words
        self.trouble = trouble._replace(evidence=f"{evidence}; {words}")
        self.tell("loop", f"rig {'' if self.switched_off else 'not '}stopped", {"evidence": words})
