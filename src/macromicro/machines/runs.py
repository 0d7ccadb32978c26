"""Runs a programme on a single-stage machine: compiled simulation, or any rig."""

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
from macromicro.machines import guarding, lines, open_rig, planning, results, stage, tree
from macromicro.machines.guarding import Watch
from macromicro.machines.machine import Machine, as_toml
from macromicro.machines.sequence import DONE, Plan
from macromicro.machines.stage import Loop, compiles
from macromicro.place import LENGTH, Place
from macromicro.programme import Programme
from macromicro.recording import Recording
from macromicro.recording_format import Attribute
from macromicro.rig.faults import Fault, ended
from macromicro.rig.twin import noise_source
from macromicro.runs import arrivals
from macromicro.schema import config
from macromicro.simulate import Sink
from macromicro.types import Rig

CHUNK = 5000  # periods
LIVE = 50  # periods of a rig after which the sink has them


class Outcome(NamedTuple):
    finished: bool  # whether the programme came to its end
    watch: Watch
    simulated: float  # time on the machine, s
    wall: float
    place: Place = LENGTH  # unit of the stage's positions

    @property
    def fault(self) -> Fault | None:
        return guarding.describe(self.watch, self.place)


def loop(settings: Any, plan: Plan) -> Loop:
    wired = lines.wired(settings)
    return Loop(tree.gains(settings), settings.guard, settings.arrival, plan, wired)


def longest(settings: Any, plan: Plan) -> float:
    """Upper bound of a programme's duration: every move times out."""
    if not np.isnan(plan.end):
        return plan.end + 1.0
    each = float(settings.arrival.patience + 3.0 * settings.timing.period)
    waits = len(plan.target) * each
    return float(plan.length.sum() + plan.hold.sum()) + waits + 1.0


def expected(settings: Any, plan: Plan) -> float:
    if not np.isnan(plan.end):
        return plan.end
    each = float(2.0 * settings.arrival.dwell)
    return float(plan.length.sum() + plan.hold.sum()) + each * len(plan.target)


def is_compiled() -> bool:
    """Whether the compiler's cache seems to hold a stage already."""
    return any(cache_folder().rglob("stage.period*.nbi"))


def compile_machine(machine: Machine, settings: Any, plan: Plan) -> None:
    """Compile a machine, or load it from the cache."""
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
    """Run a plan on a machine into a sink; the same seed gives the same bits."""
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
        self.blocks.append(block)


class Done(NamedTuple):
    recording: Recording
    outcome: Outcome


def columns(machine: Machine, on: Rig | None = None) -> tuple[Column, ...]:
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
    warn: bool = True,
) -> Done:
    """`perform`, in memory."""
    title = programme.title if isinstance(programme, Programme) else ""
    plan = planning.plan(programme, settings) if isinstance(programme, Programme) else programme
    blocks = Blocks()
    outcome = perform(machine, settings, plan, blocks, on=on, seed=seed)
    attributes = about(machine, settings, title, seed=seed)
    attributes |= ended(outcome.finished, outcome.fault)
    rows = np.concatenate(blocks.blocks, axis=1)
    made = Recording.from_arrays(columns(machine, on), rows, settings.timing.period, attributes)
    if warn and np.isnan(plan.end):  # what comes by time waits for no arrival
        place = machine.kind.place
        moves = results.moves(made, plan, settings.arrival, place)
        arrivals.warn(results.rests(moves, place), results.REMEDY, place)
    return Done(made, outcome)


def about(
    machine: Machine, settings: Any, title: str, *, seed: int, cycles: int = 1
) -> dict[str, Attribute]:
    """Attributes of the recording."""
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
    found = config.difference(settings, machine.settings)
    return {k: v[1:-1] if v[:1] == v[-1:] == '"' else v for k, v in found.items()}
