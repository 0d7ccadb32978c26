"""Telemetry into HDF5 recordings, on a thread of its own."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from macromicro.columns import whole
from macromicro.control.live.messages import Stop
from macromicro.errors import MacromicroError
from macromicro.nominal import PERIOD
from macromicro.recorder import Recorder
from macromicro.recording_format import Attribute
from macromicro.rig.faults import end_attributes
from macromicro.serve._ledger import Trail
from macromicro.serve._loop_connection import LoopConnection
from macromicro.serve._watching import NO_RECORDING, latched_fault
from macromicro.serve.settings import STOP, AnySettings
from macromicro.serve.shared import PLAIN, WRITTEN, Shared, Telemetry
from macromicro.serve.snapshot import RecordingState, Trouble
from macromicro.serve.storage import make_folder

ASKED = "ended on request"
KEPT = 1000  # names of recordings that are remembered
EVERY, FLUSHED = 0.1, 1.0  # s between looks at the ring; until rows are forced onto the disk


class Means(NamedTuple):
    """Columns, period and present fault of a recording."""

    telemetry: Telemetry = PLAIN
    period: float = PERIOD
    fault: Callable[[], Trouble | None] = lambda: None


_PLAIN = Means()


class Recording:
    """One recording under way; `failed` is called once, with the reason, if it ends early."""

    def __init__(
        self,
        shared: Shared,
        trail: Trail,
        path: Path,
        capacity: int,
        attributes: Mapping[str, Attribute],
        failed: Callable[[str], None],
        *,
        overwrite: bool = False,
        channels: Sequence[str] = (),
        means: Means = _PLAIN,
    ) -> None:
        self._fault = means.fault
        self._met: Trouble | None = None  # the last one
        self._shared, self._trail = shared, trail
        self._kept = means.telemetry.kept(channels)
        self._count = int(shared.cells[WRITTEN])
        self._scales = means.telemetry.scales
        self._columns = tuple(means.telemetry.columns[k] for k in self._kept)
        self._recorder = Recorder(
            path,
            self._columns,
            capacity,
            means.period,
            {**attributes, **end_attributes(False, None)},
            overwrite=overwrite,
            events=True,
        )
        trail.begin()
        self._failed = failed
        self._state = RecordingState(True, str(self._recorder.path), 0, 0, "")
        self._reason = ""
        self._enough = threading.Event()
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)
        self._thread.start()

    @property
    def state(self) -> RecordingState:
        return self._state

    def end(self, reason: str = ASKED) -> RecordingState:
        """Write the rest with the reason of the end and the last fault; close the file."""
        self._reason = self._reason or reason
        self._enough.set()
        self._thread.join()
        return self._state

    def _run(self) -> None:
        due, failure = time.monotonic() + FLUSHED, ""
        try:
            while not self._enough.wait(EVERY):
                self._drain()
                if time.monotonic() >= due:
                    self._recorder.flush()
                    due = time.monotonic() + FLUSHED
            self._drain()
        except (MacromicroError, OSError) as error:
            failure = str(error)
            self._reason = f"{self._reason} ({error})" if self._reason else str(error)
        finally:
            self._trail.end_recording()
            whole = self._reason == ASKED and not failure
            for name, value in {**end_attributes(whole, self._met), "ended": self._reason}.items():
                self._recorder.attribute(name, value)
            self._recorder.close()
            self._state = self._state._replace(active=False, error=failure)
        if failure:
            self._failed(failure)

    def _drain(self) -> None:
        lost, self._count, block = self._shared.since(self._count)
        if block.shape[1]:
            self._recorder.append(whole((block * self._scales)[self._kept], self._columns))
        self._met = self._fault() or self._met
        if entries := self._trail.take():
            self._recorder.note(entries)
        self._state = self._state._replace(rows=self._recorder.rows, lost=self._state.lost + lost)


class Recordings:
    """Begins and ends recordings; thread-safe. `attributes` go into each file."""

    def __init__(
        self, connection: LoopConnection, settings: AnySettings, attributes: Mapping[str, Attribute]
    ) -> None:
        self._connection, self._settings, self._attributes = connection, settings.serve, attributes
        self._machine, self._means = settings, Means(settings.telemetry, settings.period)
        self._lock = threading.Lock()
        self._recording: Recording | None = None
        self._begun: deque[Path] = deque(maxlen=KEPT)
        connection.ended = self._loop_ended

    @property
    def begun(self) -> tuple[Path, ...]:
        """The last files, oldest first."""
        return tuple(self._begun)

    @property
    def state(self) -> RecordingState:
        recording = self._recording
        return recording.state if recording is not None else NO_RECORDING

    def begin(self, path: Path, client: str = "", *, overwrite: bool) -> None:
        """See `Station.record`."""
        with self._lock:
            shared = self._connection.shared
            if shared is None or not self._connection.running:
                raise MacromicroError("nothing is running to record; start it first")
            if self.state.active:
                found = self.state.path
                raise MacromicroError(f"a recording is under way, into {found}; end it first")
            capacity = round(self._settings.recorder_capacity / self._means.period)
            make_folder(path.parent, capacity, "recording into", self._means.telemetry.columns)
            self._recording = Recording(
                shared,
                self._connection.trail,
                path,
                capacity,
                self._attributes,
                self._failed,
                overwrite=overwrite,
                channels=self._connection.channels,
                means=self._means._replace(fault=lambda: self._now(shared)),
            )
            begun = self._recording.state.path
            self._begun.append(Path(begun))
        self._connection.tell("recording", "begun", {"path": begun, "client": client})

    def end(self, reason: str = ASKED, client: str = "") -> RecordingState:
        """See `Station.end_recording`."""
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

    def _now(self, shared: Shared) -> Trouble | None:
        return self._connection.trouble or latched_fault(shared, self._machine)

    def _loop_ended(self, reason: str) -> None:
        """Complete the file: no more rows come."""
        self.end(f"the loop ended: {reason}")

    def _failed(self, reason: str) -> None:
        self._connection.tell("recording", "failed", {"reason": reason})
        if self._settings.recorder_failure == STOP:
            self._connection.sender.post(Stop(client="recorder"))
