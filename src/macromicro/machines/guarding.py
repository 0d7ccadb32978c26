"""The guard of one stage: a violation switches it off for good."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.columns import Meaning
from macromicro.control.arrival import TICK
from macromicro.control.stage_law import Sample, Target
from macromicro.kernel import kernel
from macromicro.machines.guard_words import (
    AGAINST,
    CLOCK,
    FAST,
    FROZEN,
    HIGH,
    HOT,
    ILLEGAL,
    JUMP,
    KEEPS_PLACE,
    LOST,
    LOW,
    OK,
    SILENT,
    STUCK,
    TEXTS,
)
from macromicro.place import LENGTH, Place
from macromicro.rig.faults import SWITCHED_OFF, Fault
from macromicro.schema.par import Par

__all__ = ["FAST", "HIGH", "ILLEGAL", "LOST", "LOW", "OK", "SILENT", "STUCK", "TEXTS"]
_DERIVED = "derived from the data sheets"
_NOT = "; 0: not watched"
STANDS = 20.0  # periods in which a clock that runs shows a later time


class Limits(NamedTuple):
    effort: Annotated[float, Par("V", "maximum effort at the D/A", _DERIVED, positive=True)] = 10.0
    low: Annotated[float, Par("m", "soft limit", _DERIVED, shown="mm")] = -0.01
    high: Annotated[float, Par("m", "soft limit", _DERIVED, shown="mm")] = 0.31
    speed: Annotated[float, Par("m/s", "maximum speed", _DERIVED, positive=True)] = 1.0
    window: Annotated[
        float, Par("s", "time over which the speed is measured", _DERIVED, positive=True)
    ] = 0.01
    error: Annotated[
        float, Par("m", "maximum following error", _DERIVED, shown="mm", positive=True)
    ] = 5.0e-3
    silent: Annotated[
        float, Par("s", "longest time without a new reading", "machine choice", positive=True)
    ] = 0.02
    push: Annotated[
        float, Par("V", "effort under which the stage must move", _DERIVED, positive=True)
    ] = 5.0
    stuck: Annotated[
        float, Par("s", "longest time in which it may stand still", "machine choice", positive=True)
    ] = 0.3
    lean: Annotated[
        float, Par("V", f"effort under which a free stage moves{_NOT}", _DERIVED, lo=0.0)
    ] = 0.0
    leant: Annotated[
        float, Par("s", "longest time under this effort without motion", _DERIVED, positive=True)
    ] = 0.5
    still: Annotated[
        float,
        Par("m", "motion below which the stage counts as standing", _DERIVED, shown="um", lo=0.0),
    ] = 0.0
    against: Annotated[
        float,
        Par("m", f"longest travel against such an effort{_NOT}", _DERIVED, shown="mm", lo=0.0),
    ] = 0.0
    leap: Annotated[
        float, Par("m/s", f"speed beyond which a reading is wrong{_NOT}", _DERIVED, lo=0.0)
    ] = 0.0
    surge: Annotated[
        float,
        Par("m/s^2", f"acceleration beyond which a reading is wrong{_NOT}", _DERIVED, lo=0.0),
    ] = 0.0
    clock: Annotated[
        float,
        Par(
            "s",
            "longest step of the rig's time between two periods",
            "machine choice",
            positive=True,
        ),
    ] = 0.5
    repeats: Annotated[
        float, Par("s", f"longest time that a noisy sensor repeats one value{_NOT}", _DERIVED, lo=0)
    ] = 0.0
    heat: Annotated[float, Par("V", f"greatest mean effort{_NOT}", _DERIVED, lo=0.0)] = 0.0
    heating: Annotated[float, Par("s", "time constant of that mean", _DERIVED, positive=True)] = 1.0


class Watch(NamedTuple):
    """State of the guard; NaN: has not happened."""

    fault: Annotated[int, Meaning("one of the codes; OK: none")]
    value: Annotated[float, Meaning("measured at the fault: V, s, m or m/s")]
    limit: Annotated[float, Meaning("its limit")]
    time: Annotated[float, Meaning("when", "s")]
    heard: Annotated[float, Meaning("time of the last reading", "s")]
    place: Annotated[float, Meaning("that reading", "m")]
    since: Annotated[float, Meaning("when the speed's window began", "s")]
    there: Annotated[float, Meaning("and where", "m")]
    pushed: Annotated[float, Meaning("since when it is pushed and stands", "s")]
    stood: Annotated[float, Meaning("where", "m")]
    leaned: Annotated[
        float, Meaning("since when it stands under an effort that moves a free stage", "s")
    ]
    against: Annotated[float, Meaning("travel against such an effort, with the effort's sign", "m")]
    repeated: Annotated[float, Meaning("since when the sensor repeats one value", "s")]
    mean: Annotated[float, Meaning("mean effort", "V")]
    then: Annotated[float, Meaning("time of the last period", "s")]
    rate: Annotated[float, Meaning("speed between the last two readings", "m/s")]
    stopped: Annotated[float, Meaning("periods without a later time")]
    missed: Annotated[
        float, Meaning("1: a reading failed or was impossible while a fault was latched")
    ]


def fresh() -> Watch:
    nan = math.nan
    return Watch(
        OK, 0.0, 0.0, 0.0, nan, nan, nan, nan, nan, nan, nan, 0.0, nan, 0.0, nan, 0.0, 0.0, 0.0
    )  # fmt: skip


def cleared(watch: Watch) -> Watch:
    return fresh()._replace(
        heard=watch.heard,
        place=watch.place,
        repeated=watch.repeated,
        mean=watch.mean,
        then=watch.then,
    )


def blind(watch: Watch) -> bool:
    """Whether the position may be wrong since the fault."""
    return watch.fault not in KEEPS_PLACE


def leaning(watch: Watch) -> float:
    """How long the stage has stood under an effort that moves a free stage."""
    found = watch.then - watch.leaned
    return 0.0 if math.isnan(found) else found


@kernel
def latched(s: Watch, fault: int, value: float, limit: float, t: float) -> Watch:
    return Watch(
        fault, value, limit, t, s.heard, s.place, s.since, s.there, s.pushed, s.stood,
        s.leaned, s.against, s.repeated, s.mean, s.then, s.rate, s.stopped, s.missed,
    )  # fmt: skip


@kernel
def slower(p: Limits, speed: float) -> Limits:
    """Limits with a lower speed."""
    return Limits(
        p.effort, p.low, p.high, min(p.speed, speed), p.window, p.error, p.silent, p.push,
        p.stuck, p.lean, p.leant, p.still, p.against, p.leap, p.surge, p.clock, p.repeats, p.heat,
        p.heating,
    )  # fmt: skip


@kernel
def shifted(p: Limits, by: float) -> Limits:
    """Limits for readings that are off the position by a distance."""
    return Limits(
        p.effort, p.low + by, p.high + by, p.speed, p.window, p.error, p.silent, p.push,
        p.stuck, p.lean, p.leant, p.still, p.against, p.leap, p.surge, p.clock, p.repeats, p.heat,
        p.heating,
    )  # fmt: skip


@kernel
def _against(p: Limits, before: float, moved: float, effort: float) -> float:
    """Distance against pushes of one sign, reset by motion along one."""
    if p.lean <= 0.0:
        return 0.0
    if effort >= p.lean and moved <= 0.0:
        return max(before, 0.0) - moved
    if effort <= -p.lean and moved >= 0.0:
        return min(before, 0.0) - moved
    return 0.0


@kernel
def _possible(p: Limits, rate: float, h: float) -> float:
    """The greatest plausible change of a reading after a time `h` at a speed `rate`."""
    way = p.leap * h
    if p.surge > 0.0:
        way = min(way, 2.0 * rate * h + p.surge * h * h)
    return way + p.still


@kernel
def _seen(p: Limits, s: Watch, sample: Sample, effort: float) -> tuple[Watch, float, float]:
    """The state after a sample, the speed, and the excess of the reading's jump."""
    t, h = sample.t, sample.t - s.then
    stopped = s.stopped + 1.0 if h == 0.0 or math.isnan(t) else 0.0
    then = s.then if math.isnan(t) else t
    if math.isnan(h):
        h = 0.0
    mean = s.mean + (abs(effort) - s.mean) * min(max(h, 0.0) / p.heating, 1.0)
    heard, place = s.heard, s.place
    if math.isnan(heard):
        heard = t
    since, there, speed, leap = s.since, s.there, 0.0, 0.0
    pushed, stood, leaned, against = s.pushed, s.stood, s.leaned, s.against
    repeated, rate = s.repeated, s.rate
    if not math.isnan(sample.position):
        moved = sample.position - place
        if math.isnan(moved):
            moved = 0.0
        if abs(moved) > _possible(p, rate, t - heard):
            leap = abs(moved)
        rate = abs(moved) / max(t - heard, 1e-9)
        if moved != 0.0 or math.isnan(repeated):
            repeated = t
        against = _against(p, against, moved, effort)
        heard, place = t, sample.position
        if math.isnan(since):
            since, there = t, place
        if t - since >= p.window - TICK:
            speed = abs(place - there) / (t - since)
            since, there = t, place
        if math.isnan(stood) or abs(place - stood) > p.still:
            pushed, leaned, stood = t, t, place
    if abs(effort) <= p.push or math.isnan(pushed):
        pushed = t
    if p.lean <= 0.0 or abs(effort) < p.lean or math.isnan(leaned):
        leaned = t
    seen = Watch(
        s.fault, s.value, s.limit, s.time, heard, place, since, there, pushed, stood,
        leaned, against, repeated, mean, then, rate, stopped, s.missed,
    )  # fmt: skip
    return seen, speed, leap


