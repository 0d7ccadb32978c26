"""One loop process at a time: its start, its end, and everything that passes between."""

from __future__ import annotations

import contextlib
import math
import os
import signal
import subprocess
import threading
import time
from pathlib import Path
from typing import Any

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Event, Finished, Refused, Reply
from macromicro.errors import MacromicroError
from macromicro.serve import faults, link, persist, watching
from macromicro.serve.keeping import Keeper, Place
from macromicro.serve.launching import Child, launch
from macromicro.serve.ledger import Ledger
from macromicro.serve.loop_spec import Spec
from macromicro.serve.settings import LiveSettings
from macromicro.serve.shared import COMMANDS, EMERGENCY, HEARTBEAT, LEAVE, SEEN, WRITTEN, Shared
from macromicro.serve.snapshot import Trouble

ANSWER_S = 1.0  # an emergency stop that takes longer ends the loop process
END_S = 3.0
_MOTIONS = (m.Home, m.MoveTo, m.MoveBy, m.MoveMacro, m.MoveMicro, m.Programme)
_SILENT = Refused("the loop did not answer in time", "see the events; stop, and start again")
_OFF = Refused("the loop process is not running", "start it again")


class Connection:
    """The serving process' side. Thread-safe but for `start` and `stop`."""

    def __init__(
        self, rig: str, seed: int, settings: LiveSettings, state: Path | None, machine: str
    ) -> None:
        self._path = state or persist.default_path(rig)
        self._rig, self._seed, self._settings, self._machine = rig, seed, settings, machine
        self.shared: Shared | None = None
        self.ledger = Ledger()
        self.trouble: Trouble | None = None
        self.trust = "not started"
        self.realtime = ""
        self.running = False
        self._child: Child | None = None
        self._keeper: Keeper | None = None
        self._lock: persist.Lock | None = None
        self._sending = threading.Lock()
        self._threads: list[threading.Thread] = []

    # Start and end

    def start(self) -> None:
        """Lock the state file, start the loop process, begin to listen and to beat."""
        lock = persist.Lock(self._path)
        lock.take()
        shared = None
        try:
            shared = Shared.create()
            kept = persist.load(self._path)
            settings = self._settings
            spec = Spec(self._rig, self._seed, settings, kept, self._machine, os.getpid())
            child = launch(spec, shared, lock.fd)
        except BaseException:
            if shared is not None:
                shared.close()
            lock.drop()
            raise
        lock.write(f"process {os.getpid()}, its loop is process {child.process.pid}")
        self.trouble, self.trust = None, "not known yet"
        self.realtime = child.privileges.words
        self._lock, self._child, self.shared = lock, child, shared
        self._keeper = Keeper(self._path, self._rig, self._place, self._report)
        self.ledger.open()
        self.running = True
        self._threads = [
            threading.Thread(target=self._listen, args=(child,), name="listener", daemon=True),
            threading.Thread(target=self._beat, args=(shared,), name="heartbeat", daemon=True),
        ]
        for thread in self._threads:
            thread.start()
        self.tell("loop", "started", {"process": child.process.pid, "realtime": self.realtime})

    def stop(self) -> None:
        """End the loop process, with outputs safe; kill it where it does not end."""
        child, shared = self._child, self.shared
        if child is None or shared is None:
            return
        shared.cells[LEAVE] = 1
        try:
            child.process.wait(END_S)
        except subprocess.TimeoutExpired:
            child.process.kill()
            child.process.wait()
            self._report("the loop process did not end and was killed")
        for thread in self._threads:
            thread.join()
        child.end.close()
        shared.close()
        if self._lock is not None:
            self._lock.drop()
        self._child, self._lock, self._threads = None, None, []

    # Orders

    def ask(self, request: Any) -> Reply:
        """Send a request, wait for its reply. Nobody's right to it is checked here."""
        child, shared, keeper = self._child, self.shared, self._keeper
        if not self.running or child is None or shared is None or keeper is None:
            return _OFF
        moves = isinstance(request, _MOTIONS) or (isinstance(request, m.Jog) and request.speed != 0)
        if moves:
            try:
                keeper.begin_motion()
            except MacromicroError as error:
                return Refused(str(error), "make room, or make the file's folder writable")
        serial = self.ledger.serial()
        reply: Reply | None = self._post(child, shared, serial, request)
        if reply is not None:
            self.ledger.forget(serial)
        else:
            reply = self.ledger.await_reply(serial, self._settings.serve.reply_timeout)
        if moves:
            keeper.answered(int(shared.cells[WRITTEN]))
        return reply or (_SILENT if self.running else _OFF)

    def _post(self, child: Child, shared: Shared, serial: int, request: Any) -> Refused | None:
        data = link.packed((serial, request))
        if len(data) > link.LARGEST:
            return Refused(f"a request of {len(data)} bytes", f"at most {link.LARGEST} bytes")
        with self._sending:
            try:
                child.end.send(data, link.DONT_WAIT)
            except BlockingIOError:
                return _SILENT
            except OSError:
                return _OFF
            shared.cells[COMMANDS] += 1
        return None

    def emergency(self) -> float:
        """Set the flag, wait for the loop's answer; see `Station.emergency`."""
        shared, child = self.shared, self._child
        if shared is None or child is None or not self.running:
            return math.nan
        stamp = time.monotonic_ns()
        shared.cells[EMERGENCY] = stamp
        deadline = time.monotonic() + ANSWER_S
        while time.monotonic() < deadline and self.running:
            if int(shared.cells[SEEN]) >= stamp:
                return watching.emergency_time(shared)
            time.sleep(0.0005)
        if self.running:
            with contextlib.suppress(ProcessLookupError):
                child.process.send_signal(signal.SIGTERM)
            self._report(f"no answer to an emergency stop in {ANSWER_S:g} s; the loop is ended")
        return math.nan

    # What comes by itself

    def keep(self) -> None:
        """Bring the position file up to date. Raises MacromicroError where it cannot be."""
        if self._keeper is not None and self.running:
            self._keeper.update()

    def tell(self, kind: str, cause: str, evidence: dict[str, Any]) -> None:
        """An event of our own, beside those of the machine; its time is the machine's."""
        mode = ""
        now = math.nan
        row = self.shared.last() if self.shared is not None else None
        if row is not None:
            now = float(row[0])
        self.ledger.event(Event(now, kind, mode, mode, cause, evidence))

    def _report(self, text: str) -> None:
        self.tell("loop", "trouble", {"reason": text})

    def _place(self) -> Place | None:
        return watching.place(self.shared, self.trust) if self.shared is not None else None

    def _beat(self, shared: Shared) -> None:
        pause = min(self._settings.serve.parent_timeout / 10.0, 0.05)
        while self.running:
            shared.cells[HEARTBEAT] += 1
            time.sleep(pause)

    def _listen(self, child: Child) -> None:
        """Take what the loop says until it has ended."""
        said = ""
        try:
            while True:
                kind, *rest = link.receive(child.end)
                said = self._hear(kind, rest) or said
        except (EOFError, OSError):
            pass
        self._over(child, said)

    def _hear(self, kind: str, rest: list[Any]) -> str:
        if kind == "reply":
            self.ledger.reply(*rest)
        elif kind == "notice":
            notice = rest[0]
            if isinstance(notice, Finished):
                self.ledger.end(notice)
            else:
                if notice.kind == "trust":
                    self.trust = notice.cause
                self.ledger.event(notice)
        elif kind == "begun":
            self.trust = rest[0].why
            self.tell("trust", self.trust, {"trusted": rest[0].trusted})
        elif kind == "trouble":
            self.trouble = rest[0]
            self.tell("fault", rest[0].name, {"evidence": rest[0].evidence})
        elif kind == "ended":
            return str(rest[0])
        return ""

    def _over(self, child: Child, said: str) -> None:
        shared = self.shared
        assert shared is not None
        status = child.process.wait()
        ordered = bool(shared.cells[LEAVE])
        self.running = False
        if ordered:
            self.ledger.close(m.STOPPED_BY_REQUEST, "the server was stopped")
        elif self.trouble is not None:
            self.ledger.close(m.FAULTED, self.trouble.evidence)
        else:
            how = said or (f"signal {-status}" if status < 0 else f"exit status {status}")
            self.trouble = faults.failed(faults.LOOP_DIED, f"it ended by itself: {how}")
            self.ledger.close(m.LOST, self.trouble.evidence)
        cause = "stopped" if ordered else "died"
        self.tell("loop", cause, {"status": status})
