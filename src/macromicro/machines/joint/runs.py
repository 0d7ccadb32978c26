"""A programme on a machine of two axes, simulated, compiled."""

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
from macromicro.machines.joint.loop import Bench, Plane
from macromicro.machines.joint.machine import Joint, as_toml
from macromicro.machines.joint.planning import JointPlan
from macromicro.machines.joint.settings import AXES, of
from macromicro.machines.runs import CHUNK, Blocks
from macromicro.machines.sequence import DONE
from macromicro.recording import Recording
from macromicro.recording_format import Attribute
from macromicro.rig.faults import SWITCHED_OFF, Fault
from macromicro.rig.twin import noise_source
from macromicro.schema import config
from macromicro.simulate import Sink


class Outcome(NamedTuple):
    """How a run ended.

    Attributes
    ----------
    finished : bool
        Whether the programme came to its end.
    watches : tuple[Watch, Watch]
        The guards' last states.
    simulated : float
        Time on the machine, s.
    """

    finished: bool
    watches: tuple[Watch, Watch]
    simulated: float

    @property
    def fault(self) -> Fault | None:
        """The fault in words, of the axis that met it; None if all went well."""
        for name, watch in zip(AXES, self.watches, strict=True):
            if watch.fault not in (OK, OTHER_AXIS):
                found = guarding.describe(watch)
                assert found is not None
                both = found.evidence.replace(SWITCHED_OFF, f"both axes: {SWITCHED_OFF}")
                return found._replace(message=f"Axis {name}: {found.message}", evidence=both)
        return None


def kinds(machine: Joint) -> tuple[Any, Any]:
    """Kinds of the stages.

    Parameters
    ----------
    machine : Joint
        The machine.

    Returns
    -------
    tuple[Kind, Kind]
        In the order of the axes.
    """
    return machine.axes[0].kind, machine.axes[1].kind


def laws(machine: Joint) -> tuple[Any, Any]:
    """Laws of the stages.

    Parameters
    ----------
    machine : Joint
        The machine.

    Returns
    -------
    tuple[StageLaw, StageLaw]
        In the order of the axes.
    """
    return machine.axes[0].law, machine.axes[1].law


def columns(machine: Joint) -> tuple[Column, ...]:
    """What a run records.

    Parameters
    ----------
    machine : Joint
        The machine.

    Returns
    -------
    tuple[Column, ...]
        In the order of the rows.
    """
    return loop.columns(kinds(machine), laws(machine))


def bench(machine: Joint, settings: Any) -> Bench:
    """Runtime parameters of the stages, and how they stand.

    Parameters
    ----------
    machine : Joint
        The machine.
    settings : Any
        Its settings.

    Returns
    -------
    Bench
        For `loop.period`.
    """
    (a, b), slant = kinds(machine), settings.hidden.squareness
    plane = Plane(-math.sin(slant), math.cos(slant))
    return Bench(a.prepare(settings.x), b.prepare(settings.y), plane)


def loops(settings: Any, plan: JointPlan) -> tuple[Any, Any]:
    """What controls each stage.

    Parameters
    ----------
    settings : Any
        Of the machine.
    plan : JointPlan
        The programme.

    Returns
    -------
    tuple[Loop, Loop]
        For `loop.period`.
    """
    first, second = (
        runs.loop(own, each) for own, each in zip(of(settings), plan.plans, strict=True)
    )
    return first, second


def expected(settings: Any, plan: JointPlan) -> float:
    """Usual duration of a programme.

    Parameters
    ----------
    settings : Any
        Of the machine.
    plan : JointPlan
        The programme.

    Returns
    -------
    float
        s.
    """
    return max(runs.expected(own, p) for own, p in zip(of(settings), plan.plans, strict=True))


def is_compiled() -> bool:
    """Whether the compiler's cache seems to hold two stages already.

    Returns
    -------
    bool
        True if a cached file of their period is there; it may be of other kinds.
    """
    return any(cache_folder().rglob("loop.period*.nbi"))


def compile_machine(machine: Joint, settings: Any, plan: JointPlan) -> None:
    """Compile the machine, or load it from the cache, so that a run need not wait for it.

    Parameters
    ----------
    machine : Joint
        The machine.
    settings : Any
        Of the run to come.
    plan : JointPlan
        Of the run to come.
    """
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
    """Run a plan and append every period to a sink.

    The same settings, plan and seed give the same rows, bit for bit. An exception from `progress`
    or the sink ends the run; what was appended stays.

    Parameters
    ----------
    machine : Joint
        The machine.
    settings : Any
        Its settings.
    plan : JointPlan
        The programme.
    sink : Sink
        Takes blocks of shape (columns, rows); columns as of `columns`.
    seed : int, optional
        Seed of the sensors' noise.
    progress : Callable[[float, int], None] | None, optional
        Called after every chunk with the simulated time (s) and the index of the present move.

    Returns
    -------
    Outcome
        How it ended.
    """
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


def record(
    machine: Joint, settings: Any, plan: JointPlan, *, title: str = "", seed: int = 0
) -> Done:
    """`perform`, in memory.

    Parameters
    ----------
    machine : Joint
        The machine.
    settings : Any
        Its settings.
    plan : JointPlan
        What is to be run.
    title : str, optional
        Of the programme.
    seed : int, optional
        Seed of the sensors' noise.

    Returns
    -------
    Done
        The recording, and how it ended.
    """
    blocks = Blocks()
    outcome = perform(machine, settings, plan, blocks, seed=seed)
    attributes = about(machine, settings, title, seed=seed)
    attributes["finished"] = int(outcome.finished)
    if outcome.fault is not None:
        attributes["fault"] = f"{outcome.fault.message} {outcome.fault.evidence}"
    rows = np.concatenate(blocks.blocks, axis=1)
    dt = settings.x.timing.period
    return Done(Recording.from_arrays(columns(machine), rows, dt, attributes), outcome)


def about(
    machine: Joint, settings: Any, title: str, *, seed: int, cycles: int = 1
) -> dict[str, Attribute]:
    """What a recording says of its run.

    Parameters
    ----------
    machine : Joint
        The machine.
    settings : Any
        Its settings.
    title : str
        Of the programme.
    seed : int
        Seed of the sensors' noise.
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
        "settings": as_toml(settings),
    }


def overridden(machine: Joint, settings: Any) -> dict[str, str]:
    """What differs from the machine's defaults.

    Parameters
    ----------
    machine : Joint
        The machine.
    settings : Any
        Its settings.

    Returns
    -------
    dict[str, str]
        Dotted path to text with unit.
    """
    return {k: v.strip('"') for k, v in config.difference(settings, machine.settings).items()}
