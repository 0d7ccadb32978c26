"""The job "macro-bench": the macro-stage of the bench under any of its laws."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.batch import course
from macromicro.batch.course import METRICS, SMALLEST, Course, Task
from macromicro.batch.variants import (
    Trajectories,
    Variants,
    applied,
    checked,
    named,
    shipped,
    table,
)
from macromicro.control import macro as control
from macromicro.control import settings as control_settings
from macromicro.control.macro import MacroLaw
from macromicro.control.stage_law import Sample, Target
from macromicro.errors import InputError
from macromicro.kernel import kernel
from macromicro.loop import PERIOD
from macromicro.nominal import COUNTS
from macromicro.plant import amplifier, bench, carriage, encoder
from macromicro.plant.amplifier import Amplifier
from macromicro.plant.carriage import Macro, MacroState
from macromicro.plant.encoder import Encoder
from macromicro.settings import Settings

REFERENCE = "reference"  # beside the tree's paths: the step [counts]


class Stage(NamedTuple):
    amplifier: Amplifier
    macro: Macro
    encoder: Encoder
    substeps: int
    law: MacroLaw
    free: MacroLaw  # the same without its limit


@kernel
def run(
    p: Stage, judged: Task, s: MacroState, target: float, samples: int, dt: float, out: Array
) -> tuple[Course, float]:
    """Run a step: its course and the last error [counts]. The law is never parked."""
    law = p.law
    so_far = Course(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    memory = control.begun(law)
    latched, error, before = 0.0, 0.0, 0.0
    for k in range(samples):
        seen = encoder.count(p.encoder, s.x)
        error = target - seen
        aim, shown = Target(target, 0.0, 0.0, math.inf), Sample(k * dt, seen)
        _, asked = control.step(p.free, memory, aim, shown, dt)
        now, sent = control.step(law, memory, aim, shown, dt)
        so_far = course.follow(judged, so_far, k + 1.0, seen, error, before, asked, sent)
        if k == 0:
            so_far = course.first(so_far)
        memory, before = now, error
        if k < out.shape[1]:
            out[0, k], out[1, k] = seen, sent
        drive = amplifier.motor_volts(p.amplifier, latched, s.i)
        s = carriage.advance(p.macro, s, drive, dt, p.substeps)
        latched = amplifier.convert(p.amplifier, sent)
    return so_far, error


def stage(settings: Settings) -> Stage:
    law = control_settings.prepare(
        settings.controller, table=shipped(), pitch=settings.sensors.encoder.pitch
    ).macro
    return Stage(
        settings.bench.amplifier,
        bench.macro_stage(settings.bench),
        settings.sensors.encoder,
        int(settings.bench.steps.macro),
        law,
        law._replace(limit=math.inf),
    )


class MacroBenchJob:
    """A step of the bench's macro-stage from rest at 0 at 1 kHz, never parked.

    The path "reference" sets a variant's own step [counts].
    """

    name = "macro-bench"
    metrics = METRICS
    block = 1

    def __init__(
        self,
        settings: Settings | None = None,
        reference: float = COUNTS,
        length: float = 10.0,
    ) -> None:
        self._settings = Settings() if settings is None else settings
        self._known = table(self._settings)
        self._reference = float(reference)
        if not 2.0 * PERIOD <= length <= 3600.0:
            raise InputError("length", f"{length} s", "from 2 ms to an hour")
        self._samples = round(length / PERIOD)
        _step(self._reference, "reference")

    def base(self) -> Settings:
        return self._settings

    def evaluate(self, variants: Variants, first: int = 0) -> Array:
        values = checked(self._known, variants, first, (REFERENCE,))
        stage(self._settings).law.machine(run)  # once, before threads ask for it
        rows, errors, targets = np.empty((8, len(values))), *np.empty((2, len(values)))
        nothing = np.empty((2, 0))
        for k, row in enumerate(values):
            found, errors[k], targets[k] = self._run(variants.paths, row, first + k, nothing)
            rows[:, k] = found
        return course.measured(rows, errors, targets, self._samples, PERIOD)

    def _run(
        self, paths: tuple[str, ...], row: Array, number: int, out: Array
    ) -> tuple[Course, float, float]:
        """Course, last error and target of one variant."""
        settings = applied(self._settings, paths, row, number, (REFERENCE,))
        target = self._reference
        if REFERENCE in paths:
            target = _step(float(row[paths.index(REFERENCE)]), named(number, REFERENCE))
        p = stage(settings)
        rest = carriage.at_rest(0.5 * p.encoder.pitch)
        judged = course.task(target)
        found, error = p.law.machine(run)(p, judged, rest, target, self._samples, PERIOD, out)
        return found, error, target

    def trace(self, variants: Variants, every: int = 10, first: int = 0) -> Trajectories:
        values = checked(self._known, variants, first, (REFERENCE,))
        t = np.arange(self._samples, step=every, dtype=np.float64) * PERIOD
        shown, out = np.empty((2, len(values), len(t))), np.empty((2, self._samples))
        for k, row in enumerate(values):
            self._run(variants.paths, row, first + k, out)
            shown[:, k] = out[:, ::every]
        columns = {"macro_position": shown[0], "motor": shown[1]}
        return Trajectories(t, columns, {"macro_position": "count", "motor": "V"})


def _step(target: float, where: str) -> float:
    if not SMALLEST <= abs(target) <= 1e6:
        accepted = f"{SMALLEST:g} to 1e6 counts in either direction"
        raise InputError(where, f"{target:g} count", accepted)
    return target
