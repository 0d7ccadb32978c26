"""The job "programme": the whole bench with supervisor and guard on a motion programme."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from macromicro import programme as programmes
from macromicro.batch.bench_job import BenchJob
from macromicro.batch.scratch import Scratch
from macromicro.batch.variants import (
    Metric,
)
from macromicro.design.extension import extension
from macromicro.design.response import MoveResult, moves
from macromicro.design.vibration import vibration
from macromicro.programme import Programme
from macromicro.programme.travel import limits
from macromicro.settings import Settings
from macromicro.simulate import Outcome

METRICS: tuple[Metric, ...] = (
    Metric("arrived", "", "1: the run ended by itself and every move arrived"),
    Metric("fault", "", "which fault of the guard stopped the run, 0 for none"),
    Metric("macro_settling", "s", "slowest macro move's settling"),
    Metric("macro_overshoot", "count", "largest macro overshoot"),
    Metric("settle_up", "s", "mean settling of micro moves that contract"),
    Metric("settle_down", "s", "mean settling of micro moves that extend"),
    Metric("hold_error", "um", "largest final error of a micro hold, by the laser"),
    Metric("extension", "s", "slowest return to zero before a macro move"),
    Metric("vibration", "um", "largest vibration after a macro move"),
    Metric("hottest", "degC", "highest wire temperature, by the bench's truth"),
)
_MEASURED = (
    *("t", "move", "phase", "macro_position", "laser", "laser_reset", "hall_position"),
    "true_wire",
)


class ProgrammeJob(BenchJob):
    """A programme on the whole bench, judged by its moves."""

    name = "programme"
    metrics = METRICS
    columns = _MEASURED

    def __init__(
        self,
        programme: str = "thesis",
        cycles: int = 1,
        fan: bool = False,
        seed: int = 0,
        settings: Settings | None = None,
    ) -> None:
        super().__init__(settings, seed, fan)
        path = programmes.find(str(programme))

        @cache
        def loaded(pitch: float) -> Programme:
            # One programme for all variants, whose stages may have less of their ways left.
            most = limits(self._settings.travel, pitch)
            return programmes.load(path, most).repeated(cycles)

        self._loaded = loaded
        self.programme(self._settings)  # what is wrong with the file is said at once

    def programme(self, settings: Settings) -> Programme:
        return self._loaded(settings.sensors.encoder.pitch)

    def measure(self, place: Scratch, settings: Settings, outcome: Outcome) -> list[float]:
        seen = place.recording()
        hottest = float(seen["true_wire"].max())
        if not outcome.finished:
            fault = float(outcome.watch.fault)
            return [0.0, fault, *[math.nan] * (len(METRICS) - 3), hottest]
        pitch, band = settings.sensors.encoder.pitch, settings.controller.sequence.tolerance
        done = moves(seen, self.programme(settings), pitch=pitch, macro_band=band)
        coarse = [m for m in done if m.stage == "macro"]
        fine = [m for m in done if m.stage == "micro"]
        shaken = [v.amplitude_um for m in coarse if (v := vibration(seen, m)) is not None]
        beyond = [m.overshoot for m in coarse]
        up, down = directions(done)
        return [
            float(all(m.arrived_s is not None for m in done)),
            0.0,
            worst([m.settling_s for m in coarse]),
            worst(beyond) / (1e3 * pitch),
            mean([m.settling_s for m in up]),
            mean([m.settling_s for m in down]),
            worst([m.final_error for m in fine]),
            worst([e.time_s for e in extension(seen)]),
            worst(list(shaken)),
            hottest,
        ]


def worst(values: list[float | None]) -> float:
    """The largest magnitude."""
    sizes = [math.nan if v is None else abs(v) for v in values]
    return float(np.max(sizes)) if sizes else math.nan


def mean(values: list[float | None]) -> float:
    return float(np.mean([math.nan if v is None else v for v in values])) if values else math.nan


def directions(done: list[MoveResult]) -> tuple[list[MoveResult], list[MoveResult]]:
    """Micro moves that contract, and those that extend.

    The direction is from the place before; a macro move resets the micro-stage to 0.
    """
    up: list[MoveResult] = []
    down: list[MoveResult] = []
    before = 0.0
    for move in done:
        if move.stage == "macro":
            before = 0.0
            continue
        if move.target != before:
            (up if move.target > before else down).append(move)
        before = move.target
    return up, down
