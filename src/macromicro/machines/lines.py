"""Guard of a stage's limit switches, drive fault and enable line."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

from macromicro.columns import Meaning
from macromicro.control.arrival import TICK
from macromicro.control.stage_law import Sample
from macromicro.kernel import kernel
from macromicro.machines.guard_words import (
    DRIVE,
    LIMIT_HIGH,
    LIMIT_LOW,
    LIMITS,
    NOT_ENABLED,
    OK,
)
from macromicro.machines.guarding import Limits, Watch, latched, slower
from macromicro.types import QUIET, Enable, Lines

SLACK = 2.0  # times the speed off a limit switch that the guard allows
SHARE = 0.1  # of the greatest speed, off a limit switch where no setting says it


class Wired(NamedTuple):
    """Limits of the lines, beside `Limits`."""

    leave: Annotated[float, Meaning("greatest speed while a limit switch is tripped", "m/s")] = (
        math.inf
    )
    rise: Annotated[float, Meaning("longest time until the drive is on", "s")] = 0.0
    homing: Annotated[int, Meaning("1: the lower limit switch is looked for, and is no fault")] = 0


class Held(NamedTuple):
    began: Annotated[float, Meaning("when it began to watch; NaN: it has not", "s")] = math.nan
    low: Annotated[
        float, Meaning("1 while the stage still stands on a limit switch that was tripped then")
    ] = 0.0
    high: Annotated[
        float, Meaning("1 while the stage still stands on a limit switch that was tripped then")
    ] = 0.0


def wiring(settings: Any) -> Wired:
    return Wired(SLACK * leaving(settings), rise(settings))


def leaving(settings: Any) -> float:
    switches = getattr(settings, "switches", None)
    return float(SHARE * settings.motion.velocity if switches is None else switches.leave)


def rise(settings: Any) -> float:
    """Time from the enable line until the drive gives current."""
    return float(getattr(getattr(settings, "amplifier", None), "enable_time", 0.0))


@kernel
def none(params: Any, state: Any) -> Lines:
    return Lines(0.0, 0.0, 0.0, math.nan, 0.0, 1.0, math.nan)


@kernel
def as_it_is(params: Any, state: Any, enable: float) -> Any:
    return state


@kernel
def unwatched(
    p: Wired, s: Held, watch: Watch, lines: Lines, sample: Sample, effort: float
) -> tuple[Watch, Held, float]:
    """`step` of a stage without lines."""
    return watch, s, effort


@kernel
def step(
    p: Wired,
    s: Held,
    watch: Watch,
    lines: Lines,
    sample: Sample,
    effort: Annotated[float, Meaning("what the law wants", "V")],
) -> tuple[
    Annotated[Watch, Meaning(name="watch")],
    Annotated[Held, Meaning(name="held")],
    Annotated[float, Meaning("not towards a tripped limit switch", "V", name="effort")],
]:
    """One control period of the lines' guard, before that of the stage.

    A limit switch that trips is a fault; one that was tripped at the start only blocks motion
    towards it until it releases.
    """
    if watch.fault != OK:
        return watch, s, 0.0
    began = s.began
    low, high = lines.limit_low != 0.0, lines.limit_high != 0.0
    on_low, on_high = low and s.low > 0.5, high and s.high > 0.5
    if math.isnan(began):
        began, on_low, on_high = sample.t, low, high
    if p.homing == 1:
        on_low = low
    fault, value, limit = OK, sample.position, 0.0
    since = sample.t - began
    if lines.drive_fault != 0.0:
        fault = DRIVE
    elif low and high:
        fault = LIMITS
    elif low and not on_low:
        fault = LIMIT_LOW
    elif high and not on_high:
        fault = LIMIT_HIGH
    elif lines.enabled != 1.0 and since > p.rise + TICK:
        fault, value, limit = NOT_ENABLED, since, p.rise
    held = Held(began, 1.0 if on_low else 0.0, 1.0 if on_high else 0.0)
    if fault != OK:
        found = latched(watch, fault, value, limit, sample.t)
        return found, held, 0.0
    if on_low and p.homing == 0:
        effort = max(effort, 0.0)
    if on_high:
        effort = min(effort, 0.0)
    return watch, held, effort


@kernel
def unbounded(guard: Limits, p: Wired, s: Held) -> Limits:
    """`bounded` of a stage without lines."""
    return guard


@kernel
def bounded(guard: Limits, p: Wired, s: Held) -> Limits:
    """The guard's limits: slow while leaving a limit switch."""
    free = p.homing == 1 or (s.low < 0.5 and s.high < 0.5)
    # Built in any case: those of a stage that turns are of another type.
    return slower(guard, math.inf if free else p.leave)


def visible_lines(lines: Lines, there: tuple[str, ...]) -> Lines:
    """Lines for clients and records."""
    return Lines(
        *(v if n in there else math.nan for n, v in zip(Lines._fields, lines, strict=True))
    )


def read_lines(sample: Any, there: tuple[str, ...]) -> Lines:
    found = {n: float(getattr(sample, n)) for n in Lines._fields if n in there}
    return QUIET._replace(**found)


def of(channels: tuple[str, ...]) -> tuple[str, ...]:
    """Those of some channels that are lines, and the enable line."""
    return tuple(n for n in (*Lines._fields, *Enable._fields) if n in channels)
