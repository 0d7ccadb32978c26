"""What the laser shows of the micro-stage, wherever that stood when the laser was reset.

A reset makes the reading 0. Where the micro-stage is extended then, the reading is its contraction.
Where it is on its way to a place, or held there (`controller.sequence.overlap`), its contraction at
that time is missing: the Hall sensor tells it, once both stages are quiet.
"""

from __future__ import annotations

import numpy as np

from macromicro.arrays import Array
from macromicro.recording import Recording

BLOCK = 0.02  # s over which readings are averaged
BLOCKS = 10  # that must agree
QUIET = 4.0  # um by which they may differ


def offset(recording: Recording, row: int) -> float:
    """What the laser's reading lacks of the contraction.

    Parameters
    ----------
    recording : Recording
        Of a run; columns laser, laser_reset, micro_reference and hall_position.
    row : int
        Row of a reading; a reset's own period still reads from the reset before.

    Returns
    -------
    float
        um; 0 before the first reset, after one that found the stage without a set point, and
        without a Hall sensor.
    """
    resets = np.flatnonzero(recording["laser_reset"])
    before = resets[resets < row]
    if not len(before):
        return 0.0
    after = resets[resets >= row]
    end = int(after[0]) if len(after) else len(recording["laser_reset"]) - 1
    return _missing(recording, int(before[-1]), end)


def contraction(recording: Recording) -> Array:
    """Contraction by the laser.

    Parameters
    ----------
    recording : Recording
        As for `offset`.

    Returns
    -------
    ndarray, shape (n,)
        The reading with its `offset`, um.
    """
    reading = np.array(recording["laser"], dtype=np.float64)
    resets = np.flatnonzero(recording["laser_reset"])
    ends = [*resets[1:], len(reading) - 1]
    for k, end in zip(resets, ends[: len(resets)], strict=True):
        reading[k + 1 : end + 1] += _missing(recording, int(k), int(end))
    return reading


def _missing(recording: Recording, reset: int, end: int) -> float:
    """What readings after a reset up to `end` lack, um."""
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
