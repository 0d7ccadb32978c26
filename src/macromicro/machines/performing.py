"""Runs a programme on a machine: compiled simulation, or any rigs."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import ExitStack
from typing import Any

import numpy as np

from macromicro.columns import Column, whole
from macromicro.machines import (
    composite,
    correcting,
    guarding,
    lines,
    open_rig,
    planning,
    tree,
)
from macromicro.machines import period as clocked
from macromicro.machines.composite import AnyMachine
from macromicro.machines.guard_words import OTHER_AXIS
from macromicro.machines.guarding import OK, Watch
from macromicro.machines.period import Stages
from macromicro.machines.planning import Planned
from macromicro.machines.sequence import DONE, Plan
from macromicro.machines.stage import Loop
from macromicro.machines.stage_trees import all_of
from macromicro.place import plain
from macromicro.rig.faults import SWITCHED_OFF, Fault
from macromicro.rig.twin import noise_source
from macromicro.runs.setup import Progress
from macromicro.simulate import Outcome, Sink
from macromicro.types import Rig

CHUNK = 5000  # periods
LIVE = 50  # periods of a rig after which the sink has them


def loop(settings: Any, plan: Plan, names: Sequence[str] = ()) -> Loop:
    """What controls a stage; `names` are those of all stages."""
    corrected: Any = ()
    if tree.is_corrected(settings):
        corrected = correcting.tables(settings, names)
    wired = lines.wiring(settings)
    gains, guard, arrival = map(plain, (tree.gains(settings), settings.guard, settings.arrival))
    return Loop(gains, guard, arrival, plan, wired, corrected)


def loops(machine: AnyMachine, settings: Any, planned: Planned) -> tuple[Loop, ...]:
    trees = machine.trees(settings)
    names = composite.names(machine)
    return tuple(loop(*each, names) for each in zip(trees, planning.each(planned), strict=True))


def longest(machine: AnyMachine, settings: Any, planned: Planned) -> float:
    """Upper bound of a programme's duration: every move times out."""
    return max(
        _longest(own, plan)
        for own, plan in zip(machine.trees(settings), planning.each(planned), strict=True)
    )


def _longest(settings: Any, plan: Plan) -> float:
    if not np.isnan(plan.end):
        return plan.end + 1.0
    each = float(settings.arrival.patience + 3.0 * settings.timing.period)
    waits = len(plan.target) * each
    return float(plan.length.sum() + plan.hold.sum()) + waits + 1.0


def expected_duration(machine: AnyMachine, settings: Any, planned: Planned) -> float:
    plan = planning.each(planned)[0]
    if not np.isnan(plan.end):
        return plan.end
    each = max(2.0 * own.arrival.dwell for own in machine.trees(settings))
    return float(plan.length.sum() + plan.hold.sum()) + float(each) * len(plan.target)


def begin(machine: AnyMachine, settings: Any, planned: Planned, count: int) -> Any:
    """The stages of a machine, and what their loop is given at the start for so many periods."""
    stages, bench = composite.stages(machine), composite.bench(machine, settings)
    control = loops(machine, settings, planned)
    noise = tuple(np.zeros((count, kind.noises)) for kind in stages.kinds)
    block = np.empty((len(clocked.columns(stages)), count))
    begin = clocked.beginning(stages, bench, control)
    dt = composite.period(machine, settings)
    return stages, (bench, control, begin, noise, block, dt)


def columns(machine: AnyMachine, on: Sequence[Rig] | Rig | None = None) -> tuple[Column, ...]:
    stages = composite.stages(machine)
    return clocked.columns(stages if on is None else open_rig.stages(stages, rigs(on)))


def rigs(on: Sequence[Rig] | Rig) -> tuple[Rig, ...]:
    """One rig a stage."""
    return tuple(on) if isinstance(on, Sequence) else (on,)


def perform(
    machine: AnyMachine,
    settings: Any,
    planned: Planned,
    sink: Sink,
    *,
    on: Sequence[Rig] | Rig | None = None,
    seed: int = 0,
    progress: Progress | None = None,
    bench: Any = None,
) -> Outcome:
    """Run a plan on a machine into a sink; the same seed gives the same bits.

    `bench` has the settings of the simulated machine where the laws know others.

    On rigs the drives are enabled first, and outputs are safe however the run ends.
    """
    dt, control = composite.period(machine, settings), loops(machine, settings, planned)
    stages, random, began = composite.stages(machine), noise_source(seed), time.perf_counter()
    with ExitStack() as entered:
        if on is None:
            params, chunk, period = (
                composite.bench(machine, settings if bench is None else bench),
                CHUNK,
                clocked.quickest(stages, expected_duration(machine, settings, planned) / dt),
            )
        else:
            for rig in rigs(on):
                entered.enter_context(rig)
            trees, chunk = machine.trees(settings), LIVE
            stages, params = open_rig.stages(stages, rigs(on)), open_rig.bench(trees, rigs(on))
            period = clocked.period(stages)
            rise = max(lines.rise(own) for own in trees)
            open_rig.switched_on(params.stages, stages.kinds, rise, dt)
        run, rows = clocked.beginning(stages, params, control), clocked.columns(stages)
        limit = round(longest(machine, settings, planned) / dt)
        while run.tick < limit and not run.over:
            noise = tuple(random.standard_normal((chunk, kind.noises)) for kind in stages.kinds)
            block = np.empty((len(rows), chunk))
            run, written = period(params, control, run, noise, block, dt)
            done = block[:, :written]
            sink.append(done if on is None else whole(done, rows))
            if progress is not None:
                progress(run.tick * dt, run.progress.move)
    watch, fault = _fault(stages, [part.watch for part in run.parts])
    wall = time.perf_counter() - began
    return Outcome(run.progress.phase == DONE, watch, fault, run.tick * dt, wall)


def _fault(stages: Stages, watches: list[Watch]) -> tuple[Watch, Fault | None]:
    """The guard that found a fault, or the first, and the fault in words."""
    k = next((k for k, w in enumerate(watches) if w.fault not in (OK, OTHER_AXIS)), 0)
    watch, name = watches[k], stages.names[k]
    found = guarding.describe(watch, stages.kinds[k].place)
    if found is None or not name:
        return watch, found
    whose = all_of(len(stages.names))
    evidence = found.evidence.replace(SWITCHED_OFF, f"{whose}: {SWITCHED_OFF}")
    return watch, found._replace(message=f"Axis {name}: {found.message}", evidence=evidence)
