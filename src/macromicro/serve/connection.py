"""One loop process at a time: its start, its end, and everything that passes between."""

from __future__ import annotations

import math
import os
import subprocess
import threading
import time
from pathlib import Path
from typing import Any

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Event, Finished, Reply
from macromicro.serve import faults, link, persist, sending, watching
from macromicro.serve.keeping import Keeper, Place
from macromicro.serve.launching import Child, launch
from macromicro.serve.ledger import Ledger
from macromicro.serve.loop_spec import Spec
from macromicro.serve.sending import Allowed, Sender, Stops
from macromicro.serve.settings import LiveSettings
from macromicro.serve.shared import HEARTBEAT, LEAVE, Shared
from macromicro.serve.snapshot import Trouble
from macromicro.serve.trail import Trail

END_S = 3.0


class Connection:
    """The serving process' side. Thread-safe but for `start` and `stop`."""

    def __init__(
        self, rig: str, seed: int, settings: LiveSettings, state: Path | None, machine: str
    ) -> None:
        self._path = state or persist.default_path(rig)
        self._rig, self._seed, self._settings, self._machine = rig, seed, settings, machine
        self.shared: Shared | None = None
        self.trail = Trail()
        self.ledger = Ledger(self.trail)
        self.trouble: Trouble | None = None
        self.trust = "not started"
        self.realtime = ""
        self.running = False
        self._child: Child | None = None
        self._keeper: Keeper | None = None
        self._lock: persist.Lock | None = None
        self.turn = threading.RLock()  # of what is sent, and of who may send; held shortly
        self._sender: Sender | None = None
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
        self._sender = Sender(
            child,
            shared,
            self._keeper,
            self.ledger,
            self.turn,
            settings.serve.reply_timeout,
            lambda: self.running,
            self._report,
        )
        self.ledger.open()
        self.tell("loop", "started", {"process": child.process.pid, "realtime": self.realtime})
        self.running = True
        self._threads = [
            threading.Thread(target=self._listen, args=(child,), name="listener", daemon=True),
            threading.Thread(target=self._beat, args=(shared,), name="heartbeat", daemon=True),
        ]
        for thread in self._threads:
            thread.start()

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

    def ask(
        self, request: Any, allowed: Allowed = sending.anybody, since: Stops | None = None
    ) -> Reply:
        """Send a request, wait for its reply; see `Sender.ask`."""
        sender = self._sender
        return sender.ask(request, allowed, since) if sender and self.running else sending.OFF

    def post(self, request: Any) -> None:
        """Send a request whose reply nobody waits for. Does nothing where no loop runs."""
        if self._sender is not None and self.running:
            self._sender.post(request)

    def released(self) -> None:
        """Nobody holds control any more; see `Sender.released`."""
        if self._sender is not None and self.running:
            self._sender.released()

    @property
    def stops(self) -> Stops:
        """Stops that the running loop was asked for so far."""
        return self._sender.stops if self._sender is not None else (0, 0)

    def emergency(self, client: str) -> float:
        """Set the flag, wait for the loop's answer; see `Station.emergency`."""
        sender = self._sender
        return sender.emergency(client) if sender and self.running else math.nan

    # What comes by itself

    @property
    def moving(self) -> bool:
        """Is a motion under way, or does the carriage coast? False where no loop runs."""
        place = self._place()
        return self.running and place is not None and place.moving

    def keep(self) -> None:
        """Bring the position file up to date. Raises MacromicroError where it cannot be."""
        if self._keeper is not None and self.running:
            self._keeper.update()

    def tell(self, kind: str, cause: str, evidence: dict[str, Any]) -> None:
        """An event of our own, beside those of the machine; its time is the machine's."""
        self.ledger.event(Event(self.time, kind, "", "", cause, evidence))

    @property
    def time(self) -> float:
        """The machine's [s]; NaN before its first row."""
        row = self.shared.last() if self.shared is not None else None
        return float(row[0]) if row is not None else math.nan

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
            notice = self._sender.signed(rest[0]) if self._sender else rest[0]
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
