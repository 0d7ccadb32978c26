"""Laws and guards of a machine, several of their periods per period of the live machine."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from operator import itemgetter
from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.control import correction
from macromicro.control.correction import Flank
from macromicro.control.live.leading import Course, at
from macromicro.errors import InputError
from macromicro.kernel import compiled
from macromicro.machines import composite, correcting, guarding, lines, pace, period, stage
from macromicro.machines.composite import AnyMachine
from macromicro.machines.guard_words import OTHER_AXIS
from macromicro.machines.guarding import OK, Limits, Watch
from macromicro.machines.lines import Held, Wired
from macromicro.machines.machine import Machine
from macromicro.machines.period import Bench, Part, Run, Stages
from macromicro.machines.sequence import MOVING, Plan, Progress
from macromicro.machines.signals import Sample
from macromicro.machines.stage import Bounds, Loop
from macromicro.machines.tree import gains
from macromicro.place import plain

RESTS = 0.05  # of the greatest speed between two readings, of a stage at rest that nothing pushes
PUSHED = 0.2  # of the greatest acceleration, of a stage that is pushed by hand
COMES_TO_REST = 0.1  # s without a faster motion
FREE = Bounds(-math.inf, math.inf, math.inf)


def check_law(machine: Machine, tree: Any, where: str = "") -> None:
    """Refuse a law whose effort homing cannot limit."""
    if machine.touch is not None and not hasattr(gains(tree), "limit"):
        accepted = "a law with a gain `limit` in V, by which homing limits its effort"
        raise InputError(f"{where}law", tree.law, accepted)


def limit_gains(gained: Any, course: Course) -> Any:
    """A law's gains with the effort limit of the course."""
    if course.effort < math.inf:
        return gained._replace(limit=min(gained.limit, course.effort))
    return gained


def pieces(course: Course, begins: Sequence[float]) -> Array:
    """The set point from each of these times of the period on; every change of it is among them."""
    known, rows = ((0.0, course.aim), *course.later), []
    for begin in begins:
        first, aim = max((piece for piece in known if piece[0] <= begin), key=itemgetter(0))
        rows.append((begin, *at(aim, begin - first)))
    return np.array(rows)


def loop_of(
    course: Course,
    gained: Any,
    tree: Any,
    wired: Wired,
    begins: Sequence[float],
    corrected: Any = (),
) -> Loop:
    """The controller of a stage for one period of the live machine."""
    aim = course.aim
    plan = Plan(
        start=np.zeros(1),
        target=np.array([aim.position]),
        hold=np.array([math.inf]),
        length=np.array([math.inf]),
        first=np.array([0, len(begins)], np.int64),
        pieces=pieces(course, begins),
        origin=aim.position,
        end=math.nan,
    )
    # A speed is measured to three counts within the guard's window.
    coarse = 3.0 * tree.encoder.pitch / tree.guard.window
    guard = plain(tree.guard)._replace(
        low=course.low,
        high=course.high,
        speed=min(tree.guard.speed, course.speed + coarse),
        leant=course.leant if math.isfinite(course.leant) else tree.guard.leant,
    )
    wired = wired._replace(homing=int(course.homing))
    return Loop(gained, guard, plain(tree.arrival), plan, wired, corrected)


def last_pulse(shown: Array) -> float:
    """The last index pulse of some periods (counts), or NaN."""
    found = shown[~np.isnan(shown)]
    return float(found[-1]) if found.size else math.nan


def nothing(number: int) -> tuple[Array, Array]:
    """Zero efforts and their record for `coasted`."""
    return np.zeros(number), np.empty((2, number))


def coast(
    free: Callable[..., Any], params: Any, state: Any, idle: tuple[Array, Array], noise: Array,
    dt: float,
) -> Any:  # fmt: skip
    """A stage's state after some periods without effort, one per draw of noise."""
    left = len(noise)
    state, _, _ = free(params, state, FREE, idle[0][:left], noise, idle[1][:, :left], dt)
    return state


