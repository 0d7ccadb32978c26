"""One control period of two stages on one clock, interpreted and compiled."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Annotated, Any, NamedTuple

import numpy as np

from macromicro import joining
from macromicro.arrays import Array
from macromicro.columns import Column, Quantity, layout, put
from macromicro.control import arrival
from macromicro.control.arrival import TICK
from macromicro.control.stage_law import Sample, StageLaw, Target
from macromicro.kernel import kernel
from macromicro.machines import guarding, sequence, stage
from macromicro.machines.guard_words import OTHER_AXIS
from macromicro.machines.guarding import OK, Watch, latched
from macromicro.machines.joint.settings import AXES
from macromicro.machines.lines import Held
from macromicro.machines.sequence import DONE, HOLDING, MOVING, Progress
from macromicro.machines.signals import Inside, Output
from macromicro.machines.stage import FAULT, Kind, Loop
from macromicro.types import Enable


class Joined(NamedTuple):
    """State of the sequence of both stages."""

    progress: Progress  # of both; its `inside` is the first stage's
    inside: float  # since when the second stage is within its tolerance, s; NaN: it is not


class Half(NamedTuple):
    """State of one stage."""

    stage: Any
    memory: Any
    watch: Watch
    held: Held = Held()  # the guard's, of a stage with lines


class Run(NamedTuple):
    tick: int  # control periods so far
    joined: Joined
    # first, second: each stage's
    first: Half
    second: Half

    @property
    def over(self) -> bool:
        tripped = self.first.watch.fault != OK or self.second.watch.fault != OK
        return self.joined.progress.phase == DONE or tripped


class Clock(NamedTuple):
    t: Annotated[float, Quantity("s", "time since the start")]


class Place(NamedTuple):
    """The true place of the load in the plane."""

    x: Annotated[float, Quantity("mm", "true place in the plane", column="true_x", scale=1e3)]
    y: Annotated[float, Quantity("mm", "true place in the plane", column="true_y", scale=1e3)]


class Plane(NamedTuple):
    """Orientation of the second axis against the first."""

    along: float  # what a way of the second axis is along x, m/m
    across: float


class Bench(NamedTuple):
    # first, second: of each kind
    first: Any
    second: Any
    plane: Plane


Period = Callable[..., tuple[Run, int]]


@kernel
def placed(plane: Plane, first: float, second: float) -> Place:
    return Place(first + plane.along * second, plane.across * second)


@kernel
def aims(
    loops: tuple[Loop, Loop], s: Joined, first: Sample, second: Sample
) -> tuple[Joined, Target, Target]:
    """One period of the sequence: the set points of both."""
    plan, other = loops[0].plan, loops[1].plan
    now, t = s.progress, first.t
    if sequence.over(plan, now, t):
        now = Progress(DONE, now.move, now.piece, t, now.inside, now.arrived)
    if now.phase == DONE:
        return (
            Joined(now, s.inside),
            Target(plan.target[now.move], 0.0, 0.0, math.inf),
            Target(other.target[now.move], 0.0, 0.0, math.inf),
        )
    inside = s.inside
    if sequence.due(plan, now, t):
        now = Progress(MOVING, now.move + 1, plan.first[now.move + 1], t, math.nan, 0)
        inside = math.nan
    piece, one = sequence.aim(plan, now, t)
    piece, two = sequence.aim(other, now, t)
    now = Progress(now.phase, now.move, piece, now.began, now.inside, now.arrived)
    since = t - now.began
    if now.phase == MOVING and since >= plan.length[now.move] - TICK:
        a, b = loops[0].arrival, loops[1].arrival
        within = arrival.since(a, one.position - first.position, now.inside, t)
        inside = arrival.since(b, two.position - second.position, inside, t)
        there = arrival.arrived(a, within, t) and arrival.arrived(b, inside, t)
        patience = max(a.patience, b.patience)
        if there or since >= plan.length[now.move] + patience - TICK:
            now = Progress(HOLDING, now.move, piece, t, within, int(there))
        else:
            now = Progress(MOVING, now.move, piece, now.began, within, 0)
    return Joined(now, inside), one, two


@kernel
def told(watch: Watch, other: Watch, effort: float, t: float) -> tuple[Watch, float]:
    """A guard informed of the other one's fault, in the same period."""
    if other.fault == OK:
        return watch, effort
    if watch.fault != OK:
        return watch, 0.0
    return latched(watch, OTHER_AXIS, 0.0, 0.0, t), 0.0


