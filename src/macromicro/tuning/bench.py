"""The stages of the two-stage machine, tuned one at a time.

The macro-stage makes a step of r = 2800 counts from rest, L = 10 s. With the settling time T [s]
into 2 %, or L (1 + |final error| / r) where it never settles:

    settling  T        [s]
    iae       IAE / r  [s]
    effort    peak effort / 1 V
    overshoot 1 s/count * max(0, overshoot - 0.5 count)
    saturated weight * samples saturated after the first; none unless asked for
    slower    10 * max(0, T / T0 - 1), of effort alone

The micro-stage makes steps 0 - 2 - 3 - 2 - 0 mm, each held 2 s. With T the mean settling up plus
the mean settling down [s] into 10 um, 2 s for one that never settles:

    settling  T          [s]
    iae       IAE / 1 mm [s]
    effort    share of the samples saturated
    overshoot 50 ms/um * max(0, overshoot - 10 um)
    error     50 ms/um * max(0, worst error - 5 um)
    slower    10 * max(0, T / T0 - 1), of effort alone

The peak effort is the one requested after the first sample, before the limit; T0 is T of the
first gains on the same machine.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from macromicro.batch import macro_bench, micro_bench
from macromicro.design.margins import frequencies
from macromicro.design.response import smoothed
from macromicro.lab.drive import closed_loop
from macromicro.models.macro import Linear
from macromicro.nominal import COUNTS, PERIOD
from macromicro.plant import bench
from macromicro.recording import Recording
from macromicro.runs.programmed import on_twin
from macromicro.runs.sequence import MEAN
from macromicro.schema import config
from macromicro.settings import Settings
from macromicro.tuning import loops
from macromicro.tuning.gains import OWN, Law
from macromicro.tuning.subject import (
    Bode,
    Figures,
    Knob,
    Margin,
    Objective,
    Panel,
    Penalty,
    Subject,
)
from macromicro.uncertainty import table
from macromicro.uncertainty.table import Uncertain

STEP = COUNTS  # counts; the whole travel
SECONDS = 10.0
SMALL = 0.5  # counts; an overshoot below it never shows in the encoder
MICRO_BAND, MICRO_ERROR = 10.0, 5.0  # um
NEVER = 2.0  # s; the hold of the micro-stage's steps
_MARGINS = (
    ("gain", "gain margin (factor)", ""),
    ("phase", "phase margin", "deg"),
    ("crossover", "crossover", "rad/s"),
    ("delay", "delay margin", "s"),
    ("disk", "disk margin alpha", ""),
    ("disk_gain", "gain margin of the disk (factor)", ""),
    ("disk_phase", "phase margin of the disk", "deg"),
)


def macro_time(found: Figures) -> float:
    """T of the macro-stage."""
    if math.isnan(found["settling_time"]):
        return SECONDS * (1.0 + abs(found["final_error"]) / STEP)
    return found["settling_time"]


def micro_time(found: Figures) -> float:
    """T of the micro-stage."""
    each = (found["contraction"], found["extension"])
    return sum(NEVER if math.isnan(one) else one for one in each)


def _beyond(name: str, free: float) -> Callable[[Figures, Figures], float]:
    return lambda found, _: max(0.0, found[name] - free)


def _slower(time: Callable[[Figures], float]) -> Penalty:
    def amount(found: Figures, first: Figures) -> float:
        return max(0.0, time(found) / time(first) - 1.0)

    return Penalty("slower", 10.0, "1", "T / T0 - 1, where it is above 0", amount)


_MACRO = (
    Penalty("overshoot", 1.0, "s/count", "overshoot - 0.5 count", _beyond("overshoot", SMALL)),
    Penalty("saturated", 0.0, "s", "sample saturated after the first", _beyond("saturated", 0.0)),
)
_MICRO = (
    Penalty("overshoot", 0.05, "s/um", "overshoot - 10 um", _beyond("overshoot", MICRO_BAND)),
    Penalty("error", 0.05, "s/um", "worst error - 5 um", _beyond("worst_error", MICRO_ERROR)),
)
MACRO_OBJECTIVES = (
    Objective("settling", "s", "T", macro_time, _MACRO),
    Objective("iae", "s", "IAE / step", lambda m: m["iae"] / STEP, _MACRO),
    Objective(
        "effort", "", "peak effort / 1 V", lambda m: m["peak_effort"],
        (*_MACRO, _slower(macro_time)),
    ),
)  # fmt: skip
MICRO_OBJECTIVES = (
    Objective("settling", "s", "T", micro_time, _MICRO),
    Objective("iae", "s", "IAE / 1 mm", lambda m: m["iae"], _MICRO),
    Objective(
        "effort", "", "share saturated", lambda m: m["saturated"], (*_MICRO, _slower(micro_time))
    ),
)


class _Bench(Subject):
    default = Settings()

    def __init__(self, settings: Settings, law: Law) -> None:
        self.start = settings._replace(controller=law.under(settings.controller))
        self.machine, self.name, self.law = settings.machine(), law.stage, law.name
        self.paths, self._law = law.paths, law

    def knobs(self, settings: Settings) -> tuple[Knob, ...]:
        return self._law.knobs(settings.controller)

    def applied(self, settings: Settings, values: list[float]) -> Settings:  # type: ignore[override]
        return settings._replace(controller=self._law.applied(settings.controller, values))

    @property
    def uncertain(self) -> tuple[Uncertain, ...]:
        return table.of_stage(self.name)

    def under(self, settings: Settings, other: Settings) -> Settings:
        return other._replace(controller=settings.controller)

    def as_toml(self, settings: Settings) -> str:
        chosen = f"controller.{self.name}_law"
        return config.changed_toml(settings, self.default, (chosen, *self.paths))


class Macro(_Bench):
    metrics = macro_bench.METRICS
    objectives = MACRO_OBJECTIVES

    def __init__(self, settings: Settings, law: Law) -> None:
        super().__init__(settings, law)
        if law.field == OWN:
            self.remarks = (f"{law.name} has no known linear part, so no margins.",)

    def recorded(self, settings: Settings) -> Recording:
        plant = bench.prepare(settings.bench, settings.sensors)
        aim = np.full(round(SECONDS / PERIOD), STEP)
        return closed_loop(plant, macro_bench.law_of(settings), aim)

    def run(self, settings: Settings, seed: int) -> Figures:
        law, seen = macro_bench.run(settings, STEP, round(SECONDS / PERIOD))
        values = macro_bench.judge(law, STEP, seen[0], seen[1])
        return dict(zip((m.name for m in self.metrics), values, strict=True))

    def doubts(self, settings: Settings, found: Figures) -> tuple[str, ...]:
        if not found["saturated"]:
            return ()
        return (
            f"The law asks for up to {found['peak_effort']:.5g} V, but the limit is "
            f"{self.start.controller.motor_limit:g} V: it saturates in {found['saturated']:.0f} "
            "samples after the first. --penalty saturated=0.01 searches for gains that avoid this.",
        )

    def panels(self, settings: Settings, seed: int) -> list[Panel]:
        done = self.recorded(settings)
        t, x = done["t"], done["macro_position"]
        moved = np.flatnonzero(np.diff(x))
        last = float(t[moved[-1]]) if len(moved) else 0.0
        rows = slice(0, int(np.searchsorted(t, min(max(1.5 * last, 0.2), float(t[-1])))))
        aim = (t[rows], np.full(rows.stop, STEP))
        near = (-0.03 * STEP, 0.08 * STEP)
        return [
            Panel("Step of the macro-stage", "counts", t[rows], x[rows], target=aim),
            Panel(
                "Error near the target", "counts", t[rows], STEP - x[rows], 0.02 * STEP, None, near
            ),
            Panel("Effort at the D/A board, limited", "V", t[rows], done["motor"][rows]),
        ]

    def bodes(self, settings: Settings) -> tuple[Bode, ...]:
        if self._law.field == OWN:
            return ()
        frequency = frequencies(Linear().dt, 600) / (2.0 * math.pi)
        loop = loops.macro_response(settings.controller, frequency)
        return (Bode(frequency, loop, "Open loop, linear model (4.4)"),)

    def margins(self, settings: Settings) -> tuple[Margin, ...]:
        if self._law.field == OWN:
            return ()
        found = loops.macro_margins(settings.controller)
        return tuple(Margin(key, words, getattr(found, key), unit) for key, words, unit in _MARGINS)


class Micro(_Bench):
    metrics = micro_bench.METRICS
    objectives = MICRO_OBJECTIVES
    remarks = (
        "The micro-stage has no linear model, so gain, phase and disk margins are not defined. Its "
        "ripple margin is the largest factor on all gains at which a hold at 2 mm stays within "
        f"10 um on the bench; {loops.MOST:g} is the largest tried.",
    )

    def __init__(self, settings: Settings, law: Law) -> None:
        super().__init__(settings, law)
        self._job = micro_bench.MicroBenchJob(self.start)

    def run(self, settings: Settings, seed: int) -> Figures:
        values = self._job.one(settings, seed)
        return dict(zip((m.name for m in self.metrics), values, strict=True))

    def accepted(self, settings: Settings) -> bool:
        return loops.holds(settings, self._law)

    def panels(self, settings: Settings, seed: int) -> list[Panel]:
        done = on_twin(micro_bench.steps(), settings, seed)
        t, aim, place = done["t"], done["micro_reference"], smoothed(done["laser"], MEAN)
        error = 1e3 * aim - place
        return [
            Panel("Steps of the micro-stage, laser", "mm", t, 1e-3 * place, target=(t, aim)),
            Panel("Error by the laser", "um", t, error, MICRO_BAND, None, (-60.0, 60.0)),
            Panel("Effort CTRL", "V", t, done["ctrl"]),
        ]

    def margins(self, settings: Settings) -> tuple[Margin, ...]:
        found = loops.ripple_margin(settings, self._law)
        return (Margin("ripple", "ripple margin (factor)", found, ""),)
