"""Runs a programme on a simulated two-axis machine, compiled."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

import macromicro
from macromicro.columns import Column
from macromicro.kernel import cache_folder
from macromicro.machines import guarding, runs
from macromicro.machines.guard_words import OTHER_AXIS
from macromicro.machines.guarding import OK, Watch
from macromicro.machines.joint import loop
from macromicro.machines.joint import results as joint_results
from macromicro.machines.joint.loop import Bench, Plane
from macromicro.machines.joint.machine import Joint, as_toml
from macromicro.machines.joint.planning import JointPlan
from macromicro.machines.joint.settings import AXES, of
from macromicro.machines.results import REMEDY
from macromicro.machines.runs import CHUNK, Blocks
from macromicro.machines.sequence import DONE
from macromicro.recording import Recording
from macromicro.recording_format import Attribute
from macromicro.rig.faults import SWITCHED_OFF, Fault, ended
from macromicro.rig.twin import noise_source
from macromicro.runs import arrivals
from macromicro.schema import config
from macromicro.simulate import Sink


class Outcome(NamedTuple):
    finished: bool  # whether the programme came to its end
    watches: tuple[Watch, Watch]  # the guards' last states
    simulated: float  # time on the machine, s

    @property
    def fault(self) -> Fault | None:
        for name, watch in zip(AXES, self.watches, strict=True):
            if watch.fault not in (OK, OTHER_AXIS):
                found = guarding.describe(watch)
                assert found is not None
                both = found.evidence.replace(SWITCHED_OFF, f"both axes: {SWITCHED_OFF}")
                return found._replace(message=f"Axis {name}: {found.message}", evidence=both)
        return None


def kinds(machine: Joint) -> tuple[Any, Any]:
    return machine.axes[0].kind, machine.axes[1].kind


def laws(machine: Joint) -> tuple[Any, Any]:
    return machine.axes[0].law, machine.axes[1].law


def columns(machine: Joint) -> tuple[Column, ...]:
    return loop.columns(kinds(machine), laws(machine))


def bench(machine: Joint, settings: Any) -> Bench:
    """Parameters and initial state of both stages."""
    (a, b), slant = kinds(machine), settings.hidden.squareness
    plane = Plane(-math.sin(slant), math.cos(slant))
    return Bench(a.prepare(settings.x), b.prepare(settings.y), plane)


def loops(settings: Any, plan: JointPlan) -> tuple[Any, Any]:
    first, second = (
        runs.loop(own, each) for own, each in zip(of(settings), plan.plans, strict=True)
    )
    return first, second


def expected(settings: Any, plan: JointPlan) -> float:
    return max(runs.expected(own, p) for own, p in zip(of(settings), plan.plans, strict=True))


def is_compiled() -> bool:
    """Whether the compiler's cache seems to hold two stages already."""
    return any(cache_folder().rglob("loop.period*.nbi"))


def compile_machine(machine: Joint, settings: Any, plan: JointPlan) -> None:
    """Compile the machine, or load it from the cache."""
    both, under = kinds(machine), laws(machine)
    parts, control = bench(machine, settings), loops(settings, plan)
    start = loop.beginning(both, under, parts, control)
    nothing = tuple(np.empty((0, kind.noises)) for kind in both)
    block = np.empty((len(columns(machine)), 0))
    dt = settings.x.timing.period
    loop.fastest(both, under)(parts, control, start, nothing, block, dt)


def perform(
    machine: Joint,
    settings: Any,
    plan: JointPlan,
    sink: Sink,
    *,
    seed: int = 0,
    progress: Callable[[float, int], None] | None = None,
) -> Outcome:
    """Run a plan and append every period to a sink; the same seed gives the same bits."""
    both, under, dt = kinds(machine), laws(machine), settings.x.timing.period
    random, parts, control = noise_source(seed), bench(machine, settings), loops(settings, plan)
    period = loop.fastest(both, under)
    run = loop.beginning(both, under, parts, control)
    rows = len(columns(machine))
    longest = max(runs.longest(own, p) for own, p in zip(of(settings), plan.plans, strict=True))
    while run.tick < round(longest / dt) and not run.over:
        noise = tuple(random.standard_normal((CHUNK, kind.noises)) for kind in both)
        block = np.empty((rows, CHUNK))
        run, written = period(parts, control, run, noise, block, dt)
        sink.append(block[:, :written])
        if progress is not None:
            progress(run.tick * dt, run.joined.progress.move)
    watches = (run.first.watch, run.second.watch)
    return Outcome(run.joined.progress.phase == DONE, watches, run.tick * dt)


class Done(NamedTuple):
    recording: Recording
    outcome: Outcome


def record(
    machine: Joint,
    settings: Any,
    plan: JointPlan,
    *,
    title: str = "",
    seed: int = 0,
    warn: bool = True,
) -> Done:
    """`perform`, in memory."""
    blocks = Blocks()
    outcome = perform(machine, settings, plan, blocks, seed=seed)
    attributes = about(machine, settings, title, seed=seed)
    attributes |= ended(outcome.finished, outcome.fault)
    rows = np.concatenate(blocks.blocks, axis=1)
    dt = settings.x.timing.period
    made = Recording.from_arrays(columns(machine), rows, dt, attributes)
    if warn:
        arrivals.warn(joint_results.rests(joint_results.moves(made, plan, settings)), REMEDY)
    return Done(made, outcome)


def about(
    machine: Joint, settings: Any, title: str, *, seed: int, cycles: int = 1
) -> dict[str, Attribute]:
    """Attributes of the recording."""
    return {
        "version": macromicro.__version__,
        "machine": machine.name,
        "programme": title,
        "seed": seed,
        "cycles": cycles,
        "overrides": json.dumps(overridden(machine, settings)),
        "settings": as_toml(settings),
    }


def overridden(machine: Joint, settings: Any) -> dict[str, str]:
    return {k: v.strip('"') for k, v in config.difference(settings, machine.settings).items()}
