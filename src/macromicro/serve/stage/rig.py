"""The stages of a machine as the loop's rig, with their laws and guards as its guard.

Each period of the loop has one or several control periods of the laws, which `drive` passes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import ExitStack
from typing import Any, Self

import numpy as np

from macromicro.control.live import alone
from macromicro.control.live.leading import Course
from macromicro.kernel import compiled
from macromicro.machines import composite, guarding, lines, on_rig, open_rig, pace
from macromicro.machines.composite import AnyMachine, Composite
from macromicro.machines.guarding import Watch
from macromicro.machines.signals import Sample
from macromicro.rig.session import Session
from macromicro.rig.twin import noise_source
from macromicro.serve import faults
from macromicro.serve.shared import LAMPS
from macromicro.serve.snapshot import Trouble
from macromicro.serve.stage import guide
from macromicro.serve.stage._control import Control
from macromicro.types import ENABLE, QUIET, SAFE, Lines, Outputs, Rig
from macromicro.types import Sample as Shown


def as_counts(t: float, counts: float) -> Shown:
    """Whole counts, or NaN."""
    return Shown(t, _whole(counts), *[math.nan] * 4)


def with_pulse(told: Lines, captured: float, share: float) -> Lines:
    """Add an index pulse that passed since the last reading, in the live machine's counts."""
    pulse = captured if math.isnan(told.index_count) else told.index_count
    return told._replace(index_count=pulse * share)


def shared_out(count: float, share: float, *, whole: bool = False) -> float:
    """Convert encoder counts into the coarser counts of the live machine."""
    return count if share == 1.0 and not whole else _whole(count * share)


def _whole(count: float) -> float:
    return count if math.isnan(count) else float(math.floor(count + 0.5))


MISSED = "the position sensor failed while a fault was latched"


class Simulated:
    """The simulated stages of a machine."""

    def __init__(self, machine: AnyMachine, tree: Any, pitches: Sequence[float], seed: int) -> None:
        trees = machine.trees(tree)
        self.control = Control(machine, tree)
        self.kinds = self.control.kinds
        self.channels = _channels(machine, ("encoder", *self.kinds[0].lines))
        self.dt, self.tick, self.pitches = pace.period(trees[0]), 0, tuple(pitches)
        each = zip(trees, self.pitches, strict=True)
        self._shares = [float(own.encoder.pitch) / pitch for own, pitch in each]
        self.clock = self
        self._measure = [compiled(kind.measure) for kind in self.kinds]
        self._sense = [compiled(k.sense) if k.lines else k.sense for k in self.kinds]
        self._bench = composite.bench(machine, tree)
        stages = zip(self.kinds, self._bench.stages, strict=True)
        self._states: Any = tuple(kind.initial(params) for kind, params in stages)
        self._random = noise_source(seed)
        self._noise = tuple(np.empty((self.control.number, kind.noises)) for kind in self.kinds)
        self._read: tuple[Sample, ...] | None = None  # of this period, where it was read
        self.shown = [Shown(0.0, *[math.nan] * 5) for _ in trees]
        self.lines = [QUIET for _ in trees]
        self._draw()

    def _draw(self) -> None:
        for each in self._noise:
            each[:] = self._random.standard_normal(each.shape)

    def _seen(self) -> tuple[Sample, ...]:
        t = self.tick * self.dt
        each = zip(self._measure, self._bench.stages, self._states, self._noise, strict=True)
        return tuple(measure(params, state, t, noise, 0) for measure, params, state, noise in each)

    def read(self) -> Shown:
        seen = self._read = self._seen()
        for k, kind in enumerate(self.kinds):
            if kind.lines:
                told = self._sense[k](self._bench.stages[k], self._states[k])
                self.lines[k] = with_pulse(told, self.control.captured[k], self._shares[k])
        positions = self.control.positions(seen, [line.temperature for line in self.lines])
        for k, (position, pitch) in enumerate(zip(positions, self.pitches, strict=True)):
            self.shown[k] = as_counts(seen[k].t, position / pitch)
        return self.shown[0]

    def now(self) -> float:
        return self.tick * self.dt

    def drive(self, courses: Sequence[Course]) -> None:
        """Pass one period of the loop with laws and guards on these set points."""
        seen = self._read or self._seen()
        self._read = None
        self._states = self.control.run(courses, self._bench, self._states, seen, self._noise)
        self.tick += 1
        self._draw()

    def stop(self) -> None:
        self.control.efforts = [0.0 for _ in self.kinds]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()


def _channels(machine: AnyMachine, only: tuple[str, ...]) -> tuple[str, ...]:
    """Those of the only stage, or the encoder of each of several."""
    if not isinstance(machine, Composite):
        return only
    return tuple(map(alone.channel, composite.names(machine)))


