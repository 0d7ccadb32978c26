"""Laws and guards of two axes, several of their periods per period of the live machine."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.columns import Column
from macromicro.control.live.leading import Course
from macromicro.control.stage_law import StageLaw
from macromicro.machines import guarding, lines, pace, stage
from macromicro.machines.guard_words import OTHER_AXIS
from macromicro.machines.guarding import OK
from macromicro.machines.joint import loop, runs
from macromicro.machines.joint.loop import Bench, Half, Joined, Run
from macromicro.machines.joint.machine import Joint
from macromicro.machines.joint.settings import AXES, of
from macromicro.machines.lines import Held
from macromicro.machines.sequence import MOVING, Progress
from macromicro.machines.signals import Sample
from macromicro.machines.stage import Kind
from macromicro.machines.tree import gains
from macromicro.serve.stage._control import (
    Resting,
    checked,
    coasted,
    led,
    limited,
    nothing,
    pulsed,
)

Pair = tuple[Any, Any]


class Control:
    """Laws and guards of both axes, each following a course."""

    def __init__(self, machine: Joint, tree: Any, kinds: tuple[Kind, Kind]) -> None:
        self._trees = of(tree)
        number = self.number = pace.periods(tree.x)
        self.kinds, self._laws = kinds, runs.laws(machine)
        self._gains = list(map(gains, self._trees))
        for name, axis, own in zip(AXES, machine.axes, self._trees, strict=True):
            checked(axis, own, f"{name}.")
        self.dt = float(tree.x.timing.period)
        simulated = kinds == runs.kinds(machine)
        self._period = (loop.in_place if simulated else loop.period)(kinds, self._laws)
        free, self._switch = [stage.opened(k) for k in kinds], [k.switch for k in kinds]
        if simulated:
            free = [stage.quickest(each, kind) for each, kind in zip(free, kinds, strict=True)]
            self._switch = [stage.switching(kind) for kind in kinds]
        self._free = free
        self._wired = [lines.wired(own) for own in self._trees]
        names = [c.name for c in loop.columns(self.kinds, self._laws)]
        self._rows = [names.index(f"{axis}_effort") for axis in AXES]
        self.own_rows = [names.index(column.name) for column in law_columns(self.kinds, self._laws)]
        self.own: list[float] = []  # what the laws showed of their memory last; none while off
        self._index = [names.index(n) if n in names else -1 for n in _indices()]
        self._out = np.empty((len(names), number))
        self._nothing = nothing(number)
        self._memory: list[Any] = [None, None]
        self._restart: list[int | None] = [None, None]
        self._held = [Held(), Held()]
        self.efforts = [0.0, 0.0]  # V, the last that were given
        self.enable = 0.0
        self.captured = [math.nan, math.nan]  # counts of the last index pulses of the period
        self.watches = [guarding.fresh(), guarding.fresh()]
        self._resting = [Resting(own) for own in self._trees]

    def take(self, axis: int, gains: Any) -> None:
        """Change a law's gains from the next period on; it keeps its memory."""
        self._gains[axis] = gains

    def renew(self) -> None:
        self.watches = [guarding.cleared(watch) for watch in self.watches]

    @property
    def tripped(self) -> bool:
        """Whether a guard has switched off, which switches both axes off."""
        return any(watch.fault != OK for watch in self.watches)

    @property
    def faulty(self) -> int:
        """Index of the axis with the fault."""
        return next(k for k, w in enumerate(self.watches) if w.fault not in (OK, OTHER_AXIS))

    def run(
        self, courses: Any, bench: Bench, stages: Pair, seen: tuple[Sample, Sample], noise: Any
    ) -> Pair:
        """Drive both axes for one period of the live machine."""
        self.captured = [math.nan, math.nan]
        ready = not self.tripped and all(course.on for course in courses)
        if not ready or any(course.waiting for course in courses):
            self._restart, self._held = [None, None], [Held(), Held()]
            self.efforts, self.enable = [0.0, 0.0], 1.0 if ready else 0.0
            self.own = []
            self._look(seen)
            return self._coast(bench, stages, noise)
        self.enable = 1.0
        for each in self._resting:
            each.since = math.nan
        controls = tuple(self._led(k, course, seen[k]) for k, course in enumerate(courses))
        tick = round(seen[0].t / self.dt) if math.isfinite(seen[0].t) else 0  # the guards end that
        progress = Progress(MOVING, 0, 0, seen[0].t, math.nan, 0)
        first, second = (
            Half(stages[k], self._memory[k], self.watches[k], self._held[k]) for k in (0, 1)
        )
        began = Run(tick, Joined(progress, math.nan), first, second)
        run, written = self._period(bench, controls, began, noise, self._out, self.dt)
        if self.own_rows:
            self.own = self._out[self.own_rows, written - 1].tolist()
        for k, half in enumerate((run.first, run.second)):
            self._memory[k], self.watches[k], self._held[k] = half.memory, half.watch, half.held
            self.efforts[k] = float(self._out[self._rows[k], written - 1])
            if self._index[k] >= 0:
                rest = self._out[self._index[k], 1:written]  # the first was seen
                self.captured[k] = pulsed(rest)
        after = (run.first.stage, run.second.stage)
        if self.tripped:
            self.enable = 0.0
        if written < self.number:
            return self._coast(bench, after, tuple(each[written:] for each in noise))
        return after

    def _look(self, seen: tuple[Sample, Sample]) -> None:
        """Watch both sensors while nothing is driven."""
        first, second = (
            resting.look(watch, sample)
            for resting, watch, sample in zip(self._resting, self.watches, seen, strict=True)
        )
        first, _ = loop.told(first, second, 0.0, seen[0].t)
        second, _ = loop.told(second, first, 0.0, seen[0].t)
        self.watches = [first, second]

    def _led(self, k: int, course: Course, seen: Sample) -> stage.Loop:
        own = limited(self._gains[k], course)
        if course.restart != self._restart[k]:
            self._memory[k] = self._laws[k].start(own, seen)
            self._restart[k] = course.restart
        return led(course, own, self._trees[k], self._wired[k])

    def _coast(self, bench: Bench, stages: Pair, noise: tuple[Array, ...]) -> Pair:
        """Simulate the same time without efforts."""
        ends = [
            self._switch[k](bench[k], stages[k], self.enable) if kind.lines else stages[k]
            for k, kind in enumerate(self.kinds)
        ]
        for draws in zip(*noise, strict=True):
            for k, draw in enumerate(draws):
                free, one = self._free[k], draw[None, :]
                ends[k] = coasted(free, bench[k], ends[k], self._nothing, one, self.dt)
        return ends[0], ends[1]


def _indices() -> list[str]:
    return [f"{axis}_index_count" for axis in AXES]


def law_columns(kinds: tuple[Kind, Kind], laws: tuple[StageLaw, StageLaw]) -> tuple[Column, ...]:
    """As `stage.own` for both axes, with the axis' letter in front."""
    pairs = zip(AXES, kinds, laws, strict=True)
    return tuple(
        c._replace(name=f"{axis}_{c.name}")
        for axis, kind, law in pairs
        for c in stage.own(kind, law)
    )
