"""Tracking of targets that change all the time, such as a trajectory in a CSV file.

The metrics are the error on the way and the lag. Macro errors come from the encoder, micro
errors from the laser.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.control.supervisor import MICRO as FINE
from macromicro.design import zero
from macromicro.design.response import PITCH
from macromicro.programme import MACRO, MICRO, Programme, dense
from macromicro.recording import Recording

MOST_LAG = 1.0  # s
ROWS = 20_000  # that a lag is estimated from, evenly spread


class Tracking(NamedTuple):
    stage: str  # "macro" or "micro"
    unit: str  # mm for macro, um for micro; of all errors
    targets: int  # how many
    start_s: float  # first target, s
    end_s: float  # last row, s
    rms_error: float  # RMS of reference less reading
    peak_error: float  # its largest magnitude
    peak_s: float  # where that was, s
    # delay by which the reading follows the reference best (least squares, up to 1 s), s
    lag_s: float | None
    rms_without_lag: float | None  # what is left of the error after it


class Course(NamedTuple):
    t: Array  # s
    reference: Array  # in the stage's unit
    reading: Array  # in the stage's unit


def followed_stages(recording: Recording, programme: Programme) -> tuple[int, ...]:
    """The stages whose targets change fast enough for a trajectory."""
    if not len(recording) or programme.mixed:
        return ()
    begun = min(int(recording["move"][-1]) + 1, len(programme.stage))
    rows = np.searchsorted(recording["move"], np.arange(begun))
    found = []
    for stage in (MACRO, MICRO):
        mine = rows[programme.stage[:begun] == stage]
        if dense(mine * recording.dt):
            found.append(stage)
    return tuple(found)


def course(
    recording: Recording, programme: Programme, stage: int, pitch: float = PITCH
) -> Course | None:
    numbers = np.flatnonzero(programme.stage == stage)
    a = int(np.searchsorted(recording["move"], numbers[0]))
    t = recording["t"][a:]
    if stage == MACRO:
        scale = pitch * 1e3
        reference, reading = recording["macro_reference"][a:], recording["macro_position"][a:]
        good = np.isfinite(reading)
        found = Course(t[good], reference[good] * scale, reading[good] * scale)
    else:
        reading = zero.contraction(recording)[a:]
        good = (recording["phase"][a:] == FINE) & (recording["laser_reset"][a:] == 0)
        good &= np.isfinite(reading)
        found = Course(t[good], recording["micro_reference"][a:][good] * 1e3, reading[good])
    return found if len(found.t) > 1 else None


def tracking(recording: Recording, programme: Programme, *, pitch: float = PITCH) -> list[Tracking]:
    results = []
    for stage in followed_stages(recording, programme):
        seen = course(recording, programme, stage, pitch)
        if seen is None:
            continue
        error = seen.reference - seen.reading
        worst = int(np.argmax(np.abs(error)))
        lag, left = lagging(seen.reference, seen.reading, recording.dt)
        results.append(
            Tracking(
                stage="macro" if stage == MACRO else "micro",
                unit="mm" if stage == MACRO else "um",
                targets=int(np.sum(programme.stage == stage)),
                start_s=float(seen.t[0]),
                end_s=float(seen.t[-1]),
                rms_error=_rms(error),
                peak_error=float(abs(error[worst])),
                peak_s=float(seen.t[worst]),
                lag_s=lag,
                rms_without_lag=left,
            )
        )
    return results


def lagging(reference: Array, reading: Array, dt: float) -> tuple[float | None, float | None]:
    """Lag of least mean square error, between samples by a parabola."""
    step = max(1, len(reference) // ROWS)
    r, y = reference[::step], reading[::step]
    most = min(round(MOST_LAG / (dt * step)), len(r) // 4)
    if most < 1 or np.ptp(r) == 0.0:
        return None, None
    n = len(r) - most  # the same stretch of the reference for every lag
    squares = np.array([np.mean((y[k : k + n] - r[:n]) ** 2) for k in range(most + 1)])
    best = int(np.argmin(squares))
    shift = float(best)
    if 0 < best < most:
        before, least, after = squares[best - 1 : best + 2]
        bend = before - 2.0 * least + after
        if bend > 0.0:
            shift += 0.5 * float(before - after) / float(bend)
    return shift * dt * step, math.sqrt(float(squares[best]))


def _rms(values: Array) -> float:
    return math.sqrt(float(np.mean(values * values)))
