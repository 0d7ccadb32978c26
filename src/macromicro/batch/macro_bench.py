"""The job "macro-bench": the macro-stage of the bench under any of its laws."""

from __future__ import annotations

import numpy as np

from macromicro.arrays import Array
from macromicro.batch.variant_job import VariantJob
from macromicro.batch.variants import Metric, Variants, variant_name
from macromicro.control import settings as control_settings
from macromicro.control.macro import MacroLaw
from macromicro.design import steps
from macromicro.errors import InputError
from macromicro.lab import carriage
from macromicro.lab.carriage import MacroBench
from macromicro.loop import PERIOD
from macromicro.nominal import COUNTS
from macromicro.plant import bench
from macromicro.settings import Settings

REFERENCE = "reference"  # beside the tree's paths: the step [counts]
SMALLEST = 10.0  # counts; a smaller step has no 2 % and begins where it ends

METRICS: tuple[Metric, ...] = (
    Metric("settling_time", "s", "time from which the error stays within 2 % of the step"),
    Metric("rise_time", "s", "time of the first 98 % of the step"),
    Metric("overshoot", "count", "largest distance beyond the target"),
    Metric("iae", "count*s", "integral of the absolute error"),
    Metric("final_error", "count", "target minus position at the end"),
    Metric("peak_effort", "V", "largest requested effort after the first sample"),
    Metric("saturated", "", "saturated samples after the first"),
    Metric("reversals", "", "reversals of the position after it is within 2 counts of the target"),
)


def judge(law: MacroLaw, target: float, x: Array, sent: Array) -> tuple[float, ...]:
    """The `METRICS` of a step under a law: target and run [counts], limited effort [V].

    The efforts of the first sample, its kick and jump, do not count.
    """
    asked = carriage.unlimited_effort(law, np.full_like(x, target), x)
    return (
        steps.settling_time(x, target),
        steps.rise_time(x, target),
        steps.overshoot(x, target),
        float(np.abs(target - x).sum()) * PERIOD,
        float(target - x[-1]),
        float(np.abs(asked[1:]).max()),
        float(np.count_nonzero(asked[1:] != sent[1:])),
        float(len(steps.swings(x, target))),
    )


def law_of(settings: Settings) -> MacroLaw:
    return control_settings.prepare(settings.controller, pitch=settings.sensors.encoder.pitch).macro


def _part(settings: Settings) -> MacroBench:
    return MacroBench(
        settings.bench.amplifier,
        bench.macro_stage(settings.bench),
        settings.sensors.encoder,
        int(settings.bench.steps.macro),
    )


def run(settings: Settings, target: float, samples: int) -> tuple[MacroLaw, Array]:
    """The law, and position [counts] and limited effort [V] of a step from rest."""
    law = law_of(settings)
    return law, carriage.run(_part(settings), law, True, np.full(samples, target), 0.5)


class MacroBenchJob(VariantJob):
    """A step of the bench's macro-stage from rest at 0 at 1 kHz, never parked.

    The path "reference" sets a variant's own step [counts].
    """

    name, metrics, beside = "macro-bench", METRICS, REFERENCE

    def __init__(
        self, settings: Settings | None = None, reference: float = COUNTS, length: float = 10.0
    ) -> None:
        super().__init__(Settings() if settings is None else settings)
        self._reference = float(reference)
        if not 2.0 * PERIOD <= length <= 3600.0:
            raise InputError("length", f"{length} s", "from 2 ms to an hour")
        self._samples = round(length / PERIOD)
        _step(self._reference, "reference")

    def prepare(self) -> None:
        for step in carriage.KERNELS:
            law_of(self._settings).machine(step)

    def _own(self, variants: Variants, values: Array, first: int) -> list[float]:
        if REFERENCE not in variants.paths:
            return [self._reference] * len(values)
        column = values[:, variants.paths.index(REFERENCE)]
        return [_step(float(v), variant_name(first + k, REFERENCE)) for k, v in enumerate(column)]

    def one(self, settings: Settings, target: float) -> tuple[float, ...]:
        law, seen = run(settings, target, self._samples)
        return judge(law, target, seen[0], seen[1])


def _step(target: float, where: str) -> float:
    if not SMALLEST <= abs(target) <= 1e6:
        accepted = f"{SMALLEST:g} to 1e6 counts in either direction"
        raise InputError(where, f"{target:g} count", accepted)
    return target
