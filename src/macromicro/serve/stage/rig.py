"""A stage with its law as the loop's rig, and its guard as the loop's guard."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import TracebackType
from typing import Any, Self

import numpy as np

from macromicro.control.live.leading import Course
from macromicro.machines import composite, guarding, lines, open_rig, pace
from macromicro.machines.guarding import Watch
from macromicro.machines.machine import Machine
from macromicro.machines.signals import Sample
from macromicro.machines.stage import quickest
from macromicro.rig.session import Session
from macromicro.rig.twin import VirtualClock, noise_source
from macromicro.serve import faults
from macromicro.serve.snapshot import Trouble
from macromicro.serve.stage import guide
from macromicro.serve.stage._control import Control
from macromicro.serve.stage._counts import counted, shared_out, with_pulse
from macromicro.types import ENABLE, QUIET, SAFE, Clock, Command, Outputs, Rig
from macromicro.types import Sample as Shown

MISSED = "the position sensor failed while a fault was latched"
Source = Callable[[], Course]


class Entered:
    """A simulated rig that stops whenever it is left."""

    def write(self, outputs: Outputs) -> None:
        """The law gives the effort."""

    def stop(self) -> None: ...

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()


class Simulated(Entered):
    def __init__(self, machine: Machine, tree: Any, pitch: float, seed: int) -> None:
        kind = self.kind = machine.kind
        self.channels: tuple[str, ...] = ("encoder", *kind.lines)
        self.dt, self.tick, self.pitch = pace.period(tree), 0, pitch
        self._share = float(tree.encoder.pitch) / pitch
        self.clock = VirtualClock(self)
        self.control = Control(machine, tree)
        self.source: Source = Course
        self._measure = quickest(kind.measure, kind)
        self._sense = quickest(kind.sense, kind) if kind.lines else kind.sense
        self._bench = composite.bench(machine, tree)
        self._params = self._bench.stages[0]
        self._state = kind.initial(self._params)
        self._random = noise_source(seed)
        self._noise = np.empty((self.control.number, kind.noises))
        self.lines = QUIET
        self._draw()

    def _draw(self) -> None:
        self._noise[:] = self._random.standard_normal(self._noise.shape)

    def _seen(self) -> Sample:
        t = self.tick * self.dt
        found: Sample = self._measure(self._params, self._state, t, self._noise, 0)
        return found

    def read(self) -> Shown:
        seen = self._seen()
        if self.kind.lines:
            told = self._sense(self._params, self._state)
            self.lines = with_pulse(told, self.control.captured[0], self._share)
        return counted(seen.t, seen.position / self.pitch)

    def advance(self) -> None:
        seen = self._seen()
        courses, noise = (self.source(),), (self._noise,)
        (self._state,) = self.control.run(courses, self._bench, (self._state,), (seen,), noise)
        self.tick += 1
        self._draw()

    def stop(self) -> None:
        self.control.efforts = [0.0]


class Real:
    """A user's rig with an encoder, driven by a machine's law."""

    def __init__(self, machine: Machine, tree: Any, rig: Rig) -> None:
        self.kind = open_rig.of(rig, machine.kind.place)
        self._tree = tree
        self.control = Control(machine, tree, open_rig.stages(composite.clocked(machine), (rig,)))
        self.source: Source = Course
        self.outputs = tuple(getattr(rig, "outputs", ()))
        self.timed = bool(getattr(rig, "timed", False))
        self.channels = tuple(dict.fromkeys((*rig.channels, *self.kind.lines)))
        self.lines = QUIET
        self._rig, self._pitch = rig, float(tree.encoder.pitch)
        self._share = self._pitch / guide.count(tree)
        self._sample = Shown(0.0, *[math.nan] * 5)
        self._noise = np.empty((self.control.number, 0))
        self.clock: Clock = self

    def read(self) -> Shown:
        self._sample = self._rig.read()
        count = shared_out(self._sample.encoder, self._share)
        if not self.kind.lines:
            return self._sample._replace(encoder=count)
        told = lines.read(self._sample, self.channels)
        self.lines = with_pulse(told, self.control.captured[0], self._share)
        return Shown(self._sample.t, count, *[math.nan] * 4)

    def write(self, outputs: Outputs) -> None:
        """The law gives the effort."""

    def now(self) -> float:
        return self._rig.clock.now()

    def wait(self, dt: float) -> None:
        """Give the law's effort and wait for the next period."""
        seen = Sample(self._sample.t, self._sample.encoder * self._pitch)
        read: Any = Read(self._rig, self._sample)
        bench = open_rig.bench((self._tree,), (read,))
        self.control.run((self.source(),), bench, (0.0,), (seen,), (self._noise,))

    def stop(self) -> None:
        self.control.efforts = [0.0]
        self._rig.stop()

    def __enter__(self) -> Self:
        self._rig.__enter__()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._rig.__exit__(kind, error, trace)


class Read:
    """A rig whose first reading of these periods exists already."""

    def __init__(self, rig: Rig, sample: Shown) -> None:
        self._sample: Shown | None = sample
        self._rig = rig
        self.write, self.clock = rig.write, rig.clock
        self.channels, self.outputs = rig.channels, getattr(rig, "outputs", ())

    def read(self) -> Shown:
        sample, self._sample = self._sample, None
        return self._rig.read() if sample is None else sample


def doubtful(watch: Watch) -> bool:
    """Whether the guard has found the position wrong, beside other faults."""
    return bool(watch.missed) or guarding.blind(watch)


class Led:
    """A session with one of these and its machine's guard."""

    doubt = ""
    temperature = math.nan

    def __init__(self, session: Session, rig: Any) -> None:
        self._session, self._rig, self._control = session, rig, rig.control
        self.channels, self.clock = session.channels, session.clock

    @property
    def given(self) -> Outputs:
        return SAFE._replace(motor=self._control.efforts[0])

    @property
    def tripped(self) -> bool:
        return bool(self._control.tripped)

    def read(self) -> Shown:
        found: Shown = self._session.read()
        return found

    def lines(self) -> tuple[float, ...]:
        """State of the lines and of the enable line; NaN where it has none."""
        rig, there = self._rig, self._rig.kind.lines
        enable = self._control.enable if ENABLE in there else math.nan
        return (*lines.shown(rig.lines, there), enable)

    def own(self) -> list[float] | None:
        """The law's memory for the telemetry; [] while it is off, None if it shows nothing."""
        found: list[float] | None = self._control.own if self._control.own_rows else None
        return found

    def expect(self, command: Command) -> None:
        """The law follows the course."""

    def write(self, outputs: Outputs) -> None:
        self._session.write(outputs)

    def stop(self) -> None:
        self._session.stop()

    def evidence(self) -> tuple[float, float, float, float]:
        watch = self._control.watch
        return float(faults.STAGE + watch.fault), watch.value, watch.limit, watch.time

    def fault(self) -> tuple[Trouble, bool]:
        """The latched fault, and whether counts may have been missed."""
        found = faults.of_stage(*self.evidence(), self._control.places[0])
        return found, guarding.blind(self._control.watch)

    def renew(self) -> None:
        self._control.renew()

    def overlooked(self) -> str:
        """Why the position may be wrong despite the latched fault, or ""."""
        return MISSED if doubtful(self._control.watch) else ""

    def __enter__(self) -> Self:
        self._session.__enter__()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._session.__exit__(kind, error, trace)
