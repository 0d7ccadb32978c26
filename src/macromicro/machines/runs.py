"""A programme on a machine of one stage: simulated, compiled, or on any rig, interpreted."""

from __future__ import annotations

import contextlib
import json
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

import macromicro
from macromicro.arrays import Array
from macromicro.columns import Column, whole
from macromicro.kernel import cache_folder
from macromicro.machines import guarding, lines, open_rig, planning, stage, tree
from macromicro.machines.guarding import Watch
from macromicro.machines.machine import Machine, as_toml
from macromicro.machines.sequence import DONE, Plan
from macromicro.machines.stage import Loop, compiles
from macromicro.place import LENGTH, Place
from macromicro.programme import Programme
from macromicro.recording import Recording
from macromicro.recording_format import Attribute
from macromicro.rig.faults import Fault
from macromicro.rig.twin import noise_source
from macromicro.schema import config
from macromicro.simulate import Sink
from macromicro.types import Rig

CHUNK = 5000  # periods
LIVE = 50  # periods of a rig after which the sink has them


class Outcome(NamedTuple):
    """How a run ended.

    Attributes
    ----------
    finished : bool
        Whether the programme came to its end.
    watch : Watch
        The guard's last state.
    simulated : float
        Time on the machine, s.
    wall : float
        Time that it took, s.
    place : Place
        What the stage's places are counted in.
    """

    finished: bool
    watch: Watch
    simulated: float
    wall: float
    place: Place = LENGTH

    @property
    def fault(self) -> Fault | None:
        """The guard's fault in words; None if all went well."""
        return guarding.describe(self.watch, self.place)


def loop(settings: Any, plan: Plan) -> Loop:
    """What controls a stage, from its settings.

    Parameters
    ----------
    settings : Any
        Of the machine.
    plan : Plan
        The programme.

    Returns
    -------
    Loop
        For `stage.period`.
    """
    wired = lines.wired(settings)
    return Loop(tree.gains(settings), settings.guard, settings.arrival, plan, wired)


def longest(settings: Any, plan: Plan) -> float:
    """Upper bound of a programme's duration: every move out of patience.

    Parameters
    ----------
    settings : Any
        Of the machine.
    plan : Plan
        The programme.

    Returns
    -------
    float
        s.
    """
    if not np.isnan(plan.end):
        return plan.end + 1.0
    each = float(settings.arrival.patience + 3.0 * settings.timing.period)
    waits = len(plan.target) * each
    return float(plan.length.sum() + plan.hold.sum()) + waits + 1.0


def expected(settings: Any, plan: Plan) -> float:
    """Usual duration of a programme.

    Parameters
    ----------
    settings : Any
        Of the machine.
    plan : Plan
        The programme.

    Returns
    -------
    float
        s.
    """
    if not np.isnan(plan.end):
        return plan.end
    each = float(2.0 * settings.arrival.dwell)
    return float(plan.length.sum() + plan.hold.sum()) + each * len(plan.target)


def is_compiled() -> bool:
    """Whether the compiler's cache seems to hold a stage already.

    Returns
    -------
    bool
        True if a cached file of a stage's period is there; it may be of another kind.
    """
    return any(cache_folder().rglob("stage.period*.nbi"))


def compile_machine(machine: Machine, settings: Any, plan: Plan) -> None:
    """Compile a machine, or load it from the cache, so that a run need not wait for it.

    Parameters
    ----------
    machine : Machine
        The machine.
    settings : Any
        Of the run to come.
    plan : Plan
        Of the run to come.
    """
    kind, law = machine.kind, machine.law
    params, control = kind.prepare(settings), loop(settings, plan)
    run = stage.beginning(kind, law, params, control)
    if not compiles(law):
        nothing = np.zeros((1, kind.noises))
        stage.quick(kind).measure(params, run.stage, 0.0, nothing, 0)
        return
    nothing = np.empty((0, kind.noises))
    block = np.empty((len(stage.columns(kind, law)), 0))
    stage.fastest(kind, law)(params, control, run, nothing, block, settings.timing.period)


