"""One control period of the stages of a machine on one clock, interpreted and compiled."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Annotated, Any, NamedTuple, get_type_hints

import numpy as np

from macromicro import arrays, interpreting, joining
from macromicro.arrays import Array
from macromicro.columns import Column, Layout, Quantity, layout, put
from macromicro.control import correction, outside
from macromicro.control.correction import Flank, Reading
from macromicro.control.stage_law import Sample, StageLaw, Target
from macromicro.kernel import compiled, kernel
from macromicro.machines import guarding, sequence
from macromicro.machines.folding import empty, empty_and_false, empty_pair, fold, nothing
from macromicro.machines.guard_words import OTHER_AXIS
from macromicro.machines.guarding import OK, Watch, latched
from macromicro.machines.lines import Held
from macromicro.machines.sequence import DONE, Progress
from macromicro.machines.signals import Inside, Output
from macromicro.machines.stage import Kind, compiles, quick, watching
from macromicro.types import Enable, Lines

FAULT = 4  # phase that is recorded once a guard has tripped


class Extra(NamedTuple):
    """What a machine records beside its stages."""

    truth: Any  # a ``NamedTuple`` of floats, annotated with `Quantity`
    show: Callable[[Any, Any], Any]  # kernel: from its parameters and the stages' truths to it


class Stages(NamedTuple):
    """The stages of a machine, each under its law."""

    kinds: tuple[Kind, ...]
    laws: tuple[StageLaw, ...]
    names: tuple[str, ...] = ("",)  # before their columns; the only stage of a machine has none
    extra: Extra | None = None


class Bench(NamedTuple):
    """Runtime parameters."""

    stages: tuple[Any, ...]  # of each
    extra: Any = ()  # of `Stages.extra`


class Part(NamedTuple):
    """State of one stage."""

    stage: Any
    memory: Any  # the law's
    watch: Watch  # the guard's
    held: Held = Held()  # the guard's, of a stage with lines
    flank: Flank = Flank()  # of a corrected stage


class Run(NamedTuple):
    """State of a run."""

    tick: int  # control periods so far
    progress: Progress
    inside: tuple[float, ...]  # since when each stage is within its tolerance, s; NaN: it is not
    parts: tuple[Part, ...]

    @property
    def over(self) -> bool:
        """Whether the programme is done or a guard has tripped."""
        return self.progress.phase == DONE or any(p.watch.fault != OK for p in self.parts)


Period = Callable[[Bench, Any, Run, Any, Array, float], tuple[Run, int]]


class Clock(NamedTuple):
    t: Annotated[float, Quantity("s", "time since the start")]


_SHARED = ("t", *(c.name for c in layout(Inside).columns))


@lru_cache(maxsize=64)
def columns(stages: Stages) -> tuple[Column, ...]:
    """What a run records: of several stages what they share first, then each under its name."""
    if stages.names == ("",):
        return _columns(stages.kinds[0], stages.laws[0])
    shared = (Clock, Inside) if stages.extra is None else (Clock, Inside, stages.extra.truth)
    found = list(layout(*shared).columns)
    for name, kind, law in zip(stages.names, stages.kinds, stages.laws, strict=True):
        own = (c for c in _columns(kind, law) if c.name not in _SHARED)
        found += [c._replace(name=f"{name}_{c.name}") for c in own]
    return tuple(found)


def law_columns(stages: Stages) -> tuple[Column, ...]:
    """What laws of other packages have recorded of their memory."""
    starts = tuple(f"{name}_law_" if name else "law_" for name in stages.names)
    return tuple(c for c in columns(stages) if c.name.startswith(starts))


def _columns(kind: Kind, law: StageLaw) -> tuple[Column, ...]:
    found = _laid_out(kind, law).columns
    if law.gains not in outside.found_types():
        return found
    named = {c.name: f"law_{c.name}" for c in layout(law.memory).columns}
    return tuple(c._replace(name=named.get(c.name, c.name)) for c in found)


def _laid_out(kind: Kind, law: StageLaw) -> Layout:
    """Parts: sample, target, output, memory, sequence, truth, lines, enable line."""
    recorded = [_only(each, kind.lines) for each in (Lines, Enable)]
    shown: tuple[Any, ...] = (Sample, Target, Output, law.memory, Inside, kind.truth, *recorded)
    if kind.corrected:
        shown = (*shown, Reading)
    return layout(*shown, place=kind.place)


def _only(kind: Any, names: tuple[str, ...]) -> Any:
    """A ``NamedTuple`` class of which only some fields are recorded."""
    hints = get_type_hints(kind, include_extras=True)
    return NamedTuple(kind.__name__, [(n, h if n in names else float) for n, h in hints.items()])


def _rows(stages: Stages, k: int) -> list[tuple[Any, Any]]:
    """Rows and scales of the parts of `_laid_out` of a stage."""
    index = {c.name: row for row, c in enumerate(columns(stages))}
    kind, law, name = stages.kinds[k], stages.laws[k], stages.names[k]
    before = f"{name}_" if name else ""
    named = [c.name for c in _columns(kind, law)]
    place = np.array([index[n if n in _SHARED else f"{before}{n}"] for n in named])
    parts = _laid_out(kind, law).parts
    return [(np.where(p.rows >= 0, place[p.rows], -1), p.scales) for p in parts]


@lru_cache(maxsize=64)
def period(stages: Stages, recorded: bool = True) -> Period:
    """The loop of a machine.

    ``run(bench, loops, state, noise, out, dt) -> (state, written)`` runs up to as many control
    periods as there are rows of noise, until the programme is done or a guard trips (that period is
    the last written), with `out` of shape (columns, periods). `loops` and `noise` have one entry a
    stage. Arrays of the state are changed in place; `fastest` leaves them as they are. Unless
    `recorded`, it writes only what a live machine looks at: efforts, lines, laws' own columns.
    """
    for kind, law in zip(stages.kinds, stages.laws, strict=True):
        joining.join(kind.measure, kind.advance, kind.show, law.step, kind.sense, kind.switch)
    seen, acted, advanced = (
        _reading_kernel(stages),
        _acting_kernel(stages),
        _advancing_kernel(stages),
    )
    placed, places, speeds = (
        _placing_kernel(stages),
        _each(stages, _position),
        _each(stages, _velocity),
    )
    follow = sequence.together(len(stages.kinds))
    ended = _recording_kernel(stages) if recorded else _looked_at(stages)
    record_extra = _recorded_extra(stages) if recorded else nothing

    def run(
        bench: Bench, loops: Any, state: Run, noise: Any, out: Array, dt: float
    ) -> tuple[Run, int]:
        params = bench.stages
        tick, progress, inside, parts = state.tick, state.progress, state.inside, state.parts
        written = 0
        for k in range(noise[0].shape[0]):
            t = tick * dt
            readings, lines = seen(params, parts, t, noise, k)
            samples = placed(loops, parts, readings, lines, places(readings))
            progress, inside, targets = follow(loops, progress, inside, samples)
            beside = Beside(places(targets), speeds(targets))
            shown = Seen(readings, samples, lines)
            acts, tripped = acted(loops, parts, targets, shown, beside, dt)
            enable = 0.0 if tripped else 1.0
            phase = float(FAULT if tripped else progress.phase)
            now = Inside(phase, float(progress.move), float(progress.arrived))
            period = Shared(t, tripped, now, Enable(enable))
            acts, truths = ended(out, k, period, params, parts, shown, targets, acts)
            record_extra(out, k, bench.extra, truths)
            parts = advanced(params, parts, acts, enable, noise, k, dt)
            tick += 1
            written += 1
            if progress.phase == DONE or tripped:
                break
        return Run(tick, progress, inside, parts), written

    return run


class Shared(NamedTuple):
    """What all stages have in common in a period."""

    t: float
    tripped: bool  # whether a guard has found a fault
    now: Inside
    enable: Enable


class Seen(NamedTuple):
    """What the stages show in a period, one entry a stage."""

    readings: Any  # of the sensors
    samples: Any  # the positions at these
    lines: Any


@kernel
def _rest(seen: Seen) -> Seen:
    """The same of the stages after the first."""
    return Seen(seen.readings[1:], seen.samples[1:], seen.lines[1:])


class Beside(NamedTuple):
    """Set points of all stages, for a correction of one by the place of another."""

    places: Any  # m
    speeds: Any  # m/s


def _reading_kernel(stages: Stages) -> Any:
    """The readings of the stages, and what their lines say."""

    def each(j: int, rest: Any) -> Any:
        measure, sense = stages.kinds[j].measure, stages.kinds[j].sense

        def seen(params: Any, parts: Any, t: float, noise: Any, k: int) -> Any:
            first = measure(params[0], parts[0].stage, t, noise[0], k)
            line = sense(params[0], parts[0].stage)
            samples, lines = rest(params[1:], parts[1:], t, noise[1:], k)
            return (first, *samples), (line, *lines)

        return seen

    return fold(each, len(stages.kinds), empty_pair)


@kernel
def _position(each: Any) -> Any:
    return each.position


@kernel
def _velocity(each: Any) -> Any:
    return each.velocity


def _each(stages: Stages, of: Any) -> Any:
    """A number of each stage, if any stage is corrected."""

    def each(j: int, rest: Any) -> Any:
        def numbers(values: Any) -> Any:
            return (of(values[0]), *rest(values[1:]))

        return numbers

    corrected = any(kind.corrected for kind in stages.kinds)
    return fold(each, len(stages.kinds) if corrected else 0, empty)


@kernel
def _uncorrected(loop: Any, part: Any, reading: Sample, lines: Lines, places: Any) -> Any:
    return reading


@kernel
def _corrected(loop: Any, part: Any, reading: Sample, lines: Lines, places: Any) -> Any:
    place = correction.position(
        loop.correction, part.flank, reading.position, places, lines.temperature, reading.t
    )
    return Sample(reading.t, place)


def _placing_kernel(stages: Stages) -> Any:
    """The positions at the readings."""

    def each(j: int, rest: Any) -> Any:
        correct = _corrected if stages.kinds[j].corrected else _uncorrected

        def placed(loops: Any, parts: Any, readings: Any, lines: Any, places: Any) -> Any:
            sample = correct(loops[0], parts[0], readings[0], lines[0], places)
            return (sample, *rest(loops[1:], parts[1:], readings[1:], lines[1:], places))

        return placed

    return fold(each, len(stages.kinds), empty)


@kernel
def _as_aimed(
    loop: Any, flank: Flank, target: Target, reading: Sample, lines: Lines, beside: Beside
) -> Any:
    return flank, target, 0.0


@kernel
def _aimed(
    loop: Any, flank: Flank, target: Target, reading: Sample, lines: Lines, beside: Beside
) -> Any:
    """Flank, set point of the reading, and the effort against what repeats."""
    flank, aim = correction.aimed(
        loop.correction, flank, target, beside.places, beside.speeds, lines.temperature, reading.t
    )
    push = correction.effort(loop.correction, flank, target, aim, reading.position, reading.t)
    return flank, aim, push


@kernel
def _unshifted(guard: Any, reading: Sample, sample: Sample) -> Any:
    return guard


@kernel
def _shifted(guard: Any, reading: Sample, sample: Sample) -> Any:
    """The guard's limits, of readings."""
    off = reading.position - sample.position
    return guarding.shifted(guard, 0.0 if math.isnan(off) else off)


