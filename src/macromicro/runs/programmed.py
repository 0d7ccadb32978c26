"""A programme under settings on a machine: the one way that everything which runs one goes.

`perform` is that way, into any sink; `record` keeps the recording in memory. The Hall sensor of
a virtual bench is calibrated on that bench, whoever asks.
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
from macromicro import loop, recorded, simulate
from macromicro.columns import Column
from macromicro.control import settings as control_settings
from macromicro.control import supervisor
from macromicro.control.settings import Control
from macromicro.control.supervisor import Progress, Supervisor
from macromicro.control.two_stage import TwoStage
from macromicro.design import response
from macromicro.design.response import MoveResult
from macromicro.design.tracking import followed
from macromicro.errors import InputError
from macromicro.loop import PERIOD
from macromicro.programme import MACRO, MICRO, Programme
from macromicro.recorded import NAMES
from macromicro.recording import Recording
from macromicro.recording_format import Attribute
from macromicro.rig.faults import describe
from macromicro.rig.guarded import Guarded
from macromicro.rig.limits import Limits
from macromicro.rig.session import BENCH, Fixture
from macromicro.runs import replaying
from macromicro.runs.machine import FLAGS, approach, known, seen, watchdog
from macromicro.schema import config
from macromicro.settings import Settings
from macromicro.simulate import Outcome, Sink

_MOVE = NAMES.index("move")
_TOLD = round(1.0 / PERIOD)  # periods between two calls of `progress`
# What a programme runs on: the virtual bench of its settings, a rig, or a recording's sensors.
Place = Fixture | Recording | None


class Done(NamedTuple):
    """A run in memory.

    Attributes
    ----------
    recording : Recording
        What it showed.
    outcome : Outcome
        How it ended.
    """

    recording: Recording
    outcome: Outcome


class Runner(Protocol):
    """Whatever can run a programme and return its recording: the twin, or a real rig."""

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
    """Run a programme under settings on a machine, into a sink.

    Parameters
    ----------
    programme : Programme
        Targets in counts and m.
    settings : Settings
        Bench, sensors, controller and guard.
    sink : Sink
        Takes rows of ``columns(on)``.
    on : Place, optional
        None for the virtual bench of the settings, whose run repeats exactly from its `seed`; a
        rig, driven from cold, its carriage at rest at 0 counts, through the guard; or a recording,
        whose sensors are replayed.
    seed : int, optional
        Seed of the sensor noise.
    fan : bool, optional
        Whether the fan cools the wires.
    progress : Callable[[float, int], None] | None, optional
        Called with the time (s) and the index of the present move, about once a second; an
        exception from it ends the run.

    Returns
    -------
    Outcome
        How it ended.

    Raises
    ------
    InputError
        The machine lacks what the programme needs.
    """
    if on is None:
        return simulate.simulate(settings, programme, sink, seed=seed, fan=fan, progress=progress)
    if isinstance(on, Recording):
        return replaying.replay(on, programme, settings, sink, fan=fan, progress=progress)
    return _on_rig(on, programme, settings, sink, (seed, fan), progress)


def columns(on: Place = None, settings: Settings | None = None) -> tuple[Column, ...]:
    """What a run on a machine records: of a rig what it measures, and nothing true.

    Parameters
    ----------
    on : Place, optional
        As for `perform`.
    settings : Settings | None, optional
        Of the run, whose law may have columns of its own; default: a law of this package.

    Returns
    -------
    tuple[Column, ...]
        In the order of the rows.
    """
    control = Control() if settings is None else settings.controller
    every = recorded.columns(control_settings.prepare(control))
    if on is None:
        return every
    return replaying.columns(on) if isinstance(on, Recording) else seen(on, every)


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
    says why.

    Parameters
    ----------
    programme : Programme
        Targets in counts and m.
    settings : Settings
        Bench, sensors, controller and guard.
    on : Place, optional
        As for `perform`.
    seed : int, optional
        Seed of the sensor noise.
    fan : bool, optional
        Whether the fan cools the wires.
    cycles : int, optional
        How often in a row.

    Returns
    -------
    Done
        The recording, and how it ended.

    Raises
    ------
    InputError
        The machine lacks what the programme needs.
    """
    blocks = _Blocks()
    what = programme.repeated(cycles)
    outcome = perform(what, settings, blocks, on=on, seed=seed, fan=fan)
    attributes = about(what.title, settings, seed=seed, fan=fan, cycles=cycles)
    if isinstance(on, Fixture):
        attributes["rig"] = on.name
    attributes["finished"] = int(outcome.finished)
    fault = describe(outcome.watch)
    if fault is not None:
        attributes["fault"] = f"{fault.message} {fault.evidence}"
    rows = np.concatenate(blocks.blocks, axis=1)
    return Done(Recording.from_arrays(columns(on, settings), rows, PERIOD, attributes), outcome)


def about(
    title: str, settings: Settings, *, seed: int, fan: bool, cycles: int
) -> dict[str, Attribute]:
    """What a recording says of its run.

    Parameters
    ----------
    title : str
        Title of the programme.
    settings : Settings
        Under which it ran.
    seed : int
        Seed of the sensor noise.
    fan : bool
        Whether the fan cooled the wires.
    cycles : int
        How often in a row.

    Returns
    -------
    dict[str, Attribute]
        Attributes: version, programme, seed, cycles, fan, overrides, settings.
    """
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
    """What differs from the defaults.

    Parameters
    ----------
    settings : Settings
        Any settings.

    Returns
    -------
    dict[str, str]
        Dotted path to text with unit.
    """
    return dict(_described(settings)[0])


