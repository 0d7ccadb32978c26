"""A programme under settings on a machine: `perform` into a sink, `record` in memory.

The Hall sensor of a virtual bench is always calibrated on that bench.
"""

from __future__ import annotations

import functools
import json
import time
from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

import macromicro
from macromicro import recorded, simulate
from macromicro.columns import Column
from macromicro.control import settings as control_settings
from macromicro.control.settings import Control
from macromicro.design import response
from macromicro.design.response import MoveResult
from macromicro.design.tracking import followed
from macromicro.errors import ProblemError
from macromicro.lab import replay
from macromicro.lab.machine import FLAGS, approach, follow, known, seen, under
from macromicro.loop import PERIOD
from macromicro.programme import MACRO, MICRO, Programme
from macromicro.recording import Recording
from macromicro.recording_format import Attribute
from macromicro.rig.faults import describe, ended
from macromicro.rig.session import BENCH, Fixture
from macromicro.schema import config
from macromicro.settings import Settings
from macromicro.simulate import Outcome, Sink

# What a programme runs on: the virtual bench of its settings, a rig, or a recording's sensors.
Place = Fixture | Recording | None


class Done(NamedTuple):
    recording: Recording  # what it showed
    outcome: Outcome  # how it ended


class Runner(Protocol):
    """Runs a programme and returns its recording: the twin, or a real rig."""

    def __call__(
        self, programme: Programme, settings: Settings, seed: int = 0, fan: bool = False
    ) -> Recording:
        """The recording of `programme` under `settings`."""


def perform(
    programme: Programme,
    settings: Settings,
    sink: Sink,
    *,
    on: Place = None,
    seed: int = 0,
    fan: bool = False,
    progress: Callable[[float, int], None] | None = None,
) -> Outcome:
    """Run a programme under settings on a machine, into a sink."""
    if on is None:
        return simulate.simulate(settings, programme, sink, seed=seed, fan=fan, progress=progress)
    if isinstance(on, Recording):
        return replay.replay(on, programme, settings, sink, fan=fan, progress=progress)
    return _on_rig(on, programme, settings, sink, (seed, fan), progress)


def columns(on: Place = None, settings: Settings | None = None) -> tuple[Column, ...]:
    """The recorded columns of a run; of a rig only those that it measures."""
    control = Control() if settings is None else settings.controller
    every = recorded.columns(control_settings.prepare(control))
    if on is None:
        return every
    return replay.columns(on) if isinstance(on, Recording) else seen(on, every)


def record(
    programme: Programme,
    settings: Settings,
    *,
    on: Place = None,
    seed: int = 0,
    fan: bool = False,
    cycles: int = 1,
) -> Done:
    """`perform`, in memory.

    If the guard stops the run, the recording ends there, its attribute `finished` is 0 and `fault`
    names the reason.
    """
    blocks = _Blocks()
    what = programme.repeated(cycles)
    outcome = perform(what, settings, blocks, on=on, seed=seed, fan=fan)
    attributes = about(what.title, settings, seed=seed, fan=fan, cycles=cycles)
    if isinstance(on, Fixture):
        attributes["rig"] = on.name
    attributes |= ended(outcome.finished, describe(outcome.watch))
    rows = np.concatenate(blocks.blocks, axis=1)
    return Done(Recording.from_arrays(columns(on, settings), rows, PERIOD, attributes), outcome)


def about(
    title: str, settings: Settings, *, seed: int, fan: bool, cycles: int
) -> dict[str, Attribute]:
    overrides, toml = _described(settings)
    return {
        "version": macromicro.__version__,
        "programme": title,
        "seed": seed,
        "cycles": cycles,
        "fan": int(fan),
        "overrides": json.dumps(overrides),
        "settings": toml,
    }


def overridden(settings: Settings) -> dict[str, str]:
    return dict(_described(settings)[0])


@functools.lru_cache(maxsize=64)
def _described(settings: Settings) -> tuple[dict[str, str], str]:
    """Overrides by dotted path, and all settings as TOML; both take milliseconds."""
    changed = config.difference(settings, Settings())
    # Texts as a person writes them, not as TOML does.
    plain = {k: v[1:-1] if v[:1] == v[-1:] == '"' else v for k, v in changed.items()}
    return plain, config.as_toml(settings)


class _Blocks:
    def __init__(self) -> None:
        self.blocks: list[npt.NDArray[np.float64]] = []

    def append(self, block: npt.NDArray[np.float64]) -> None:
        self.blocks.append(block)


def on_twin(
    programme: Programme, settings: Settings, seed: int = 0, fan: bool = False
) -> Recording:
    return record(programme, settings, seed=seed, fan=fan).recording


def on_rig(fixture: Fixture) -> Runner:
    def run(
        programme: Programme, settings: Settings, seed: int = 0, fan: bool = False
    ) -> Recording:
        return record(programme, settings, on=fixture, seed=seed, fan=fan).recording

    return run


def _on_rig(
    fixture: Fixture,
    programme: Programme,
    settings: Settings,
    sink: Sink,
    how: tuple[int, bool],
    progress: Callable[[float, int], None] | None,
) -> Outcome:
    """`perform` on a rig, from cold, the carriage at 0 counts."""
    seed, fan = how
    check(fixture, programme)
    table = fixture.calibrated() if np.any(programme.stage == MICRO) else fixture.table
    control = control_settings.prepare(
        settings.controller, fan, table, settings.sensors.encoder.pitch
    )
    fixture = under(settings, fixture)
    filled = _Filled(sink, fixture, recorded.columns(control))
    longest = round(simulate.longest(settings, programme) / PERIOD)
    began = time.perf_counter()
    with fixture.open(seed) as session:
        session.cold(fixture.rest)
        if fixture.has("encoder"):
            approach(fixture, session, 0.0)
        session.restart()
        outcome = follow(session, programme, control, fixture.limits, filled, longest, progress)
    return outcome._replace(wall=time.perf_counter() - began)


class _Filled:
    """A sink that passes on the columns that a rig fills, with flags in every row."""

    def __init__(self, sink: Sink, fixture: Fixture, every: tuple[Column, ...]) -> None:
        self._sink, self._names = sink, [c.name for c in every]
        self._shown = [self._names.index(c.name) for c in seen(fixture, every)]
        self._flags = dict.fromkeys(FLAGS, 0.0)  # as they were last

    def append(self, block: npt.NDArray[np.float64]) -> None:
        rows = block.copy()
        for name, last in self._flags.items():
            row = self._names.index(name)
            rows[row] = known(np.append(last, rows[row]))[1:]
            self._flags[name] = float(rows[row, -1])
        self._sink.append(rows[self._shown])


def check(fixture: Fixture, programme: Programme) -> None:
    if fixture.kind != BENCH:
        raise ProblemError(
            f"--rig {fixture.name}", f"a programme needs a bench, not a {fixture.kind}"
        )
    for stage, name, channel in ((MACRO, "macro", "encoder"), (MICRO, "micro", "hall")):
        if np.any(programme.stage == stage):
            fixture.need(f"a programme with {name} moves", channel)
    if np.any(programme.stage == MICRO):
        fixture.calibrated()


def moves_of(recording: Recording, programme: Programme, settings: Settings) -> list[MoveResult]:
    """Results of all moves, except of stages that follow a trajectory."""
    return response.moves(
        recording,
        programme,
        pitch=settings.sensors.encoder.pitch,
        macro_band=settings.controller.sequence.tolerance,
        but=followed(recording, programme),
    )
