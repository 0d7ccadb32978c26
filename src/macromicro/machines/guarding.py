"""The guard of one stage: what is out of bounds is switched off, and stays off."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

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
    """What the guard allows."""

    effort: Annotated[float, Par("V", "greatest effort at the D/A", _DERIVED, positive=True)] = 10.0
    low: Annotated[float, Par("m", "soft limit", _DERIVED, shown="mm")] = -0.01
    high: Annotated[float, Par("m", "soft limit", _DERIVED, shown="mm")] = 0.31
    speed: Annotated[float, Par("m/s", "greatest speed", _DERIVED, positive=True)] = 1.0
    window: Annotated[
        float, Par("s", "time over which the speed is measured", _DERIVED, positive=True)
    ] = 0.01
    error: Annotated[
        float, Par("m", "greatest following error", _DERIVED, shown="mm", positive=True)
    ] = 5.0e-3
    silent: Annotated[
        float, Par("s", "longest time without a new reading", "machine choice", positive=True)
    ] = 0.02
    push: Annotated[
        float, Par("V", "effort under which the stage must move", _DERIVED, positive=True)
    ] = 5.0
    stuck: Annotated[
        float, Par("s", "longest time that it may not", "machine choice", positive=True)
    ] = 0.3
    lean: Annotated[
        float, Par("V", f"effort under which a free stage moves{_NOT}", _DERIVED, lo=0.0)
    ] = 0.0
    leant: Annotated[
        float, Par("s", "longest time under it without motion", _DERIVED, positive=True)
    ] = 0.5
    still: Annotated[
        float, Par("m", "way that counts as no motion", _DERIVED, shown="um", lo=0.0)
    ] = 0.0
    against: Annotated[
        float,
        Par("m", f"farthest way against such an effort{_NOT}", _DERIVED, shown="mm", lo=0.0),
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
    """State of the guard; times in s, NaN for what has not happened."""

    fault: int  # one of the codes; OK: none
    value: float  # measured at the fault: V, s, m or m/s
    limit: float  # its limit
    time: float  # when
    heard: float  # time of the last reading
    place: float  # that reading, m
    since: float  # when the speed's window began
    there: float  # and where, m
    pushed: float  # since when it is pushed and stands
    stood: float  # where, m
    leaned: float  # since when it stands under an effort that moves a free stage
    against: float  # way against such an effort, with the effort's sign, m
    repeated: float  # since when the sensor repeats one value
    mean: float  # mean effort, V
    then: float  # time of the last period
    rate: float  # speed between the last two readings, m/s
    stopped: float  # periods without a later time
    missed: float  # 1: a reading failed or was impossible while a fault was latched


def fresh() -> Watch:
    """The guard at the start.

    Returns
    -------
    Watch
        Nothing seen yet, all well.
    """
    nan = math.nan
    return Watch(
        OK, 0.0, 0.0, 0.0, nan, nan, nan, nan, nan, nan, nan, 0.0, nan, 0.0, nan, 0.0, 0.0, 0.0
    )  # fmt: skip


def cleared(watch: Watch) -> Watch:
    """The guard after its fault was cleared.

    Parameters
    ----------
    watch : Watch
        State with the fault.

    Returns
    -------
    Watch
        Heat and the last reading stay: a jump from there is one, and a sensor that is silent or
        frozen is so at once.
    """
    return fresh()._replace(
        heard=watch.heard,
        place=watch.place,
        repeated=watch.repeated,
        mean=watch.mean,
        then=watch.then,
    )


def blind(watch: Watch) -> bool:
    """Whether the position may be wrong since the fault.

    Parameters
    ----------
    watch : Watch
        State with the fault.

    Returns
    -------
    bool
        False for faults that have nothing to do with motion or its sensor.
    """
    return watch.fault not in KEEPS_PLACE


def leaning(watch: Watch) -> float:
    """For how long the stage has stood under an effort that moves a free stage.

    Parameters
    ----------
    watch : Watch
        State of the guard.

    Returns
    -------
    float
        s; 0 while it moves or is not pushed.
    """
    found = watch.then - watch.leaned
    return 0.0 if math.isnan(found) else found


@kernel
def latched(s: Watch, fault: int, value: float, limit: float, t: float) -> Watch:
    """The guard's state with a fault.

    Parameters
    ----------
    s : Watch
        State.
    fault : int
        One of the codes.
    value, limit : float
        What was measured, and its limit.
    t : float
        Now, s.

    Returns
    -------
    Watch
        The same otherwise.
    """
    return Watch(
        fault, value, limit, t, s.heard, s.place, s.since, s.there, s.pushed, s.stood,
        s.leaned, s.against, s.repeated, s.mean, s.then, s.rate, s.stopped, s.missed,
    )  # fmt: skip


@kernel
def slower(p: Limits, speed: float) -> Limits:
    """Limits with a speed that is at most so much.

    Parameters
    ----------
    p : Limits
        What is allowed.
    speed : float
        m/s.

    Returns
    -------
    Limits
        The same otherwise.
    """
    return Limits(
        p.effort, p.low, p.high, min(p.speed, speed), p.window, p.error, p.silent, p.push,
        p.stuck, p.lean, p.leant, p.still, p.against, p.leap, p.surge, p.clock, p.repeats, p.heat,
        p.heating,
    )  # fmt: skip


@kernel
def _against(p: Limits, before: float, moved: float, effort: float) -> float:
    """Way against pushes of one sign; none once the stage goes along with one."""
    if p.lean <= 0.0:
        return 0.0
    if effort >= p.lean and moved <= 0.0:
        return max(before, 0.0) - moved
    if effort <= -p.lean and moved >= 0.0:
        return min(before, 0.0) - moved
    return 0.0


@kernel
def _possible(p: Limits, rate: float, h: float) -> float:
    """How far a reading can be from the one before, a time `h` ago, after a speed `rate`: what can
    come to that speed, which jitter blurs."""
    way = p.leap * h
    if p.surge > 0.0:
        way = min(way, 2.0 * rate * h + p.surge * h * h)
    return way + p.still


@kernel
def _seen(p: Limits, s: Watch, sample: Sample, effort: float) -> tuple[Watch, float, float]:
    """The state after a sample, the speed, and by how much the reading leapt."""
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
    """Fault of the clock or the position sensor a time `h` after the last period, value and limit:
    these end trust even while all is off."""
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
    """Fault of stage or law, value and limit; `s` has seen this period already."""
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
def step(p: Limits, s: Watch, sample: Sample, target: Target, effort: float) -> tuple[Watch, float]:
    """One control period of the guard.

    Parameters
    ----------
    p : Limits
        What is allowed.
    s : Watch
        State.
    sample : Sample
        What the stage shows.
    target : Target
        Where it is to be.
    effort : float
        What the law wants, V.

    Returns
    -------
    watch : Watch
        New state; a fault in it stays.
    effort : float
        V: as wanted, or 0.
    """
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
    """One control period in which nothing is driven: only the sensor is watched.

    Parameters
    ----------
    p : Limits
        What is allowed.
    s : Watch
        State.
    sample : Sample
        What the stage shows.

    Returns
    -------
    Watch
        New state. A fault that is latched stays, and `missed` tells whether the sensor failed
        meanwhile.
    """
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
    """The fault of a guard's state.

    Parameters
    ----------
    watch : Watch
        The state.
    place : Place, optional
        What the stage's places are counted in.

    Returns
    -------
    Fault | None
        In words; None if all is well.
    """
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