def _acting_kernel(stages: Stages) -> Any:
    """Memory, watch, held, effort and flank of each stage, and whether a guard tripped."""

    def each(j: int, rest: Any) -> Any:
        step, corrected = stages.laws[j].step, stages.kinds[j].corrected
        aimed, shifted = (_aimed, _shifted) if corrected else (_as_aimed, _unshifted)
        watched, bounded = watching(stages.kinds[j])

        def acted(
            loops: Any, parts: Any, targets: Any, seen: Seen, beside: Beside, dt: float
        ) -> Any:
            loop, part, reading, line = loops[0], parts[0], seen.readings[0], seen.lines[0]
            flank, target, push = aimed(loop, part.flank, targets[0], reading, line, beside)
            memory, wanted = step(loop.gains, part.memory, target, reading, dt)
            if corrected:
                wanted = min(max(wanted + push, -loop.guard.effort), loop.guard.effort)
            watch, held, passed = watched(loop.wired, part.held, part.watch, line, reading, wanted)
            guard = shifted(bounded(loop.guard, loop.wired, held), reading, seen.samples[0])
            watch, effort = guarding.step(guard, watch, reading, target, passed)
            others, tripped = rest(loops[1:], parts[1:], targets[1:], _rest(seen), beside, dt)
            return ((memory, watch, held, effort, flank), *others), watch.fault != OK or tripped

        return acted

    return fold(each, len(stages.kinds), empty_and_false)