class Real:
    """Users' rigs with an encoder, one a stage, driven in step by a machine's laws."""

    def __init__(self, machine: AnyMachine, tree: Any, rigs: Sequence[Any]) -> None:
        self._trees = machine.trees(tree)
        each = zip(rigs, self._trees, strict=True)
        group = on_rig.Rigs([Session(rig, own.timing.period) for rig, own in each])
        group.together = True
        self.rigs = group.members
        self.timed = all(getattr(rig, "timed", False) for rig in rigs)
        stages = open_rig.stages(composite.stages(machine), self.rigs)
        self.control = Control(machine, tree, stages)
        self.kinds = stages.kinds
        only = tuple(dict.fromkeys((*rigs[0].channels, *self.kinds[0].lines)))
        self.channels = _channels(machine, only)
        self.lines = [QUIET for _ in self.rigs]
        self.shown = [Shown(0.0, *[math.nan] * 5) for _ in self.rigs]
        self._read: list[Any] = list(self.shown)
        self._shares = [float(own.encoder.pitch) / guide.count(own) for own in self._trees]
        self._noise = tuple(np.empty((self.control.number, 0)) for _ in self.rigs)
        self._left = ExitStack()
        self.clock = self

    def read(self) -> Shown:
        for k, rig in enumerate(self.rigs):
            self._read[k] = rig.read()
        positions = self.control.positions(self._samples(), self._warm())
        each = enumerate(zip(self.rigs, positions, self._trees, strict=True))
        for k, (rig, position, own) in each:
            seen = self._read[k]
            raw = seen.encoder
            if self.kinds[k].corrected:
                raw = position / float(own.encoder.pitch)
            count = shared_out(raw, self._shares[k], whole=self.kinds[k].corrected)
            if self.kinds[k].lines:
                told = lines.read_lines(seen, (*rig.channels, *self.kinds[k].lines))
                self.lines[k] = with_pulse(told, self.control.captured[k], self._shares[k])
                self.shown[k] = Shown(seen.t, count, *[math.nan] * 4)
            else:
                self.shown[k] = seen._replace(encoder=count)
        return self.shown[0]

    def _samples(self) -> tuple[Sample, ...]:
        each = zip(self._read, self._trees, strict=True)
        return tuple(Sample(seen.t, seen.encoder * own.encoder.pitch) for seen, own in each)

    def _warm(self) -> list[float]:
        return [float(getattr(seen, "temperature", math.nan)) for seen in self._read]

    def now(self) -> float:
        return float(self.rigs[0].clock.now())

    def drive(self, courses: Sequence[Course]) -> None:
        """Pass one period of the loop with laws and guards on these set points."""
        samples = self._samples()
        read = [Read(rig, seen) for rig, seen in zip(self.rigs, self._read, strict=True)]
        bench = open_rig.bench(self._trees, read)
        states = (0.0,) * len(read)
        self.control.run(courses, bench, states, samples, self._noise)

    def stop(self) -> None:
        """Set all outputs to safe values, whatever one of the rigs raises."""
        self.control.efforts = [0.0 for _ in self.rigs]
        with ExitStack() as each:
            for rig in self.rigs:
                each.callback(rig.stop)

    def __enter__(self) -> Self:
        with ExitStack() as entered:
            for rig in self.rigs:
                entered.enter_context(rig)
            self._left = entered.pop_all()
        return self

    def __exit__(self, *error: Any) -> None:
        self._left.__exit__(*error)


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


class Guarded:
    """A session with one of these, its machine's laws and guards.

    `axes` are the named stages of a machine of several.
    """

    doubt = ""
    temperature = math.nan

    def __init__(self, session: Session, rig: Simulated | Real, axes: faults.Axes = ()) -> None:
        self._session, self._rig, self._control = session, rig, rig.control
        self._axes = axes
        self.channels, self.clock = session.channels, session.clock
        self._lined = any(kind.lines for kind in rig.kinds)
        self._dark = [[math.nan] * len(LAMPS) for _ in rig.kinds]

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
        """State of the only stage's lines and enable line; NaN where it has none."""
        if self._axes:
            return ()
        rig, there = self._rig, self._rig.kinds[0].lines
        enable = self._control.enable if ENABLE in there else math.nan
        return (*lines.visible_lines(rig.lines[0], there), enable)

    def lamps(self) -> list[list[float]]:
        """Whether each of `LAMPS` of each stage is on, 0 or 1; NaN of what it lacks."""
        if not self._lined:
            return self._dark
        enable, found = {ENABLE: self._control.enable}, []
        for kind, said in zip(self._rig.kinds, self._rig.lines, strict=True):
            line = said._asdict() | enable
            found.append([float(line[n] != 0.0) if n in kind.lines else math.nan for n in LAMPS])
        return found

    def own(self) -> list[float] | None:
        """The law's memory for the telemetry; [] while it is off, None if it shows nothing."""
        found: list[float] | None = self._control.own if self._control.own_rows else None
        return found

    @property
    def inner(self) -> int:
        return int(self._control.number)

    def drive(self, courses: Sequence[Course]) -> None:
        """Pass the period: laws and guards on these set points for `inner` control periods."""
        self._rig.drive(courses)
        self._session.driven()

    def stop(self) -> None:
        self._session.stop()

    def evidence(self) -> tuple[float, float, float, float]:
        control = self._control
        k = control.faulty if control.tripped else 0
        watch, begin = control.watches[k], faults.AXIS + 100 * k if self._axes else faults.STAGE
        return float(begin + watch.fault), watch.value, watch.limit, watch.time

    def fault(self) -> tuple[Trouble, bool]:
        """The latched fault, and whether counts may have been missed."""
        found = faults.describe(*self.evidence(), self._control.places[0], self._axes)
        return found, guarding.blind(self._control.watch)

    def renew(self) -> None:
        self._control.renew()

    def overlooked(self) -> str:
        """Why the position may be wrong despite the latched fault, or ""."""
        return MISSED if any(map(doubtful, self._control.watches)) else ""

    def __enter__(self) -> Self:
        self._session.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        self._session.__exit__(*error)
