"""A programme on recorded sensors: the controller's outputs beside the recorded ones."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from macromicro import hall_table, loop, simulate
from macromicro.columns import Column, whole
from macromicro.control import settings as control_settings
from macromicro.control import supervisor
from macromicro.control.two_stage import TwoStage
from macromicro.errors import InputError
from macromicro.loop import PERIOD
from macromicro.programme import Programme
from macromicro.recorded import COLUMNS, NAMES
from macromicro.recording import Recording
from macromicro.rig.guarded import Guarded
from macromicro.rig.replay import Replay
from macromicro.runs.machine import watchdog
from macromicro.settings import Settings
from macromicro.simulate import Outcome, Sink

_BESIDE = ("motor", "ctrl", "fan", "laser_reset")  # outputs that are kept as they were
_BLOCK = 1000  # rows that are passed on at once
_MOVE = NAMES.index("move")


def columns(source: Recording) -> tuple[Column, ...]:
    """The columns of a replay: a run's, and the source's outputs as `recorded_motor` and so on."""
    kept = (c for c in source.columns if c.name in _BESIDE)
    return (
        *COLUMNS,
        *(c._replace(name=f"recorded_{c.name}", meaning=f"as recorded: {c.meaning}") for c in kept),
    )


def replay(
    source: Recording,
    programme: Programme,
    settings: Settings,
    sink: Sink,
    *,
    fan: bool = False,
    progress: Callable[[float, int], None] | None = None,
) -> Outcome:
    """Run a programme on recorded sensors, until either ends.

    Nothing moves: controller and guard read the recorded sensors, whatever their outputs. A guard
    that trips ends the replay.
    """
    if abs(source.dt - PERIOD) > 1e-9:
        raise InputError("replay, sample time of the recording", source.dt, f"{PERIOD:g} s")
    control = control_settings.prepare(
        settings.controller, fan, hall_table.of_bench(settings), settings.sensors.encoder.pitch
    )
    player = Replay(source)
    rig = Guarded(player, watchdog(settings.guard, control.calibration), PERIOD)
    kept = [source[c.name] for c in source.columns if c.name in _BESIDE]
    rows: list[NDArray[np.float64]] = []
    done = 0

    def flush() -> None:
        nonlocal done
        if not rows:
            return
        block = whole(np.concatenate(rows, axis=1), COLUMNS)
        first, done = done, done + block.shape[1]
        rows.clear()
        sink.append(np.vstack([block, *(values[first:done] for values in kept)]))
        if progress is not None:
            progress(done * PERIOD, int(block[_MOVE, -1]))

    def take(row: NDArray[np.float64]) -> None:
        rows.append(row[: len(COLUMNS)])  # of a law of another package nothing is kept beside
        if len(rows) >= _BLOCK:
            flush()

    began = time.perf_counter()
    plan, state = simulate.plan(programme), supervisor.begin(0.0, control)
    last: Any = loop.run(rig, TwoStage(control), plan, PERIOD, state, take, player.rows)
    flush()
    finished = last.phase == supervisor.DONE
    return Outcome(finished, rig.watch, done * PERIOD, time.perf_counter() - began)