@kernel
def _sensed(p: Limits, s: Watch, leap: float, h: float, t: float) -> tuple[int, float, float]:
    """Fault of the clock or the sensor, with value and limit; it ends trust even when disabled."""
    fault, value, limit = OK, 0.0, 0.0
    if h < 0.0 or h > p.clock:
        fault, value, limit = CLOCK, h, p.clock
    elif s.stopped >= STANDS:
        fault, value, limit = CLOCK, 0.0, p.clock
    elif t - s.heard > p.silent + TICK:
        fault, value, limit = SILENT, t - s.heard, p.silent
    elif p.leap > 0.0 and leap > 0.0:
        fault, value, limit = JUMP, leap, p.leap
    elif p.repeats > 0.0 and t - s.repeated > p.repeats + TICK:
        fault, value, limit = FROZEN, t - s.repeated, p.repeats
    return fault, value, limit


@kernel
def _judged(
    p: Limits, s: Watch, target: Target, effort: float, speed: float
) -> tuple[int, float, float]:
    """Fault of stage or law, value and limit; `s` includes this period."""
    error, t = abs(target.position - s.place), s.then
    fault, value, limit = OK, 0.0, 0.0
    if s.place < p.low:
        fault, value, limit = LOW, s.place, p.low
    elif s.place > p.high:
        fault, value, limit = HIGH, s.place, p.high
    elif speed > p.speed:
        fault, value, limit = FAST, speed, p.speed
    elif error > p.error:
        fault, value, limit = LOST, error, p.error
    elif t - s.pushed > p.stuck + TICK:
        fault, value, limit = STUCK, effort, p.stuck
    elif t - s.leaned > p.leant + TICK:
        fault, value, limit = STUCK, effort, p.leant
    elif p.against > 0.0 and abs(s.against) > p.against:
        fault, value, limit = AGAINST, abs(s.against), p.against
    elif p.heat > 0.0 and s.mean > p.heat:
        fault, value, limit = HOT, s.mean, p.heat
    return fault, value, limit


