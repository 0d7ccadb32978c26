"""The law of the micro-stage: the PI of the thesis, or one by the contract of `stage_law`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from macromicro.arrays import Array
from macromicro.columns import Column, layout
from macromicro.control import outside, pi
from macromicro.control.outside import FRESH, Held, Kept
from macromicro.control.pi import PiAntiWindup
from macromicro.control.stage_law import Sample, StageLaw, Target
from macromicro.kernel import by_type

PREFIX = "micro_law_"


def prepare(gains: Any) -> tuple[Any, ...]:
    if not outside.of(gains):
        return ()
    return (outside.arguments(outside.law_of_gains(gains), gains),)


def begin(own: tuple[Any, ...]) -> Kept:
    found = []
    for each in own:
        law = outside.law_of_gains(each)
        if law.rest is not None:
            found.append(Held(0.0, law.start(each, Sample(0.0, float("nan")))))
        else:
            found.append(Held(FRESH, law.memory(*[0.0] * len(law.memory._fields))))
    return tuple(found)


def _law(own: Any) -> StageLaw:
    """The type of a tuple of one for the compiler."""
    return outside.law_of_type(own[0].instance_class)


def _step(
    p: Any, own: Any, kept: Any, integral: Any, target: Any, sample: Any, dt: Any
) -> Callable[..., Any]:
    if len(own) == 0:

        def plain(
            p: PiAntiWindup,
            own: tuple[Any, ...],
            kept: Kept,
            integral: float,
            target: Target,
            sample: Sample,
            dt: float,
        ) -> tuple[float, Kept, float]:
            integral, effort = pi.step(p, integral, target.position - sample.position, dt)
            return integral, kept, effort

        return plain
    law = _law(own)
    one, start = law.step, law.start
    if law.rest is not None:

        def going(
            p: PiAntiWindup,
            own: tuple[Any, ...],
            kept: Kept,
            integral: float,
            target: Target,
            sample: Sample,
            dt: float,
        ) -> tuple[float, Kept, float]:
            memory, effort = one(own[0], kept[0].memory, target, sample, dt)
            return 0.0, (Held(0.0, memory),), min(max(effort, p.low), p.high)

        return going

    def chosen(
        p: PiAntiWindup,
        own: tuple[Any, ...],
        kept: Kept,
        integral: float,
        target: Target,
        sample: Sample,
        dt: float,
    ) -> tuple[float, Kept, float]:
        memory = kept[0].memory
        if kept[0].fresh == FRESH:
            memory = start(own[0], sample)
        memory, effort = one(own[0], memory, target, sample, dt)
        return 0.0, (Held(0.0, memory),), min(max(effort, p.low), p.high)

    return chosen


@by_type(_step)
def step(
    p: PiAntiWindup,
    own: tuple[Any, ...],
    kept: Kept,
    integral: float,
    target: Target,
    sample: Sample,
    dt: float,
) -> tuple[float, Kept, float]:
    if not own:
        integral, effort = pi.step(p, integral, target.position - sample.position, dt)
        return integral, kept, effort
    law = outside.law_of_gains(own[0])
    memory = kept[0].memory
    if kept[0].fresh == FRESH:
        memory = law.start(own[0], sample)
    memory, effort = law.step(own[0], memory, target, sample, dt)
    return 0.0, (Held(0.0, memory),), min(max(effort, p.low), p.high)


def _rest(own: Any, kept: Any, sample: Any, dt: Any) -> Callable[..., Any]:
    if len(own) == 0:
        return lambda own, kept, sample, dt: kept
    law = _law(own)
    if law.rest is None:
        return lambda own, kept, sample, dt: (Held(FRESH, kept[0].memory),)
    one = law.rest
    return lambda own, kept, sample, dt: (Held(0.0, one(own[0], kept[0].memory, sample, dt)),)


@by_type(_rest)
def rest(own: tuple[Any, ...], kept: Kept, sample: Sample, dt: float) -> Kept:
    """A period without a turn of the micro-stage."""
    if not own:
        return kept
    law = outside.law_of_gains(own[0])
    if law.rest is None:
        return (Held(FRESH, kept[0].memory),)
    return (Held(0.0, law.rest(own[0], kept[0].memory, sample, dt)),)


def columns(own: tuple[Any, ...]) -> tuple[Column, ...]:
    found = [c for each in own for c in layout(outside.law_of_gains(each).memory).columns]
    return tuple(c._replace(name=f"{PREFIX}{c.name}", dtype="f8") for c in found)


def _note(out: Any, k: Any, own: Any, kept: Any, first: Any) -> Callable[..., Any]:
    if len(own) == 0:
        return lambda out, k, own, kept, first: None
    law = _law(own)
    (part,) = layout(law.memory).parts
    rows, scales = part
    tell = law.tell

    def noted(out: Array, k: int, own: tuple[Any, ...], kept: Kept, first: int) -> None:
        told = tell(kept[0].memory)
        for j in range(len(told)):
            if rows[j] >= 0:
                out[first + rows[j], k] = scales[j] * told[j]

    return noted


@by_type(_note)
def note(out: Array, k: int, own: tuple[Any, ...], kept: Kept, first: int) -> None:
    """Write the recorded part of a law's memory into a block."""
    for each, held in zip(own, kept, strict=True):
        law = outside.law_of_gains(each)
        (part,) = layout(law.memory).parts
        for row, scale, value in zip(*part, law.tell(held.memory), strict=True):
            if row >= 0:
                out[first + row, k] = scale * value
