"""The guard of one stage: what is out of bounds is switched off, and stays off."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.control.arrival import TICK
from macromicro.control.stage_law import Sample, Target
from macromicro.kernel import kernel
from macromicro.machines.guard_words import (
    FAST,
    HIGH,
    ILLEGAL,
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


class Watch(NamedTuple):
    """State of the guard.

    Attributes
    ----------
    fault : int
        One of the codes; OK: none.
    value, limit : float
        What was measured at the fault, and its limit: V, s, m or m/s.
    time : float
        When, s.
    heard : float
        Time of the last reading, s; NaN: none yet.
    place : float
        That reading, m.
    since : float
        When the speed's window began, s; NaN: it has not.
    there : float
        Where, m.
    pushed : float
        Since when it is pushed and stands, s; NaN: it is not.
    stood : float
        Where, m.
    """

    fault: int
    value: float
    limit: float
    time: float
    heard: float
    place: float
    since: float
    there: float
    pushed: float
    stood: float


def fresh() -> Watch:
    """The guard at the start.

    Returns
    -------
    Watch
        Nothing seen yet, all well.
    """
    nan = math.nan
    return Watch(OK, 0.0, 0.0, 0.0, nan, nan, nan, nan, nan, nan)


@kernel
def _judged(
    p: Limits, s: Watch, target: Target, effort: float, speed: float, t: float
) -> tuple[int, float, float]:
    """Fault, value and limit of this period; `s` has seen it already."""
    error = abs(target.position - s.place)
    fault, value, limit = OK, 0.0, 0.0
    if not abs(effort) <= p.effort:
        fault, value, limit = ILLEGAL, effort, p.effort
    elif t - s.heard > p.silent + TICK:
        fault, value, limit = SILENT, t - s.heard, p.silent
    elif s.place < p.low:
        fault, value, limit = LOW, s.place, p.low
    elif s.place > p.high:
        fault, value, limit = HIGH, s.place, p.high
    elif speed > p.speed:
        fault, value, limit = FAST, speed, p.speed
    elif error > p.error:
        fault, value, limit = LOST, error, p.error
    elif t - s.pushed > p.stuck + TICK:
        fault, value, limit = STUCK, effort, p.stuck
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
    if s.fault != OK:
        return s, 0.0
    t = sample.t
    heard, place = s.heard, s.place
    if math.isnan(heard):
        heard = t
    since, there, speed = s.since, s.there, 0.0
    pushed, stood = s.pushed, s.stood
    if not math.isnan(sample.position):
        heard, place = t, sample.position
        if math.isnan(since):
            since, there = t, place
        if t - since >= p.window - TICK:
            speed = abs(place - there) / (t - since)
            since, there = t, place
        if abs(effort) <= p.push or place != stood:
            pushed, stood = t, place
    elif abs(effort) <= p.push:
        pushed = t
    if math.isnan(pushed):
        pushed = t
    seen = Watch(OK, 0.0, 0.0, 0.0, heard, place, since, there, pushed, stood)
    fault, value, limit = _judged(p, seen, target, effort, speed, t)
    if fault == OK:
        return seen, effort
    return Watch(fault, value, limit, t, heard, place, since, there, pushed, stood), 0.0


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