def perform(
    machine: Machine,
    settings: Any,
    plan: Plan,
    sink: Sink,
    *,
    on: Rig | None = None,
    seed: int = 0,
    progress: Callable[[float, int], None] | None = None,
) -> Outcome:
    """Run a plan on a machine and append every period to a sink.

    The same simulated machine, settings, plan and seed give the same rows, bit for bit. An
    exception from `progress` or the sink ends the run; what was appended stays.

    Parameters
    ----------
    machine : Machine
        The machine.
    settings : Any
        Its settings.
    plan : Plan
        The programme.
    sink : Sink
        Takes blocks of shape (columns, rows), at most `CHUNK` rows each; columns as of `columns`.
    on : Rig | None, optional
        None for the simulated machine; or a rig that measures `encoder`, at rest where its encoder
        reads 0, which is entered and left here and driven interpreted, under the same guard.
    seed : int, optional
        Seed of the simulated sensor's noise.
    progress : Callable[[float, int], None] | None, optional
        Called after every chunk with the simulated time (s) and the index of the present move.

    Returns
    -------
    Outcome
        How it ended.
    """
    law, dt = machine.law, settings.timing.period
    random, control = noise_source(seed), loop(settings, plan)
    with contextlib.nullcontext() if on is None else on:
        if on is None:
            kind, params, chunk = machine.kind, machine.kind.prepare(settings), CHUNK
            period = stage.fastest(kind, law)
        else:
            kind, chunk = open_rig.of(on, machine.kind.place), LIVE
            params = open_rig.opened(on, settings.encoder.pitch)
            period = stage.period(kind, law)
            open_rig.switched_on([params], [kind], lines.rise(settings), dt)
        run = stage.beginning(kind, law, params, control)
        rows = stage.columns(kind, law)
        limit, began = round(longest(settings, plan) / dt), time.perf_counter()
        while run.tick < limit and not run.over:
            noise = random.standard_normal((chunk, kind.noises))
            block = np.empty((len(rows), chunk))
            run, written = period(params, control, run, noise, block, dt)
            done = block[:, :written]
            sink.append(done if on is None else whole(done, rows))
            if progress is not None:
                progress(run.tick * dt, run.progress.move)
    finished = run.progress.phase == DONE
    took = time.perf_counter() - began
    return Outcome(finished, run.watch, run.tick * dt, took, machine.kind.place)


class Blocks:
    """A sink in memory."""

    def __init__(self) -> None:
        self.blocks: list[Array] = []

    def append(self, block: Array) -> None:
        """Keep a block.

        Parameters
        ----------
        block : ndarray, shape (columns, rows)
            Rows in time order.
        """
        self.blocks.append(block)


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


def columns(machine: Machine, on: Rig | None = None) -> tuple[Column, ...]:
    """What a run of a machine records.

    Parameters
    ----------
    machine : Machine
        The machine.
    on : Rig | None, optional
        As for `perform`: of a rig nothing is known to be true.

    Returns
    -------
    tuple[Column, ...]
        In the order of the rows.
    """
    return stage.columns(
        machine.kind if on is None else open_rig.of(on, machine.kind.place), machine.law
    )


def record(
    machine: Machine,
    settings: Any,
    programme: Programme | Plan,
    *,
    on: Rig | None = None,
    seed: int = 0,
) -> Done:
    """`perform`, in memory.

    Parameters
    ----------
    machine : Machine
        The machine.
    settings : Any
        Its settings.
    programme : Programme | Plan
        What is to be run.
    on : Rig | None, optional
        As for `perform`.
    seed : int, optional
        Seed of the sensor's noise.

    Returns
    -------
    Done
        The recording, and how it ended.
    """
    title = programme.title if isinstance(programme, Programme) else ""
    plan = planning.plan(programme, settings) if isinstance(programme, Programme) else programme
    blocks = Blocks()
    outcome = perform(machine, settings, plan, blocks, on=on, seed=seed)
    attributes = about(machine, settings, title, seed=seed)
    attributes["finished"] = int(outcome.finished)
    if outcome.fault is not None:
        attributes["fault"] = f"{outcome.fault.message} {outcome.fault.evidence}"
    rows = np.concatenate(blocks.blocks, axis=1)
    made = Recording.from_arrays(columns(machine, on), rows, settings.timing.period, attributes)
    return Done(made, outcome)


def about(
    machine: Machine, settings: Any, title: str, *, seed: int, cycles: int = 1
) -> dict[str, Attribute]:
    """What a recording says of its run.

    Parameters
    ----------
    machine : Machine
        The machine.
    settings : Any
        Its settings.
    title : str
        Of the programme.
    seed : int
        Seed of the sensor's noise.
    cycles : int, optional
        How often in a row.

    Returns
    -------
    dict[str, Attribute]
        Attributes: version, machine, programme, seed, cycles, overrides, settings.
    """
    return {
        "version": macromicro.__version__,
        "machine": machine.name,
        "programme": title,
        "seed": seed,
        "cycles": cycles,
        "overrides": json.dumps(overridden(machine, settings)),
        "settings": as_toml(machine, settings),
    }


def overridden(machine: Machine, settings: Any) -> dict[str, str]:
    """What differs from the machine's defaults.

    Parameters
    ----------
    machine : Machine
        The machine.
    settings : Any
        Its settings.

    Returns
    -------
    dict[str, str]
        Dotted path to text with unit.
    """
    found = config.difference(settings, machine.settings)
    return {k: v[1:-1] if v[:1] == v[-1:] == '"' else v for k, v in found.items()}
