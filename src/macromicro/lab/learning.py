"""Iterative learning of a repeated trajectory of the micro-stage, from its Hall sensor.

A zero-phase low-pass gives robustness (Bristow, Tharayil and Alleyne, IEEE Control Systems
Magazine 26(3), 2006).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from macromicro.arrays import Array
from macromicro.control.supervisor import MICRO as FINE
from macromicro.design import zero
from macromicro.errors import MacromicroError, ProblemError
from macromicro.nominal import PERIOD
from macromicro.programme import MICRO, Programme, dense
from macromicro.programme.moves import Limits
from macromicro.recording import Recording
from macromicro.settings import Settings

GAIN = 0.3  # of the error that a repetition corrects
CUTOFF = 15.0  # Hz, of what is learned
REPEATS = 10
LATE = 1.0  # s from the trajectory's first target on that count in no RMS


class Repetition(NamedTuple):
    # rms, peak: of the error by the Hall sensor, its lag taken out, m
    rms: float
    peak: float
    true: float  # RMS of the error by the laser, m; NaN without one


class Course(NamedTuple):
    """Error of a run at each sample of the trajectory."""

    t: Array  # s
    error: Array  # target, as the sensor would show it, less what it shows, m
    true: Array  # target less the laser's reading, m; NaN where there is none


class Learned(NamedTuple):
    programme: Programme  # with the correction of the best repetition
    repetitions: list[Repetition]  # in their order; the first has what the programme had
    best: int  # the one whose correction it is
    # first, last: of the first repetition, and of the best
    first: Course
    last: Course


def sensor_lag(settings: Settings) -> float:
    """Lag of the Hall sensor, as far as it was identified."""
    return float(getattr(settings.controller.fine, "sensor", 0.0))


Run = Callable[[Programme, int], Recording]
Told = Callable[[int, Repetition], None]


def learn(
    programme: Programme, run: Run, lag: float, limits: Limits, repeats: int = REPEATS,
    told: Told | None = None,
) -> Learned:  # fmt: skip
    """Repeat a trajectory of the micro-stage and correct it by each run's error."""
    rows = _rows(programme)
    t, target = programme.start[rows], programme.target[rows]
    least = np.minimum(limits.micro_lo - target, 0.0)  # the sum stays within the travel
    most = np.maximum(limits.micro_hi - target, 0.0)
    grid = np.arange(t[0], t[-1] + 0.5 * PERIOD, PERIOD)
    smooth = 1.0 / (2.0 * math.pi * CUTOFF * PERIOD)
    given = programme.correction if len(programme.correction) else np.zeros_like(programme.target)
    tried = [programme._replace(correction=given)]
    courses: list[Course] = []
    seen: list[Repetition] = []
    for k in range(repeats):
        course = _course(run(tried[k], k), rows, lag)
        courses.append(course)
        seen.append(_judge(course))
        if told is not None:
            told(k, seen[k])
        missed = np.interp(grid + lag, course.t, course.error)
        have = np.interp(grid, t, tried[k].correction[rows])
        learned = gaussian_filter1d(have + GAIN * missed, smooth, mode="nearest")
        correction = np.zeros_like(programme.target)
        correction[rows] = np.clip(np.interp(t, grid, learned), least, most)
        tried.append(programme._replace(correction=correction))
    best = min(range(repeats), key=lambda k: seen[k].rms)
    return Learned(tried[best], seen, best, courses[0], courses[best])


def _rows(programme: Programme) -> np.ndarray:
    """The rows of the trajectory: successive ones of the micro-stage."""
    rows = np.flatnonzero(programme.stage == MICRO)
    accepted = "Give a programme by time (CSV) with successive micro targets (docs/tuning.md)."
    if not programme.scheduled or not dense(programme.start[rows]):
        raise ProblemError(programme.source, "no trajectory of the micro-stage", accepted)
    steps = np.diff(programme.start[rows])
    rows = rows[int(np.argmax(steps < 5.0 * np.median(steps))) :]
    if (np.diff(rows) > 1).any():
        raise ProblemError(programme.source, "macro moves between its micro targets", accepted)
    return rows


def _course(recording: Recording, rows: np.ndarray, lag: float) -> Course:
    """Error of a run, from the trajectory's first target to its end."""
    if not recording.attributes.get("finished", 1):
        why = recording.attributes.get("fault", "it was interrupted")
        raise MacromicroError(f"a repetition ended early: {why}")
    move = recording["move"]
    within = (move >= rows[0]) & (move <= rows[-1]) & (recording["phase"] == FINE)
    target = recording["micro_reference"][within] * 1e-3
    shown = recording["hall_position"][within] * 1e-3
    laser = np.full(len(target), math.nan)
    if "laser" in recording:
        laser = zero.contraction(recording)[within] * 1e-6
    return Course(recording["t"][within], _lag_behind(target, lag) - shown, target - laser)


def _lag_behind(wanted: Array, lag: float) -> Array:
    """Positions behind the sensor's first-order lag."""
    if lag <= 0.0:
        return wanted
    from scipy.signal import lfilter

    share = math.exp(-PERIOD / lag)
    shown, _ = lfilter([1.0 - share], [1.0, -share], wanted, zi=[share * wanted[0]])
    return np.asarray(shown)


def _judge(course: Course) -> Repetition:
    counted = course.t >= course.t[0] + LATE
    error, true = course.error[counted], course.true[counted]
    true = true[np.isfinite(true)]
    by_laser = math.sqrt(float(np.mean(true**2))) if len(true) else math.nan
    return Repetition(math.sqrt(float(np.mean(error**2))), float(np.max(np.abs(error))), by_laser)
