"""Telemetry into an HDF5 recording, by a thread that the loop never waits for."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from macromicro.errors import MacromicroError
from macromicro.recorder import Recorder
from macromicro.recording_format import Attribute
from macromicro.serve.shared import COLUMNS, PERIOD, WRITTEN, Shared
from macromicro.serve.snapshot import RecordingState
from macromicro.serve.trail import Trail

ASKED = "its end was asked for"
EVERY = 0.1  # s between looks at the ring


class Recording:
    """One recording under way. `failed` is called once, in the thread, with the reason why it
    ended early; all rows before are safe then, and the file is complete.

    Raises what `Recorder` raises; from then on nothing raises.
    """

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
    ) -> None:
        self._shared, self._trail = shared, trail
        self._count = int(shared.cells[WRITTEN])
        self._recorder = Recorder(
            path, COLUMNS, capacity, PERIOD, attributes, overwrite=overwrite, events=True
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
        """What is in the file now."""
        return self._state

    def end(self, reason: str = ASKED) -> RecordingState:
        """Write what is left and why it ends (attribute `ended`), close the file."""
        self._reason = self._reason or reason
        self._enough.set()
        self._thread.join()
        return self._state

    def _run(self) -> None:
        try:
            while not self._enough.wait(EVERY):
                self._drain()
            self._drain()
        except (MacromicroError, OSError) as error:
            self._state = self._state._replace(error=str(error))
            self._reason = f"{self._reason} ({error})" if self._reason else str(error)
        finally:
            self._trail.end_recording()
            self._recorder.attribute("ended", self._reason)
            self._recorder.close()
            self._state = self._state._replace(active=False)
        if self._state.error:
            self._failed(self._state.error)

    def _drain(self) -> None:
        lost, self._count, block = self._shared.since(self._count)
        if block.shape[1]:
            self._recorder.append(whole(block))
        if entries := self._trail.take():
            self._recorder.note(entries)
        self._state = self._state._replace(rows=self._recorder.rows, lost=self._state.lost + lost)


def whole(block: NDArray[np.float64]) -> NDArray[np.float64]:
    """The block, with -1 for what is not a number in columns of whole numbers."""
    for k, column in enumerate(COLUMNS):
        if not column.dtype.startswith("f"):
            np.nan_to_num(block[k], copy=False, nan=-1.0, posinf=-1.0, neginf=-1.0)
    return block