@functools.lru_cache(maxsize=64)
def _described(settings: Settings) -> tuple[dict[str, str], str]:
    """Overrides by dotted path, and all settings as TOML; both take milliseconds."""
    changed = config.difference(settings, Settings())
    # Texts as a person writes them, not as TOML does.
    plain = {k: v[1:-1] if v[:1] == v[-1:] == '"' else v for k, v in changed.items()}
    return plain, config.as_toml(settings)


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
    """The recording of a programme on the virtual bench.

    Parameters
    ----------
    programme : Programme
        Targets in counts and m.
    settings : Settings
        Bench, sensors, controller and guard.
    seed : int, optional
        Seed of the sensor noise.
    fan : bool, optional
        Whether the fan cools the wires.

    Returns
    -------
    Recording
        As of `record`.
    """
    return record(programme, settings, seed=seed, fan=fan).recording


def on_rig(fixture: Fixture) -> Runner:
    """Programmes on a rig.

    Parameters
    ----------
    fixture : Fixture
        The rig.

    Returns
    -------
    Runner
        Takes programme, settings, seed and fan, as `on_twin`.
    """

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
    """`perform` on a rig, seed and fan given. The sink has everything at the end, however the run
    ends: a file that is written meanwhile would cost periods."""
    seed, fan = how
    check(fixture, programme)
    table = fixture.calibrated() if np.any(programme.stage == MICRO) else fixture.table
    control = control_settings.prepare(
        settings.controller, fan, table, settings.sensors.encoder.pitch
    )
    limits = fixture.limits or settings.guard
    blocks, began = _Blocks(), time.perf_counter()

    def take(row: npt.NDArray[np.float64]) -> None:
        blocks.append(row)
        if progress is not None and len(blocks.blocks) % _TOLD == 0:
            progress(len(blocks.blocks) * PERIOD, int(row[_MOVE, 0]))

    try:
        last, rig = _driven(fixture, programme, settings, control, (seed, limits), take)
    finally:
        if blocks.blocks:
            every = recorded.columns(control)
            sink.append(_filled(fixture, np.concatenate(blocks.blocks, axis=1), every))
    finished = last.phase == supervisor.DONE
    took = len(blocks.blocks) * PERIOD
    return Outcome(finished, rig.watch, took, time.perf_counter() - began)


def _driven(
    fixture: Fixture,
    programme: Programme,
    settings: Settings,
    control: Supervisor,
    how: tuple[int, Limits],
    take: Callable[[npt.NDArray[np.float64]], None],
) -> tuple[Progress, Guarded]:
    """From cold, the carriage at 0 counts, to the end: the supervisor's last state, the guard."""
    seed, limits = how
    with fixture.open(seed) as session:
        session.cold(fixture.rest)
        if fixture.has("encoder"):
            approach(fixture._replace(limits=limits), session, 0.0)
        session.restart()
        rig = Guarded(session, watchdog(limits, control.calibration), PERIOD)
        longest = round(simulate.longest(settings, programme) / PERIOD)
        plan, start = simulate.plan(programme), supervisor.begin(0.0, control)
        last = loop.run(rig, TwoStage(control), plan, PERIOD, start, take, longest)
    return last, rig


def _filled(
    fixture: Fixture, rows: npt.NDArray[np.float64], every: tuple[Column, ...]
) -> npt.NDArray[np.float64]:
    """Of `every` column those that a rig fills, its flags known in every row."""
    values = {c.name: row for c, row in zip(every, rows, strict=True)}
    values |= {name: known(values[name]) for name in FLAGS}
    return np.array([values[c.name] for c in seen(fixture, every)])


def check(fixture: Fixture, programme: Programme) -> None:
    """Refuse a programme that a rig cannot run.

    Parameters
    ----------
    fixture : Fixture
        The rig.
    programme : Programme
        What it is to do.

    Raises
    ------
    InputError
        It is no bench, does not measure what the programme's stages are controlled by, or has no
        table for its Hall sensor.
    """
    if fixture.kind != BENCH:
        raise InputError(f"--rig {fixture.name}", f"a {fixture.kind}", "a bench, for a programme")
    for stage, name, channel in ((MACRO, "macro", "encoder"), (MICRO, "micro", "hall")):
        if np.any(programme.stage == stage):
            fixture.need(f"a programme with {name} moves", channel)
    if np.any(programme.stage == MICRO):
        fixture.calibrated()


def moves_of(recording: Recording, programme: Programme, settings: Settings) -> list[MoveResult]:
    """How each move went; a stage that follows a trajectory makes none.

    Parameters
    ----------
    recording : Recording
        Recording of a run.
    programme : Programme
        Its moves.
    settings : Settings
        Encoder and tolerance count.

    Returns
    -------
    list[MoveResult]
        In the units of a table.
    """
    return response.moves(
        recording,
        programme,
        pitch=settings.sensors.encoder.pitch,
        macro_band=settings.controller.sequence.tolerance,
        but=followed(recording, programme),
    )
