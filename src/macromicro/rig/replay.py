"""A rig that replays the sensors of a recording."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from macromicro.columns import quantities
from macromicro.errors import InputError, ProblemError
from macromicro.recording import Recording
from macromicro.types import Outputs, Sample

SCHEME = "replay:"
_SENSORS = {name: note for name, note in quantities(Sample).items() if name != "t"}


class Replay:
    """A `Rig` whose readings are those of a recording, one a period, in its own time."""

    def __init__(self, recording: Recording, name: str = "recording") -> None:
        found: dict[str, NDArray[np.float64]] = {}
        for channel, note in _SENSORS.items():
            if note.column in recording:
                values = recording[note.column].astype(float) * (1.0 / note.scale)
                if not note.dtype.startswith("f"):  # -1: not measured
                    values[values < 0.0] = math.nan
                if not np.isnan(values).all():
                    found[channel] = values
        if not {"encoder", "hall"} & set(found):
            columns = ", ".join(note.column for note in _SENSORS.values())
            remedy = f"Use a recording with {columns}."
            raise ProblemError(f"{SCHEME}{name}", "the recording has no sensors", remedy)
        self.channels = tuple(found)
        self.clock = self
        self.rows = len(recording)
        self._t = recording["t"] - recording["t"][0]
        self._values = [found.get(channel) for channel in _SENSORS]
        self._row = 0

    def now(self) -> float:
        return float(self._t[self._row])

    def wait(self, dt: float) -> None:
        """Go to the next row; the last one stays."""
        self._row = min(self._row + 1, self.rows - 1)

    def read(self) -> Sample:
        k = self._row
        return Sample(self.now(), *(math.nan if v is None else float(v[k]) for v in self._values))

    def write(self, outputs: Outputs) -> None:
        """Ignored."""

    def stop(self) -> None:
        """Nothing moves."""

    def __enter__(self) -> Self:
        self._row = 0
        return self

    def __exit__(self, *_: object) -> None: ...


def open_recording(name: str) -> Recording:
    """The recording of "replay:FILE"."""
    if not name.startswith(SCHEME) or name == SCHEME:
        raise InputError("--rig", name, f"{SCHEME}FILE with a recording")
    return Recording.load(Path(name.removeprefix(SCHEME)))
