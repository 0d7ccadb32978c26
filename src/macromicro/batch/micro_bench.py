"""The job "micro-bench": the micro-stage under its law, steps 0 - 2 - 3 - 2 - 0 mm."""

from __future__ import annotations

import math

import numpy as np

from macromicro.batch.programme_job import TwoStageJob
from macromicro.batch.variants import Metric
from macromicro.control import settings as control_settings
from macromicro.design.response import smoothed
from macromicro.loop import PERIOD
from macromicro.programme import Programme
from macromicro.recording import Recording
from macromicro.runs.programmed import TwoStageSetup
from macromicro.runs.sequence import LEVELS, MEAN, TIMES, micro_steps, settling
from macromicro.settings import Settings

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


class MicroSteps(TwoStageSetup):
    """The steps on the whole bench with its guard, the carriage at rest at 0."""

    metrics, judged = METRICS, ("t", "laser", "micro_reference", "ctrl")

    def measured(self, recording: Recording, code: int) -> list[float]:
        if code:
            return [*[math.nan] * (len(METRICS) - 1), float(code)]
        times = settling(recording)
        laser = smoothed(recording["laser"], MEAN)
        beyond, left, before = 0.0, 0.0, 0.0
        rows, tail = round(HOLD / PERIOD), round(TAIL / PERIOD)
        for time, level in zip(TIMES, LEVELS, strict=True):
            a = round(time / PERIOD)
            error = 1e6 * level - laser[a : a + rows]
            beyond = max(beyond, float((-math.copysign(1.0, level - before) * error).max()))
            left = max(left, abs(float(error[-tail:].mean())))
            before = level
        first = round(TIMES[0] / PERIOD)
        errors = 1e3 * recording["micro_reference"][first:] - laser[first:]
        law = control_settings.prepare(self.settings.controller).micro
        effort = recording["ctrl"][first:]
        full = (effort <= law.low) | (effort >= law.high)
        return [
            float(np.mean(times[:2])),
            float(np.mean(times[2:])),
            beyond,
            left,
            1e-3 * float(np.abs(errors).sum()) * PERIOD,
            float(full.mean()),
            0.0,
        ]


class MicroBenchJob(TwoStageJob):
    name, metrics = "micro-bench", METRICS

    def __init__(self, settings: Settings | None = None, seed: int = 0, fan: bool = False) -> None:
        super().__init__(Settings() if settings is None else settings, seed)
        self._fan = fan

    def setup(self, settings: Settings) -> MicroSteps:
        return MicroSteps(settings, steps(), fan=self._fan)
