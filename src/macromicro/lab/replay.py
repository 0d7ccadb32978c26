"""A programme on recorded sensors: the controller's outputs beside the recorded ones."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from macromicro import hall_table
from macromicro.columns import Column, whole
from macromicro.control import settings as control_settings
from macromicro.errors import InputError
from macromicro.lab.machine import follow
from macromicro.nominal import PERIOD
from macromicro.programme import Programme
from macromicro.recorded import COLUMNS
from macromicro.recording import Recording
from macromicro.rig.replay import Replay
from macromicro.settings import Settings
from macromicro.simulate import Outcome, Sink

OUTPUTS = ("motor", "ctrl", "fan", "laser_reset")  # recorded ones stand beside the new ones


def columns(source: Recording) -> tuple[Column, ...]:
    """The columns of a replay: a run's, and the source's outputs as `recorded_motor` and so on."""
    kept = (c for c in source.columns if c.name in OUTPUTS)
    return (
        *COLUMNS,
        *(c._replace(name=f"recorded_{c.name}", meaning=f"as recorded: {c.meaning}") for c in kept),
    )


class _Beside:
    """A sink that adds the recorded outputs to each block."""

    def __init__(self, sink: Sink, source: Recording) -> None:
        self._sink, self._done = sink, 0
        self._outputs = [source[c.name] for c in source.columns if c.name in OUTPUTS]

    def append(self, block: npt.NDArray[np.float64]) -> None:
        rows = whole(block[: len(COLUMNS)], COLUMNS)  # without the columns of a user's own law
        first, self._done = self._done, self._done + block.shape[1]
        self._sink.append(np.vstack([rows, *(v[first : self._done] for v in self._outputs)]))


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
    player, beside = Replay(source), _Beside(sink, source)
    return follow(player, programme, control, settings.guard, beside, player.rows, progress)