@kernel
def interlocked(watch: Watch, t: float) -> Watch:
    """A guard after the fault of any stage: its own fault stays."""
    if watch.fault != OK:
        return watch
    return latched(watch, OTHER_AXIS, 0.0, 0.0, t)


@kernel
def _switched_off(act: Any, period: Shared) -> Any:
    """An act after a fault of any stage, which switches all off in the same period."""
    memory, watch, held, effort, flank = act
    if period.tripped:
        return memory, interlocked(watch, period.t), held, 0.0, flank
    return memory, watch, held, effort, flank


def _recording_kernel(stages: Stages) -> Any:
    """The acts after faults and the truths of the stages, recorded."""

    def each(j: int, rest: Any) -> Any:
        tell, show = stages.laws[j].tell, stages.kinds[j].show
        sample, target, output, memory, inside, truth, lines, enable, *raw = _rows(stages, j)
        (sample_rows, sample_scales), (target_rows, target_scales) = sample, target
        (output_rows, output_scales), (memory_rows, memory_scales) = output, memory
        (inside_rows, inside_scales), (truth_rows, truth_scales) = inside, truth
        (line_rows, line_scales), (enable_rows, enable_scales) = lines, enable
        read = _recorded_reading(*raw[0]) if raw else nothing

        def recorded(
            out: Any, k: int, period: Shared, params: Any, parts: Any, seen: Seen, targets: Any,
            acts: Any,
        ) -> Any:  # fmt: skip
            act = _switched_off(acts[0], period)
            real = show(params[0], parts[0].stage)
            put(out, k, seen.samples[0], sample_rows, sample_scales)
            put(out, k, targets[0], target_rows, target_scales)
            put(out, k, Output(act[3]), output_rows, output_scales)
            put(out, k, tell(act[0]), memory_rows, memory_scales)
            put(out, k, period.now, inside_rows, inside_scales)
            put(out, k, real, truth_rows, truth_scales)
            put(out, k, seen.lines[0], line_rows, line_scales)
            put(out, k, period.enable, enable_rows, enable_scales)
            read(out, k, seen.readings[0], act[4])
            others, truths = rest(
                out, k, period, params[1:], parts[1:], _rest(seen), targets[1:], acts[1:]
            )
            return (act, *others), (real, *truths)

        return recorded

    return fold(each, len(stages.kinds), empty_pair)


