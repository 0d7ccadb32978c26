"""Steps of the micro-stage as programmes, and the sequence for judging gains.

The thesis gives the sequence's times (Section 5.3.1); the levels are this project's.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from macromicro.design.response import entry, smoothed
from macromicro.errors import InputError
from macromicro.programme import MICRO, Programme
from macromicro.recording import Recording

LEVELS, TIMES = (2e-3, 3e-3, 2e-3, 0.0), (1.0, 3.0, 5.0, 7.0)  # m, s
BAND_UM = 10.0
MEAN = 21  # samples of the centred mean that takes the laser's fast noise


def micro_steps(
    levels: Sequence[float], hold: float = 2.0, times: Sequence[float] | None = None
) -> Programme:
    target = np.asarray(levels, dtype=np.float64)
    if target.ndim != 1 or not target.size or not np.isfinite(target).all():
        raise InputError("micro steps, levels", list(levels), "a list of positions in m")
    if not (math.isfinite(hold) and hold > 0.0):
        raise InputError("micro steps, hold", hold, "seconds above 0")
    n = len(target)
    start, holds, end = np.full(n, math.nan), np.full(n, hold), math.nan
    if times is not None:
        start = np.asarray(times, dtype=np.float64)
        accepted = f"{n} times in s, from 0 on and rising"
        if start.shape != target.shape or not np.isfinite(start).all() or start[0] < 0.0:
            raise InputError("micro steps, times", list(times), accepted)
        holds = np.append(np.diff(start), hold)
        if holds.min() <= 0.0:
            raise InputError("micro steps, times", list(times), accepted)
        end = float(start[-1] + hold)
    return Programme("", start, np.full(n, MICRO, dtype=np.int64), target, holds, end, "")


def settling(recording: Recording, band: float | None = BAND_UM) -> list[float]:
    """Settling time into `band` [um] of each step of the sequence, by the laser."""
    place = smoothed(recording["laser"], MEAN)
    found = []
    before = 0.0
    for time, level in zip(TIMES, LEVELS, strict=True):
        a = round(time / recording.dt)
        error = 1e6 * level - place[a : a + round(2.0 / recording.dt)]
        width = 2e4 * abs(level - before) if band is None else band
        held = len(error) == round(2.0 / recording.dt)
        row = entry(error, width, recording.dt, 0.0) if held else None
        found.append(float("nan") if row is None else row * recording.dt)
        before = level
    return found
