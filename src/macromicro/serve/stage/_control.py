"""A stage's law and guard, several of their periods per period of the live machine."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.control.live.leading import Course
from macromicro.errors import InputError
from macromicro.machines import guarding, lines, pace, stage
from macromicro.machines.guarding import OK, Limits, Watch
from macromicro.machines.lines import Held, Wired
from macromicro.machines.machine import Machine
from macromicro.machines.sequence import MOVING, Plan, Progress
from macromicro.machines.signals import Sample
from macromicro.machines.stage import Bounds, Kind, Loop, Run
from macromicro.machines.tree import gains

RESTS = 0.05  # of the greatest speed between two readings, of a stage at rest that nothing pushes
PUSHED = 0.2  # of the greatest acceleration, of a stage that is pushed by hand
COMES_TO_REST = 0.1  # s without a faster motion
FREE = Bounds(-math.inf, math.inf, math.inf)


def checked(machine: Machine, tree: Any, where: str = "") -> None:
    """Refuse a law whose effort homing cannot limit."""
    if machine.touch is not None and not hasattr(gains(tree), "limit"):
        accepted = "a law with a gain `limit` in V, by which homing limits its effort"
        raise InputError(f"{where}law", tree.law, accepted)


def limited(gained: Any, course: Course) -> Any:
    """A law's gains with the effort limit of the course."""
    if course.effort < math.inf:
        return gained._replace(limit=min(gained.limit, course.effort))
    return gained


def led(course: Course, gained: Any, tree: Any, wired: Wired) -> Loop:
    """The controller of a stage for one period of the live machine."""
    aim = course.aim
    plan = Plan(
        start=np.zeros(1),
        target=np.array([aim.position]),
        hold=np.array([math.inf]),
        length=np.array([math.inf]),
        first=np.array([0, 1], np.int64),
        pieces=np.array([[0.0, *aim]]),
        origin=aim.position,
        end=math.nan,
    )
    # A speed is measured to three counts within the guard's window.
    coarse = 3.0 * tree.encoder.pitch / tree.guard.window
    guard = tree.guard._replace(
        low=course.low,
        high=course.high,
        speed=min(tree.guard.speed, course.speed + coarse),
        leant=course.leant if math.isfinite(course.leant) else tree.guard.leant,
    )
    return Loop(gained, guard, tree.arrival, plan, wired._replace(homing=int(course.homing)))


def pulsed(shown: Array) -> float:
    """The last index pulse of some periods (counts), or NaN."""
    found = shown[~np.isnan(shown)]
    return float(found[-1]) if found.size else math.nan


def nothing(number: int) -> tuple[Array, Array]:
    """Zero efforts and their record for `coasted`."""
    return np.zeros(number), np.empty((2, number))


def coasted(
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
    """Law and guard of a stage that follow a course."""

    def __init__(self, machine: Machine, tree: Any, kind: Kind) -> None:
        self._law, self._tree = machine.law, tree
        number = self.number = pace.periods(tree)
        self.place = machine.kind.place
        self._gains = gains(tree)
        self.dt = float(tree.timing.period)
        checked(machine, tree)
        law, simulated = machine.law, kind is machine.kind
        self._period = stage.in_place(kind, law) if simulated else stage.period(kind, law)
        self._free = stage.quickest(stage.opened(kind), kind) if simulated else stage.opened(kind)
        names = [column.name for column in stage.columns(kind, law)]
        self._effort_row = names.index("effort")
        self.own_rows = [names.index(column.name) for column in stage.own(kind, law)]
        self.own: list[float] = []  # what the law showed of its memory last; none while it is off
        self._index_row = names.index("index_count") if "index_count" in kind.lines else None
        self._kind = kind
        self._switch = stage.switching(kind) if simulated else kind.switch
        self._wired = lines.wired(tree) if kind.lines else Wired()
        self._held = Held()
        self._out = np.empty((len(names), number))
        self._nothing = nothing(number)
        self._memory: Any
        self._restart: int | None = None  # the course's, with which the law began
        self.watch: Watch = guarding.fresh()
        self._resting = Resting(tree)
        self.effort = 0.0  # V, the last that was given
        self.enable = 0.0
        self.captured = math.nan  # counts of the last index pulse of the period, before its end

    def take(self, gains: Any) -> None:
        """Change the law's gains from the next period on; it keeps its memory."""
        self._gains = gains

    def renew(self) -> None:
        self.watch = guarding.cleared(self.watch)

    def run(self, course: Course, params: Any, state: Any, seen: Sample, noise: Array) -> Any:
        self.captured = math.nan
        if not course.on or course.waiting or self.watch.fault != OK:
            self._restart, self.effort, self._held = None, 0.0, Held()
            self.own = []
            self.enable = 1.0 if course.waiting and self.watch.fault == OK else 0.0
            self.watch = self._resting.look(self.watch, seen)
            return self._coast(params, state, noise)
        self._resting.since = math.nan
        self.enable = 1.0
        gained = limited(self._gains, course)
        if course.restart != self._restart:
            self._memory, self._restart = self._law.start(gained, seen), course.restart
        control = led(course, gained, self._tree, self._wired)
        tick = round(seen.t / self.dt) if math.isfinite(seen.t) else 0  # the guard ends that
        began = Run(
            tick,
            state,
            Progress(MOVING, 0, 0, seen.t, math.nan, 0),
            self._memory,
            self.watch,
            self._held,
        )
        run, written = self._period(params, control, began, noise, self._out, self.dt)
        self._memory, self.watch, self._held = run.memory, run.watch, run.held
        self.effort = float(self._out[self._effort_row, written - 1])
        if self.own_rows:
            self.own = self._out[self.own_rows, written - 1].tolist()
        if self._index_row is not None:
            self.captured = pulsed(self._out[self._index_row, 1:written])  # the first was seen
        if self.watch.fault != OK:
            self.enable = 0.0
        if written < self.number:
            return self._coast(params, run.stage, noise[written:])
        return run.stage

    def _coast(self, params: Any, state: Any, noise: Array) -> Any:
        """Simulate the same time without an effort."""
        if self._kind.lines:
            state = self._switch(params, state, self.enable)
        return coasted(self._free, params, state, self._nothing, noise, self.dt)