class Resting:
    """The guard of a stage at rest that nothing drives: only its sensor is watched."""

    def __init__(self, tree: Any) -> None:
        self.since = math.nan  # since when it has not moved faster than at rest, off, s
        self._moving: Limits = tree.guard
        share = 1.0 if hasattr(tree, "homing") else RESTS
        guard = tree.guard
        self._still = guard._replace(leap=share * guard.leap, surge=PUSHED * guard.surge)

    def look(self, watch: Watch, seen: Sample) -> Watch:
        if math.isnan(self.since):
            self.since = seen.t
        rests = seen.t - self.since > COMES_TO_REST
        way = self._still.leap * (seen.t - watch.heard) + self._still.still
        if not rests and abs(seen.position - watch.place) > way:  # as one that swings
            self.since = seen.t
        return guarding.off(self._still if rests else self._moving, watch, seen)


class Control:
    """Laws and guards of a machine's stages, each following a course."""

    def __init__(self, machine: AnyMachine, tree: Any, stages: Stages | None = None) -> None:
        simulated = composite.stages(machine)
        self.stages = simulated if stages is None else stages
        self._trees = list(machine.trees(tree))
        kinds = self.kinds = self.stages.kinds
        count = range(len(kinds))
        number = self.number = pace.periods(self._trees[0])
        self.places = [kind.place for kind in simulated.kinds]
        self._gains = [plain(gains(own)) for own in self._trees]
        self.dt = float(self._trees[0].timing.period)
        for (name, one), own in zip(machine.stages, self._trees, strict=True):
            check_law(one, own, f"{name}." if name else "")
        if stages is None:
            self._period = period.in_place(simulated)
            self._free = [compiled(stage.opened(kind)) for kind in kinds]
            self._switch = [stage.switching(kind) for kind in kinds]
        else:
            self._period = period.period(stages, recorded=False)
            self._free = [stage.opened(kind) for kind in kinds]
            self._switch = [kind.switch for kind in kinds]
        self._apart = stages is None or len(kinds) == 1  # several rigs need each period in step
        before = [f"{name}_" if name else "" for name in composite.names(machine)]
        names = [column.name for column in period.columns(self.stages)]
        self._efforts = [names.index(f"{each}effort") for each in before]
        self.own_rows = [names.index(c.name) for c in period.law_columns(self.stages)]
        self.own: list[float] = []  # what the laws showed of their memory last; none while off
        self._pulses = [
            names.index(f"{each}index_count") if "index_count" in kind.lines else -1
            for each, kind in zip(before, kinds, strict=True)
        ]
        self._wired = [
            lines.wiring(own) if kind.lines else Wired()
            for own, kind in zip(self._trees, kinds, strict=True)
        ]
        self._out = np.empty((len(names), number))
        self._nothing = nothing(number)
        self._memory: list[Any] = [None for _ in count]
        # The courses' numbers with which the laws began.
        self._restart: list[int | None] = [None for _ in count]
        self._held = [Held() for _ in count]
        self.efforts = [0.0 for _ in count]  # V, the last that were given
        self.enable = 0.0
        self.captured = [math.nan for _ in count]  # counts of the period's last index pulses
        self.watches: list[Watch] = [guarding.fresh() for _ in count]
        self._resting = [Resting(own) for own in self._trees]
        stage_names = composite.names(machine)
        # Until the place is known there is no correction.
        self._tables: list[Any] = [
            correcting.tables(own, stage_names)._replace(origin=math.nan) if kind.corrected else ()
            for own, kind in zip(self._trees, kinds, strict=True)
        ]
        self._flanks = [Flank() for _ in count]
        self._position: Any = correction.position
        if any(self._tables):
            self._position = compiled(correction.position)

    def positions(self, seen: Sequence[Sample], degrees: Sequence[float]) -> list[float]:
        """The positions at some readings, m."""
        readings = tuple(sample.position for sample in seen)
        return [
            float(self._position(tables, flank, sample.position, readings, warm, sample.t))
            if tables
            else sample.position
            for tables, flank, sample, warm in zip(
                self._tables, self._flanks, seen, degrees, strict=True
            )
        ]

    def _known(self, courses: Sequence[Course]) -> None:
        """Begin to correct where a place has become known, and end it where it is no longer."""
        for k, (course, own) in enumerate(zip(courses, self._trees, strict=True)):
            if self._tables[k]:
                origin = course.origin if own.correction.on else math.nan
                self._tables[k] = self._tables[k]._replace(origin=origin)

    def take(self, tree: Any, stage: int = 0) -> None:
        """Take a stage's settings from the next period on; its law keeps its memory."""
        self._trees[stage], self._gains[stage] = tree, plain(gains(tree))

    def renew(self) -> None:
        self.watches = [guarding.cleared(watch) for watch in self.watches]

    @property
    def tripped(self) -> bool:
        """Whether a guard has switched off, which switches all stages off."""
        return any(watch.fault != OK for watch in self.watches)

    @property
    def faulty(self) -> int:
        """Index of the stage with the fault."""
        return next(k for k, w in enumerate(self.watches) if w.fault not in (OK, OTHER_AXIS))

    @property
    def watch(self) -> Watch:
        """That of the stage with the fault, or of the first."""
        return self.watches[self.faulty if self.tripped else 0]

    def run(
        self, courses: Sequence[Course], bench: Bench, states: Any, seen: Any, noise: Any
    ) -> tuple[Any, ...]:
        """Drive the stages for one period of the live machine."""
        self.captured = [math.nan for _ in self.kinds]
        self._known(courses)
        ready = not self.tripped and all(course.on for course in courses)
        if not ready or any(course.waiting for course in courses):
            self._restart, self._held = [None for _ in self.kinds], [Held() for _ in self.kinds]
            self.efforts, self.own = [0.0 for _ in self.kinds], []
            self.enable = 1.0 if ready else 0.0
            self._look(seen)
            return self._coast(bench, states, noise)
        self.enable = 1.0
        for each in self._resting:
            each.since = math.nan
        # Plans of several stages have the same times.
        begins = sorted({0.0, *(begin for course in courses for begin, _ in course.later)})
        controls = tuple(self._led(k, course, seen[k], begins) for k, course in enumerate(courses))
        tick = round(seen[0].t / self.dt) if math.isfinite(seen[0].t) else 0  # the guard ends that
        progress = Progress(MOVING, 0, 0, seen[0].t, math.nan, 0)
        state = zip(states, self._memory, self.watches, self._held, self._flanks, strict=True)
        parts = tuple(Part(*each) for each in state)
        began = Run(tick, progress, (math.nan,) * len(parts), parts)
        run, written = self._period(bench, controls, began, noise, self._out, self.dt)
        last = self._out[:, written - 1]
        self.own = last[self.own_rows].tolist()
        for k, part in enumerate(run.parts):
            self._memory[k], self.watches[k], self._held[k] = part.memory, part.watch, part.held
            self._flanks[k] = part.flank
            self.efforts[k] = float(last[self._efforts[k]])
            if self._pulses[k] >= 0:
                self.captured[k] = last_pulse(self._out[self._pulses[k], 1:written])  # 0 was seen
        after = tuple(part.stage for part in run.parts)
        if self.tripped:
            self.enable = 0.0
        if written < self.number:
            return self._coast(bench, after, tuple(each[written:] for each in noise))
        return after

    def _look(self, seen: Sequence[Sample]) -> None:
        """Watch the sensors while nothing is driven."""
        each = zip(self._resting, self.watches, seen, strict=True)
        watches = [resting.look(watch, sample) for resting, watch, sample in each]
        if any(watch.fault != OK for watch in watches):
            watches = [period.interlocked(watch, seen[0].t) for watch in watches]
        self.watches = watches

    def _led(self, k: int, course: Course, seen: Sample, begins: Sequence[float]) -> Loop:
        gained = limit_gains(self._gains[k], course)
        if course.restart != self._restart[k]:
            self._memory[k] = self.stages.laws[k].start(gained, seen)
            self._restart[k] = course.restart
        return loop_of(course, gained, self._trees[k], self._wired[k], begins, self._tables[k])

    def _coast(self, bench: Bench, states: Any, noise: Any) -> tuple[Any, ...]:
        """Simulate the same time without efforts."""
        ends = [
            self._switch[k](bench.stages[k], states[k], self.enable) if kind.lines else states[k]
            for k, kind in enumerate(self.kinds)
        ]
        rows = len(noise[0])
        step = rows if self._apart else 1
        for first in range(0, rows, step):
            for k, free in enumerate(self._free):
                params, draws = bench.stages[k], noise[k][first : first + step]
                ends[k] = coast(free, params, ends[k], self._nothing, draws, self.dt)
        return tuple(ends)
