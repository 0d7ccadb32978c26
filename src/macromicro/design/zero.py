"""The laser's zero: its reading at a reset, and the contraction at that time.

Where the micro-stage is extended at the reset, the reading is its contraction. Where it is moving
or held at a place (`controller.sequence.overlap`), the Hall sensor gives the missing contraction,
once both stages are at rest.
"""

from __future__ import annotations

import numpy as np

from macromicro.arrays import Array
from macromicro.recording import Recording

BLOCK = 0.02  # s over which readings are averaged
BLOCKS = 10  # that must agree
QUIET = 4.0  # um by which they may differ


def offset(recording: Recording, row: int) -> float:
    """Contraction [um] that the laser's reading lacks."""
    resets = np.flatnonzero(recording["laser_reset"])
    before = resets[resets < row]
    if not len(before):
        return 0.0
    after = resets[resets >= row]
    end = int(after[0]) if len(after) else len(recording["laser_reset"]) - 1
    return _missing(recording, int(before[-1]), end)


def contraction(recording: Recording) -> Array:
    """Contraction [um] by the laser."""
    reading = np.array(recording["laser"], dtype=np.float64)
    resets = np.flatnonzero(recording["laser_reset"])
    ends = [*resets[1:], len(reading) - 1]
    for k, end in zip(resets, ends[: len(resets)], strict=True):
        reading[k + 1 : end + 1] += _missing(recording, int(k), int(end))
    return reading


def _missing(recording: Recording, reset: int, end: int) -> float:
    """Contraction [um] that readings lack after a reset, up to `end`."""
    size = max(round(BLOCK / recording.dt), 1)
    before = reset + 1 - size
    known = "hall_position" in recording and "micro_reference" in recording
    if before < 0 or not known:
        return 0.0  # a run that begins with a fine move begins extended
    if not np.all(recording["micro_reference"][before : reset + 1] != 0.0):
        return 0.0
    count = (end - reset) // size
    rows = slice(reset + 1, reset + 1 + count * size)
    hall = 1e3 * recording["hall_position"][rows].reshape(count, size).mean(axis=1)
    laser = recording["laser"][rows].reshape(count, size).mean(axis=1)
    for k in range(count - BLOCKS + 1):
        one, other = hall[k : k + BLOCKS], laser[k : k + BLOCKS]
        if np.ptp(one) <= QUIET and np.ptp(other) <= QUIET:
            return float((one - other).mean())
    return 0.0  # never quiet: nothing is known
