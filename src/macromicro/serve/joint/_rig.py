"""Two axes with their laws as the loop's rig, and their guards as its guard."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import ExitStack
from types import TracebackType
from typing import Any, Self

import numpy as np

from macromicro.control.live.alone import SENSORS
from macromicro.control.live.leading import Course
from macromicro.control.live.messages import AXES
from macromicro.machines import composite, guarding, lines, open_rig, pace
from macromicro.machines.composite import Composite
from macromicro.machines.joint.settings import of
from macromicro.machines.on_rig import Rigs
from macromicro.machines.signals import Sample
from macromicro.machines.stage import quickest
from macromicro.rig.session import Session
from macromicro.rig.twin import VirtualClock, noise_source
from macromicro.serve import _lamps as lamps
from macromicro.serve import faults
from macromicro.serve.shared import NO_LINES
from macromicro.serve.snapshot import Trouble
from macromicro.serve.stage import guide
from macromicro.serve.stage import rig as stage_rig
from macromicro.serve.stage._control import Control
from macromicro.serve.stage._counts import counted, shared_out, with_pulse
from macromicro.types import ENABLE, QUIET, SAFE, Clock, Lines, Outputs
from macromicro.types import Sample as Shown

Source = Callable[[], tuple[Course, Course]]


class Simulated(stage_rig.Entered):
    def __init__(
        self, machine: Composite, tree: Any, pitches: tuple[float, float], seed: int
    ) -> None:
        self.channels = tuple(SENSORS[axis] for axis in AXES)
        self.dt, self.tick, self._pitches = pace.period(tree.x), 0, pitches
        self._shares = [own.encoder.pitch / p for own, p in zip(of(tree), pitches, strict=True)]
        self.clock = VirtualClock(self)
        self.control = Control(machine, tree)
        self.kinds = self.control.kinds
        self.source: Source = _off
        self._measure = [quickest(kind.measure, kind) for kind in self.kinds]
        self._sense = [quickest(k.sense, k) if k.lines else k.sense for k in self.kinds]
        self._bench = composite.bench(machine, tree)
        each = zip(self.kinds, self._bench.stages, strict=True)
        self._states: Any = tuple(kind.initial(params) for kind, params in each)
        self._random = noise_source(seed)
        self._noise = tuple(np.empty((self.control.number, kind.noises)) for kind in self.kinds)
        self.second = Shown(0.0, *[math.nan] * 5)
        self.lines: list[Lines] = [QUIET, QUIET]
        self._draw()

    def _draw(self) -> None:
        for each in self._noise:
            each[:] = self._random.standard_normal(each.shape)

    def _seen(self) -> tuple[Sample, Sample]:
        t = self.tick * self.dt
        first, second = (
            self._measure[k](self._bench.stages[k], self._states[k], t, self._noise[k], 0)
            for k in (0, 1)
        )
        return first, second

    def read(self) -> Shown:
        first, second = (
            counted(seen.t, seen.position / pitch)
            for seen, pitch in zip(self._seen(), self._pitches, strict=True)
        )
        for k, kind in enumerate(self.kinds):
            if kind.lines:
                told = self._sense[k](self._bench.stages[k], self._states[k])
                self.lines[k] = with_pulse(told, self.control.captured[k], self._shares[k])
        self.second = second
        return first

    def advance(self) -> None:
        seen = self._seen()
        self._states = self.control.run(self.source(), self._bench, self._states, seen, self._noise)
        self.tick += 1
        self._draw()

    def stop(self) -> None:
        self.control.efforts = [0.0, 0.0]


def _off() -> tuple[Course, Course]:
    return Course(), Course()


class Real:
    """Two user rigs with an encoder each, driven in step."""

    def __init__(self, machine: Composite, tree: Any, rigs: Rigs) -> None:
        rigs.together = True
        self.members = rigs.members
        self.channels = tuple(SENSORS[axis] for axis in AXES)
        stages = open_rig.stages(composite.clocked(machine), rigs.members)
        self.control = Control(machine, tree, stages)
        self.kinds = self.control.kinds
        self.source: Source = _off
        self._pitches = [float(own.encoder.pitch) for own in of(tree)]
        self._shares = [own.encoder.pitch / guide.count(own) for own in of(tree)]
        self._trees = machine.trees(tree)
        self._noise = tuple(np.empty((self.control.number, 0)) for _ in AXES)
        self._seen: tuple[Shown, ...] = ()
        self.second = Shown(0.0, *[math.nan] * 5)
        self.lines: list[Lines] = [QUIET, QUIET]
        self.clock: Clock = self
        self._left = ExitStack()

    def read(self) -> Shown:
        self._seen = tuple(rig.read() for rig in self.members)
        for k, rig in enumerate(self.members):
            told = lines.read(self._seen[k], rig.channels)
            self.lines[k] = with_pulse(told, self.control.captured[k], self._shares[k])
        first, self.second = (
            Shown(self._seen[0].t, shared_out(seen.encoder, share), *[math.nan] * 4)
            for seen, share in zip(self._seen, self._shares, strict=True)
        )
        return first

    def write(self, outputs: Outputs) -> None:
        """The laws give the efforts."""

    def now(self) -> float:
        return self.members[0].now()

    def wait(self, dt: float) -> None:
        """Give the laws' efforts and wait for the next period of both."""
        first, second = (
            Sample(seen.t, seen.encoder * pitch)
            for seen, pitch in zip(self._seen, self._pitches, strict=True)
        )
        read = [stage_rig.Read(*each) for each in zip(self.members, self._seen, strict=True)]
        bench = open_rig.bench(self._trees, read)
        self.control.run(self.source(), bench, (0.0, 0.0), (first, second), self._noise)

    def stop(self) -> None:
        """Set all outputs of both to safe values, whatever one of them raises."""
        self.control.efforts = [0.0, 0.0]
        with ExitStack() as each:
            for rig in self.members:
                each.callback(rig.stop)

    def __enter__(self) -> Self:
        with ExitStack() as entered:
            for rig in self.members:
                entered.enter_context(rig)
            self._left = entered.pop_all()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._left.__exit__(kind, error, trace)


class Led(stage_rig.Led):
    """A session with both axes and their guards."""

    def __init__(self, session: Session, rig: Simulated | Real) -> None:
        super().__init__(session, rig)
        self._both = rig

    @property
    def given(self) -> Outputs:
        return SAFE._replace(motor=self._both.control.efforts[0])

    @property
    def tripped(self) -> bool:
        return self._both.control.tripped

    @property
    def second(self) -> Shown:
        return self._both.second

    def lines(self) -> tuple[float, ...]:
        return NO_LINES

    def lamps(self) -> float:
        enable = {ENABLE: self._both.control.enable}
        return lamps.packed([
            {name: told for name, told in (said._asdict() | enable).items() if name in kind.lines}
            for kind, said in zip(self._both.kinds, self._both.lines, strict=True)
        ])  # fmt: skip

    def evidence(self) -> tuple[float, float, float, float]:
        k = self._both.control.faulty
        watch = self._both.control.watches[k]
        return float(faults.AXIS[k] + watch.fault), watch.value, watch.limit, watch.time

    def fault(self) -> tuple[Trouble, bool]:
        """The latched fault, and whether counts may have been missed."""
        control = self._both.control
        found = faults.of_axis(*self.evidence())
        return found, guarding.blind(control.watches[control.faulty])

    def overlooked(self) -> str:
        """Why a position may be wrong despite the latched fault, or ""."""
        missed = any(map(stage_rig.doubtful, self._both.control.watches))
        return stage_rig.MISSED if missed else ""
