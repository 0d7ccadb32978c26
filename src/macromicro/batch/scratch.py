"""Memory for a run's columns while it is measured, one per thread, reused."""

from __future__ import annotations

import threading

import numpy as np

from macromicro.arrays import Array
from macromicro.loop import PERIOD
from macromicro.recorded import COLUMNS, NAMES
from macromicro.recording import Recording

_LOCAL = threading.local()


class Scratch:
    """A sink for `runs.programmed.perform` that keeps the named columns of one run at a time."""

    def __init__(self, names: tuple[str, ...]) -> None:
        self._rows = [NAMES.index(name) for name in names]
        self._columns = [COLUMNS[k] for k in self._rows]
        self._place = np.empty((len(names), 0))
        self._used = 0

    def clear(self) -> None:
        """Prepare for the next run; the memory is kept."""
        self._used = 0

    def append(self, block: Array) -> None:
        end = self._used + block.shape[1]
        if end > self._place.shape[1]:
            larger = np.empty((len(self._rows), max(end, 2 * self._place.shape[1])))
            larger[:, : self._used] = self._place[:, : self._used]
            self._place = larger
        for to, row in zip(self._place, self._rows, strict=True):
            to[self._used : end] = block[row]
        self._used = end

    def recording(self) -> Recording:
        """The run as a recording, valid until the next `clear`."""
        return Recording.from_arrays(self._columns, self._place[:, : self._used], PERIOD, {})


def scratch(names: tuple[str, ...]) -> Scratch:
    places: dict[tuple[str, ...], Scratch] = _LOCAL.__dict__.setdefault("places", {})
    if names not in places:
        places[names] = Scratch(names)
    places[names].clear()
    return places[names]
