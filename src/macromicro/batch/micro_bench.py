"""The job "micro-bench": the micro-stage under its law, steps 0 - 2 - 3 - 2 - 0 mm."""

from __future__ import annotations

import math

import numpy as np

from macromicro.batch.scratch import Scratch
from macromicro.batch.variants import Array, Metric, shipped
from macromicro.batch.whole_bench import BenchJob
from macromicro.control import settings as control_settings
from macromicro.design.response import entry, smoothed
from macromicro.loop import PERIOD
from macromicro.programme import MICRO, Programme
from macromicro.settings import Settings
from macromicro.simulate import Outcome

LEVELS = (2.0, 3.0, 2.0, 0.0)  # mm (Figures 5.22 to 5.26)
TIMES = (1.0, 3.0, 5.0, 7.0)  # s
HOLD, TAIL = 2.0, 0.5  # s
BAND = 10.0  # um
MEAN = 21  # samples of the centred mean that takes the laser's fast noise

METRICS: tuple[Metric, ...] = (
    Metric("settle_up", "s", "mean settling of the steps that contract, into 10 um"),
    Metric("settle_down", "s", "mean settling of the steps that extend, into 10 um"),
    Metric("overshoot", "um", "largest overshoot of a step, by the laser"),
    Metric("worst_error", "um", "largest mean error of a hold's last 0.5 s, by the laser"),
    Metric("iae", "mm*s", "integral of the absolute error, by the laser"),
    Metric("saturated", "", "share of the samples with the effort at a limit"),
    Metric("fault", "", "which fault of the guard stopped the run, 0 for none"),
)


def steps() -> Programme:
    """The steps, at their times."""
    n = len(LEVELS)
    hold = np.append(np.diff(TIMES), HOLD)
    end = TIMES[-1] + HOLD
    target = 1e-3 * np.array(LEVELS)
    return Programme("", np.array(TIMES), np.full(n, MICRO, np.int64), target, hold, end, "")


class MicroBenchJob(BenchJob):
    """The steps on the whole bench with its guard, the carriage standing at 0."""

    name = "micro-bench"
    metrics = METRICS
    columns = ("t", "laser", "micro_reference", "ctrl")

    def programme(self, settings: Settings) -> Programme:
        """The steps."""
        return steps()

    def measure(self, place: Scratch, settings: Settings, outcome: Outcome) -> list[float]:
        """`METRICS`; all NaN but the fault for a run that the guard stopped."""
        if not outcome.finished:
            return [*[math.nan] * (len(METRICS) - 1), float(outcome.watch.fault)]
        seen = place.recording()
        laser = smoothed(seen["laser"], MEAN)
        settled, beyond, left = _steps(laser)
        first = round(TIMES[0] / PERIOD)
        errors = 1e3 * seen["micro_reference"][first:] - laser[first:]
        law = control_settings.prepare(settings.controller, table=shipped()).micro
        effort = seen["ctrl"][first:]
        full = (effort <= law.low) | (effort >= law.high)
        return [
            float(np.mean(settled[:2])),
            float(np.mean(settled[2:])),
            beyond,
            left,
            1e-3 * float(np.abs(errors).sum()) * PERIOD,
            float(full.mean()),
            0.0,
        ]


def _steps(laser: Array) -> tuple[list[float], float, float]:
    """Settling [s] of each step; largest overshoot and largest error left [um]."""
    settled, beyond, left, before = [], 0.0, 0.0, 0.0
    rows, tail = round(HOLD / PERIOD), round(TAIL / PERIOD)
    for time, level in zip(TIMES, LEVELS, strict=True):
        a = round(time / PERIOD)
        error = 1e3 * level - laser[a : a + rows]
        row = entry(error, BAND, PERIOD, 0.0)
        settled.append(math.nan if row is None else row * PERIOD)
        beyond = max(beyond, float((-math.copysign(1.0, level - before) * error).max()))
        left = max(left, abs(float(error[-tail:].mean())))
        before = level
    return settled, beyond, left
