"""Captures of the clients, one each."""

from __future__ import annotations

import threading

from macromicro.columns import Column
from macromicro.errors import ProblemError
from macromicro.serve import capturing
from macromicro.serve._loop_connection import LoopConnection
from macromicro.serve.capturing import Capture, Wanted
from macromicro.serve.choosing import AnySettings
from macromicro.serve.shared import WRITTEN


class Captures:
    """Looks at the telemetry for all of them; thread-safe."""

    def __init__(self, connection: LoopConnection, settings: AnySettings) -> None:
        self._connection, self._settings = connection, settings
        self._lock = threading.Lock()
        self._captures: dict[str, Capture] = {}

    @property
    def signals(self) -> tuple[Column, ...]:
        """The columns that can be captured."""
        form = self._settings.telemetry
        return tuple(form.columns[k] for k in form.kept(self._connection.channels))

    def begin(self, client: str, wanted: Wanted) -> Capture:
        """Begin a capture, in place of the client's last one; raises InputError."""
        shared, period = self._connection.shared, self._settings.period
        capturing.checked(wanted, self.signals, period)
        if shared is None or not self._connection.running:
            raise ProblemError("capture", "the loop process is not running", "Start it again.")
        form = self._settings.telemetry
        capture = Capture(wanted, form.columns, form.scales, period, int(shared.cells[WRITTEN]))
        with self._lock:
            self._captures[client] = capture
        return capture

    def of(self, client: str) -> Capture | None:
        """The client's capture."""
        return self._captures.get(client)

    def end(self, client: str) -> None:
        with self._lock:
            self._captures.pop(client, None)

    def look(self) -> None:
        """Look at the rows that have come; to be called periodically."""
        shared, ledger = self._connection.shared, self._connection.ledger
        if shared is None:
            return
        with self._lock:
            waiting = list(self._captures.values())
        for capture in waiting:
            capture.look(shared, ledger.finished)