_SHARED = ("t", *(c.name for c in layout(Inside).columns))


@lru_cache(maxsize=64)
def columns(kinds: tuple[Kind, Kind], laws: tuple[StageLaw, StageLaw]) -> tuple[Column, ...]:
    found = list(layout(Clock, Inside, Place).columns)
    for name, kind, law in zip(AXES, kinds, laws, strict=True):
        own = [c for c in stage.columns(kind, law) if c.name not in _SHARED]
        found += [c._replace(name=f"{name}_{c.name}") for c in own]
    return tuple(found)


def _rows(name: str, kind: Kind, law: StageLaw, every: tuple[Column, ...]) -> tuple[Any, ...]:
    """Row indices of the parts of `stage.laid_out`."""
    index = {c.name: k for k, c in enumerate(every)}
    names = [c.name for c in stage.columns(kind, law)]
    place = np.array([index[n if n in _SHARED else f"{name}_{n}"] for n in names])
    parts = stage.laid_out(kind, law).parts
    return tuple((np.where(p.rows >= 0, place[p.rows], -1), p.scales) for p in parts)


@lru_cache(maxsize=64)
def period(  # noqa: PLR0915 - each line for either axis
    kinds: tuple[Kind, Kind], laws: tuple[StageLaw, StageLaw]
) -> Period:
    (kind_a, kind_b), (law_a, law_b) = kinds, laws
    measure_a, advance_a, show_a, step_a = kind_a.measure, kind_a.advance, kind_a.show, law_a.step
    measure_b, advance_b, show_b, step_b = kind_b.measure, kind_b.advance, kind_b.show, law_b.step
    tell_a, tell_b = law_a.tell, law_b.tell
    sense_a, switch_a, sense_b, switch_b = kind_a.sense, kind_a.switch, kind_b.sense, kind_b.switch
    joining.joined(measure_a, advance_a, show_a, step_a, sense_a, switch_a)
    joining.joined(measure_b, advance_b, show_b, step_b, sense_b, switch_b)
    watched_a, bounded_a = stage.watching(kind_a)
    watched_b, bounded_b = stage.watching(kind_b)
    every = columns(kinds, laws)
    rows_a, rows_b = _rows(AXES[0], kind_a, law_a, every), _rows(AXES[1], kind_b, law_b, every)
    sample_a, target_a, output_a, memory_a, inside, truth_a, lines_a, enable_a = rows_a
    sample_b, target_b, output_b, memory_b, _, truth_b, lines_b, enable_b = rows_b
    place = layout(Clock, Inside, Place).parts[2]

    def run(  # noqa: PLR0915
        bench: Bench, loops: Any, state: Run, noise: Any, out: Array, dt: float
    ) -> tuple[Run, int]:
        tick, joined = state.tick, state.joined
        first, second = state.first, state.second
        written = 0
        for k in range(noise[0].shape[0]):
            t = tick * dt
            seen_a = measure_a(bench.first, first.stage, t, noise[0], k)
            seen_b = measure_b(bench.second, second.stage, t, noise[1], k)
            said_a = sense_a(bench.first, first.stage)
            said_b = sense_b(bench.second, second.stage)
            joined, aim_a, aim_b = aims(loops, joined, seen_a, seen_b)
            mind_a, effort_a = step_a(loops[0].gains, first.memory, aim_a, seen_a, dt)
            mind_b, effort_b = step_b(loops[1].gains, second.memory, aim_b, seen_b, dt)
            watch_a, held_a, effort_a = watched_a(
                loops[0].wired, first.held, first.watch, said_a, seen_a, effort_a
            )
            watch_b, held_b, effort_b = watched_b(
                loops[1].wired, second.held, second.watch, said_b, seen_b, effort_b
            )
            guard_a = bounded_a(loops[0].guard, loops[0].wired, held_a)
            guard_b = bounded_b(loops[1].guard, loops[1].wired, held_b)
            watch_a, effort_a = guarding.step(guard_a, watch_a, seen_a, aim_a, effort_a)
            watch_b, effort_b = guarding.step(guard_b, watch_b, seen_b, aim_b, effort_b)
            watch_a, effort_a = told(watch_a, watch_b, effort_a, t)
            watch_b, effort_b = told(watch_b, watch_a, effort_b, t)
            tripped = watch_a.fault != OK  # which trips the other one, too
            enable = 0.0 if tripped else 1.0
            now = joined.progress
            phase = float(FAULT if tripped else now.phase)
            put(out, k, seen_a, sample_a[0], sample_a[1])
            put(out, k, seen_b, sample_b[0], sample_b[1])
            put(out, k, aim_a, target_a[0], target_a[1])
            put(out, k, aim_b, target_b[0], target_b[1])
            put(out, k, Output(effort_a), output_a[0], output_a[1])
            put(out, k, Output(effort_b), output_b[0], output_b[1])
            put(out, k, tell_a(mind_a), memory_a[0], memory_a[1])
            put(out, k, tell_b(mind_b), memory_b[0], memory_b[1])
            told_now = Inside(phase, float(now.move), float(now.arrived))
            put(out, k, told_now, inside[0], inside[1])
            true_a, true_b = show_a(bench.first, first.stage), show_b(bench.second, second.stage)
            put(out, k, true_a, truth_a[0], truth_a[1])
            put(out, k, true_b, truth_b[0], truth_b[1])
            put(out, k, placed(bench.plane, true_a[0], true_b[0]), place.rows, place.scales)
            put(out, k, said_a, lines_a[0], lines_a[1])
            put(out, k, said_b, lines_b[0], lines_b[1])
            put(out, k, Enable(enable), enable_a[0], enable_a[1])
            put(out, k, Enable(enable), enable_b[0], enable_b[1])
            on_a = switch_a(bench.first, first.stage, enable)
            on_b = switch_b(bench.second, second.stage, enable)
            stage_a = advance_a(bench.first, on_a, effort_a, noise[0], k, dt)
            stage_b = advance_b(bench.second, on_b, effort_b, noise[1], k, dt)
            first = Half(stage_a, mind_a, watch_a, held_a)
            second = Half(stage_b, mind_b, watch_b, held_b)
            tick += 1
            written += 1
            if now.phase == DONE or tripped:
                break
        return Run(tick, joined, first, second), written

    return run


def fastest(kinds: tuple[Kind, Kind], laws: tuple[StageLaw, StageLaw]) -> Period:
    """The loop of two stages at machine speed."""
    return stage.owning(in_place(kinds, laws))


def in_place(kinds: tuple[Kind, Kind], laws: tuple[StageLaw, StageLaw]) -> Period:
    """`fastest` that may change the state given to it."""
    if all(map(stage.compiles, laws)):
        return stage.quickest(period(kinds, laws), *kinds)
    return period((stage.quick(kinds[0]), stage.quick(kinds[1])), laws)


def beginning(
    kinds: tuple[Kind, Kind], laws: tuple[StageLaw, StageLaw], bench: Bench, loops: Any
) -> Run:
    halves = []
    for kind, law, params, loop in zip(kinds, laws, bench[:2], loops, strict=True):
        memory = law.start(loop.gains, Sample(0.0, loop.plan.origin))
        halves.append(Half(kind.initial(params), memory, guarding.fresh(), Held()))
    return Run(0, Joined(sequence.begin(), math.nan), halves[0], halves[1])
