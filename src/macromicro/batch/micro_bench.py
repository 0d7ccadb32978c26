"""The job "micro-bench": the micro-stage under its law, steps 0 - 2 - 3 - 2 - 0 mm."""

from __future__ import annotations

import math

import numpy as np

from macromicro.batch.bench_job import BenchJob
from macromicro.batch.scratch import Scratch
from macromicro.batch.variants import Metric, shipped
from macromicro.control import settings as control_settings
from macromicro.design.response import smoothed
from macromicro.loop import PERIOD
from macromicro.programme import Programme
from macromicro.recording import Recording
from macromicro.runs.sequence import LEVELS, MEAN, TIMES, micro_steps, settling
from macromicro.settings import Settings
from macromicro.simulate import Outcome

HOLD, TAIL = 2.0, 0.5  # s

METRICS: tuple[Metric, ...] = (
    Metric("contraction", "s", "mean settling of the steps that contract, into 10 um"),
    Metric("extension", "s", "mean settling of the steps that extend, into 10 um"),
    Metric("overshoot", "um", "largest overshoot of a step, by the laser"),
    Metric("worst_error", "um", "largest mean error of a hold's last 0.5 s, by the laser"),
    Metric("iae", "mm*s", "integral of the absolute error, by the laser"),
    Metric("saturated", "", "share of the samples with the effort at a limit"),
    Metric("fault", "", "which fault of the guard stopped the run, 0 for none"),
)


def steps() -> Programme:
    return micro_steps(LEVELS, HOLD, TIMES)


def judged(seen: Recording, settings: Settings) -> list[float]:
    times = settling(seen)
    laser = smoothed(seen["laser"], MEAN)
    beyond, left, before = 0.0, 0.0, 0.0
    rows, tail = round(HOLD / PERIOD), round(TAIL / PERIOD)
    for time, level in zip(TIMES, LEVELS, strict=True):
        a = round(time / PERIOD)
        error = 1e6 * level - laser[a : a + rows]
        beyond = max(beyond, float((-math.copysign(1.0, level - before) * error).max()))
        left = max(left, abs(float(error[-tail:].mean())))
        before = level
    first = round(TIMES[0] / PERIOD)
    errors = 1e3 * seen["micro_reference"][first:] - laser[first:]
    law = control_settings.prepare(settings.controller, table=shipped()).micro
    effort = seen["ctrl"][first:]
    full = (effort <= law.low) | (effort >= law.high)
    return [
        float(np.mean(times[:2])),
        float(np.mean(times[2:])),
        beyond,
        left,
        1e-3 * float(np.abs(errors).sum()) * PERIOD,
        float(full.mean()),
    ]


class MicroBenchJob(BenchJob):
    """The steps on the whole bench with its guard, the carriage at rest at 0."""

    name = "micro-bench"
    metrics = METRICS
    columns = ("t", "laser", "micro_reference", "ctrl")

    def programme(self, settings: Settings) -> Programme:
        return steps()

    def measure(self, place: Scratch, settings: Settings, outcome: Outcome) -> list[float]:
        if not outcome.finished:
            return [*[math.nan] * (len(METRICS) - 1), float(outcome.watch.fault)]
        return [*judged(place.recording(), settings), 0.0]