def _recorded_reading(rows: Any, scales: Any) -> Any:
    def recorded(out: Any, k: int, reading: Sample, flank: Flank) -> None:
        share = correction.share_at(flank, reading.t)
        put(out, k, Reading(reading.position, share), rows, scales)

    return kernel(recorded)


def _looked_at(stages: Stages) -> Any:
    """`_recorded` of what a live machine looks at, in the same rows."""
    own = law_columns(stages)

    def each(j: int, rest: Any) -> Any:
        tell, lined = stages.laws[j].tell, bool(stages.kinds[j].lines)
        _, _, output, memory, _, _, lines, *_ = _rows(stages, j)

        def looked_at(
            out: Any, k: int, period: Shared, params: Any, parts: Any, seen: Seen, targets: Any,
            acts: Any,
        ) -> Any:  # fmt: skip
            act = _switched_off(acts[0], period)
            put(out, k, Output(act[3]), *output)
            if own:
                put(out, k, tell(act[0]), *memory)
            if lined:
                put(out, k, seen.lines[0], *lines)
            others, _ = rest(out, k, period, params, parts, _rest(seen), targets, acts[1:])
            return (act, *others), ()

        return looked_at

    return fold(each, len(stages.kinds), empty_pair)


def _recorded_extra(stages: Stages) -> Any:
    if stages.extra is None:
        return nothing
    show = stages.extra.show
    rows, scales = layout(Clock, Inside, stages.extra.truth).parts[2]

    def recorded(out: Any, k: int, params: Any, truths: Any) -> None:
        put(out, k, show(params, truths), rows, scales)

    return kernel(recorded)


