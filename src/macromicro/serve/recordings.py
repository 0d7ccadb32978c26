"""The recordings of a station: one at a time, each told of, and what follows a failed one."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Mapping
from pathlib import Path

from macromicro.control.live.messages import Stop
from macromicro.errors import MacromicroError
from macromicro.recording_format import Attribute
from macromicro.serve.connection import Connection
from macromicro.serve.places import make_folder
from macromicro.serve.recording import ASKED, Recording
from macromicro.serve.settings import STOP, ServeSettings
from macromicro.serve.shared import PERIOD
from macromicro.serve.snapshot import RecordingState
from macromicro.serve.watching import NO_RECORDING

KEPT = 1000  # names of recordings that are remembered


class Recordings:
    """Begins and ends them; thread-safe. `attributes` are written into each file."""

    def __init__(
        self, connection: Connection, settings: ServeSettings, attributes: Mapping[str, Attribute]
    ) -> None:
        self._connection, self._settings, self._attributes = connection, settings, attributes
        self._lock = threading.Lock()
        self._recording: Recording | None = None
        self._begun: deque[Path] = deque(maxlen=KEPT)
        connection.ended = self._loop_ended

    @property
    def begun(self) -> tuple[Path, ...]:
        """Files of the last ones that were begun, oldest first."""
        return tuple(self._begun)

    @property
    def state(self) -> RecordingState:
        """Of the one under way, or the last one."""
        recording = self._recording
        return recording.state if recording is not None else NO_RECORDING

    def begin(self, path: Path, client: str = "", *, overwrite: bool) -> None:
        """See `Station.record`."""
        with self._lock:
            shared = self._connection.shared
            if shared is None or not self._connection.running:
                raise MacromicroError("nothing runs that could be recorded; start it first")
            if self.state.active:
                found = self.state.path
                raise MacromicroError(f"a recording is under way, into {found}; end it first")
            capacity = self._settings.recorder_capacity
            make_folder(path.parent, capacity, "recording into")
            self._recording = Recording(
                shared,
                self._connection.trail,
                path,
                round(capacity / PERIOD),
                self._attributes,
                self._failed,
                overwrite=overwrite,
            )
            begun = self._recording.state.path
            self._begun.append(Path(begun))
        self._connection.tell("recording", "begun", {"path": begun, "client": client})

    def end(self, reason: str = ASKED, client: str = "") -> RecordingState:
        """See `Station.end_recording`; `reason` is written into the file."""
        with self._lock:
            recording = self._recording
            if recording is None:
                return NO_RECORDING
            active = recording.state.active
            trouble = self._connection.trouble
            if trouble is not None and not self._connection.running:
                reason = f"the loop ended: {trouble.evidence}"
            state = recording.end(reason)
        if active:
            facts = {"path": state.path, "rows": state.rows, "lost": state.lost, "client": client}
            self._connection.tell("recording", "ended", facts)
        return state

    def _loop_ended(self, reason: str) -> None:
        """No more rows come: the file is completed, and says why."""
        self.end(f"the loop ended: {reason}")

    def _failed(self, reason: str) -> None:
        self._connection.tell("recording", "failed", {"reason": reason})
        if self._settings.recorder_failure == STOP:
            self._connection.ask(Stop(client="recorder"))
