"""Programmes made of a few numbers, run in memory, for the procedures of Chapters 5 and 6."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np
import numpy.typing as npt

from macromicro import loop, simulate
from macromicro.columns import COLUMNS
from macromicro.control import settings as control_settings
from macromicro.control import supervisor
from macromicro.control.two_stage import TwoStage
from macromicro.design import response
from macromicro.design.response import MoveResult
from macromicro.design.tracking import followed
from macromicro.errors import InputError
from macromicro.experiments.machine import FLAGS, approach, known, recorded, watchdog
from macromicro.loop import PERIOD
from macromicro.programme import MACRO, MICRO, Programme
from macromicro.recording import Recording
from macromicro.rig.faults import describe
from macromicro.rig.guarded import Guarded
from macromicro.rig.session import Fixture
from macromicro.settings import Settings


class Runner(Protocol):
    """Whatever can run a programme and return its recording: the twin, or a real rig."""

    def __call__(self, programme: Programme, settings: Settings, seed: int, fan: bool) -> Recording:
        """The recording of `programme` under `settings`."""


class _Blocks:
    """A sink in memory."""

    def __init__(self) -> None:
        self.blocks: list[npt.NDArray[np.float64]] = []

    def append(self, block: npt.NDArray[np.float64]) -> None:
        """Keep the block."""
        self.blocks.append(block)


def on_twin(
    programme: Programme, settings: Settings, seed: int = 0, fan: bool = False
) -> Recording:
    """The programme on the virtual bench of `settings`. If the guard stops the run, the
    recording ends there, its attribute `finished` is 0 and `fault` says why."""
    sink = _Blocks()
    outcome = simulate.simulate(settings, programme, sink, seed=seed, fan=fan)
    attributes: dict[str, str | int | float] = {
        "programme": programme.title,
        "seed": seed,
        "fan": int(fan),
        "finished": int(outcome.finished),
    }
    fault = describe(outcome.watch)
    if fault is not None:
        attributes["fault"] = f"{fault.message} {fault.evidence}"
    return Recording.from_arrays(COLUMNS, np.concatenate(sink.blocks, axis=1), PERIOD, attributes)


def on_rig(fixture: Fixture) -> Runner:
    """Programmes on this rig: from cold, the carriage at rest at 0 counts, through the guard.

    A recording has what the rig measures, and nothing true. If the guard stops the run, the
    recording ends there, its attribute `finished` is 0 and `fault` says why.
    """

    def run(
        programme: Programme, settings: Settings, seed: int = 0, fan: bool = False
    ) -> Recording:
        _check(fixture, programme)
        table = fixture.calibrated() if np.any(programme.stage == MICRO) else fixture.table
        control = control_settings.prepare(settings.controller, fan, table)
        limits = fixture.limits or settings.guard
        blocks = _Blocks()
        with fixture.open(seed) as session:
            session.cold(fixture.rest)
            if fixture.has("encoder"):
                approach(fixture._replace(limits=limits), session, 0.0)
            session.restart()
            rig = Guarded(session, watchdog(limits, control.calibration), PERIOD)
            longest = round(simulate.longest(settings, programme) / PERIOD)
            last = loop.run(
                rig,
                TwoStage(control),
                simulate.plan(programme),
                PERIOD,
                supervisor.begin(0.0),
                blocks.append,
                longest,
            )
        rows = np.concatenate(blocks.blocks, axis=1)
        values = {c.name: row for c, row in zip(COLUMNS, rows, strict=True)}
        values |= {name: known(values[name]) for name in FLAGS}
        attributes: dict[str, str | int | float] = {
            "programme": programme.title,
            "fan": int(fan),
            "finished": int(last.phase == supervisor.DONE),
        }
        fault = describe(rig.watch)
        if fault is not None:
            attributes["fault"] = f"{fault.message} {fault.evidence}"
        return recorded(fixture, COLUMNS, values, PERIOD, seed, attributes)

    return run


def _check(fixture: Fixture, programme: Programme) -> None:
    """InputError unless the rig measures what the programme's stages are controlled by."""
    for stage, name, channel in ((MACRO, "macro", "encoder"), (MICRO, "micro", "hall")):
        if np.any(programme.stage == stage):
            fixture.need(f"a programme with {name} moves", channel)


def moves_of(recording: Recording, programme: Programme, settings: Settings) -> list[MoveResult]:
    """How each move went; a stage that follows a trajectory makes none."""
    return response.moves(
        recording,
        programme,
        pitch=settings.sensors.encoder.pitch,
        macro_band=settings.controller.sequence.tolerance,
        but=followed(recording, programme),
    )


def micro_steps(
    levels: Sequence[float], hold: float = 2.0, times: Sequence[float] | None = None
) -> Programme:
    """Steps of the micro-stage to `levels` [mm].

    Each is held for `hold` [s] and follows the one before; or they come at `times` [s], the
    last held for `hold`. InputError for numbers that make no programme.
    """
    target = 1e-3 * np.asarray(levels, dtype=np.float64)
    if target.ndim != 1 or not target.size or not np.isfinite(target).all():
        raise InputError("micro steps, levels", list(levels), "a list of positions in mm")
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