def _advancing_kernel(stages: Stages) -> Any:
    def each(j: int, rest: Any) -> Any:
        advance, switch = stages.kinds[j].advance, stages.kinds[j].switch

        def advanced(
            params: Any, parts: Any, acts: Any, enable: float, noise: Any, k: int, dt: float
        ) -> Any:
            memory, watch, held, effort, flank = acts[0]
            switched = switch(params[0], parts[0].stage, enable)
            stage = advance(params[0], switched, effort, noise[0], k, dt)
            others = rest(params[1:], parts[1:], acts[1:], enable, noise[1:], k, dt)
            return (Part(stage, memory, watch, held, flank), *others)

        return advanced

    return fold(each, len(stages.kinds), empty)


def fastest(stages: Stages) -> Period:
    """The loop of a machine, as fast as it can run, on a copy of the state that it is given."""
    run = in_place(stages)

    def apart(bench: Bench, loops: Any, state: Run, noise: Any, out: Array, dt: float) -> Any:
        return run(bench, loops, arrays.own(state), noise, out, dt)

    return apart


def quickest(stages: Stages, periods: float) -> Period:
    """`fastest`, or interpreted where a run of so many periods is over sooner: the same bits."""
    if not all(map(compiles, stages.laws)):
        return fastest(stages)
    chosen: Period | None = None

    def run(bench: Bench, loops: Any, state: Run, noise: Any, out: Array, dt: float) -> Any:
        nonlocal chosen
        given = (bench, loops, arrays.own(state), noise, out, dt)
        if chosen is None:
            chosen = interpreting.quickest(period(stages), periods, *given)
        return chosen(*given)

    return run


def in_place(stages: Stages) -> Period:
    """`fastest` that may change the state given to it; a law in plain Python runs interpreted."""
    if all(map(compiles, stages.laws)):
        return compiled(period(stages))
    return period(stages._replace(kinds=tuple(map(quick, stages.kinds))))


def beginning(stages: Stages, bench: Bench, loops: Any) -> Run:
    """The state at the start of a run: at rest at the plans' origins."""
    parts = []
    for kind, law, params, loop in zip(stages.kinds, stages.laws, bench.stages, loops, strict=True):
        memory = law.start(loop.gains, Sample(0.0, loop.plan.origin))
        parts.append(Part(kind.initial(params), memory, guarding.fresh(), Held(), Flank()))
    blank = (math.nan,) * len(parts)
    return Run(0, sequence.begin(), blank, tuple(parts))