@kernel
def step(
    p: Limits,
    s: Watch,
    sample: Sample,
    target: Target,
    effort: Annotated[float, Meaning("what the law wants", "V")],
) -> tuple[
    Annotated[Watch, Meaning(name="watch")],
    Annotated[float, Meaning("as wanted, or 0", "V", name="effort")],
]:
    t = sample.t
    if s.fault != OK:
        return off(p, s, sample), 0.0
    seen, speed, leap = _seen(p, s, sample, effort)
    if not abs(effort) <= p.effort:
        return latched(seen, ILLEGAL, effort, p.effort, t), 0.0
    fault, value, limit = _sensed(p, seen, leap, t - s.then, t)
    if fault == OK:
        fault, value, limit = _judged(p, seen, target, effort, speed)
    if fault == OK:
        return seen, effort
    return latched(seen, fault, value, limit, t), 0.0


@kernel
def off(p: Limits, s: Watch, sample: Sample) -> Watch:
    """One period without drive: only the sensor is watched."""
    seen, _, leap = _seen(p, s, sample, 0.0)
    fault, value, limit = _sensed(p, seen, leap, sample.t - s.then, sample.t)
    if fault == OK:
        return seen
    if s.fault == OK:
        return latched(seen, fault, value, limit, sample.t)
    return Watch(
        seen.fault, seen.value, seen.limit, seen.time, seen.heard, seen.place, seen.since,
        seen.there, seen.pushed, seen.stood, seen.leaned, seen.against, seen.repeated,
        seen.mean, seen.then, seen.rate, seen.stopped, 1.0,
    )  # fmt: skip


def describe(watch: Watch, place: Place = LENGTH) -> Fault | None:
    if watch.fault == OK:
        return None
    text = TEXTS[watch.fault]
    scale = place.per if text.placed else 1.0
    evidence = text.evidence.format(
        value=watch.value * scale, limit=watch.limit * scale, unit=place.unit
    )
    return Fault(
        watch.fault,
        text.name,
        round(watch.time, 9),
        text.message,
        f"{evidence}, at {watch.time:.4f} s; {SWITCHED_OFF}",
        text.remedy,
    )
