"""The lines of a stage under guard: limit switches, fault output and enable line of its drive."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

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
    """What the guard allows beside `Limits`.

    Attributes
    ----------
    leave : float
        Greatest speed while a limit switch is tripped, m/s.
    rise : float
        Longest time until the drive is on, s.
    homing : int
        1: the lower limit switch is looked for, and is no fault.
    """

    leave: float = math.inf
    rise: float = 0.0
    homing: int = 0


class Held(NamedTuple):
    """State.

    Attributes
    ----------
    began : float
        When it began to watch, s; NaN: it has not.
    low, high : float
        1 while the stage still stands on a limit switch that was tripped then.
    """

    began: float = math.nan
    low: float = 0.0
    high: float = 0.0


def wired(settings: Any) -> Wired:
    """What the guard allows, from a machine's settings.

    Parameters
    ----------
    settings : Any
        Of any machine of one stage.

    Returns
    -------
    Wired
        Of a machine without such settings, a tenth of its greatest speed off a switch.
    """
    return Wired(SLACK * leaving(settings), rise(settings))


def leaving(settings: Any) -> float:
    """Speed at which a stage leaves a tripped limit switch.

    Parameters
    ----------
    settings : Any
        Of any machine of one stage.

    Returns
    -------
    float
        m/s.
    """
    switches = getattr(settings, "switches", None)
    return float(SHARE * settings.motion.velocity if switches is None else switches.leave)


def rise(settings: Any) -> float:
    """Time from the enable line until the drive gives current.

    Parameters
    ----------
    settings : Any
        Of any machine of one stage.

    Returns
    -------
    float
        s; 0 where no setting says it.
    """
    return float(getattr(getattr(settings, "amplifier", None), "enable_time", 0.0))


@kernel
def none(params: Any, state: Any) -> Lines:
    """What a stage without lines says.

    Parameters
    ----------
    params : Any
        Of the stage.
    state : Any
        Of the stage.

    Returns
    -------
    Lines
        As `types.QUIET`.
    """
    return Lines(0.0, 0.0, 0.0, math.nan, 0.0, 1.0)


@kernel
def as_it_is(params: Any, state: Any, enable: float) -> Any:
    """The state of a stage without an enable line.

    Parameters
    ----------
    params : Any
        Of the stage.
    state : Any
        Of the stage.
    enable : float
        0 or 1.

    Returns
    -------
    Any
        The same state.
    """
    return state


@kernel
def unwatched(
    p: Wired, s: Held, watch: Watch, lines: Lines, sample: Sample, effort: float
) -> tuple[Watch, Held, float]:
    """`step` of a stage without lines.

    Parameters
    ----------
    p : Wired
        What is allowed.
    s : Held
        State.
    watch : Watch
        State of the guard.
    lines : Lines
        What they say.
    sample : Sample
        What the stage shows.
    effort : float
        What the law wants, V.

    Returns
    -------
    watch : Watch
        As it was.
    held : Held
        As it was.
    effort : float
        As wanted, V.
    """
    return watch, s, effort


@kernel
def step(
    p: Wired, s: Held, watch: Watch, lines: Lines, sample: Sample, effort: float
) -> tuple[Watch, Held, float]:
    """One control period of the lines' guard, before that of the stage.

    A limit switch that trips is a fault; one that was tripped when the watch began only stops what
    pushes towards it, until it lets go.

    Parameters
    ----------
    p : Wired
        What is allowed.
    s : Held
        State.
    watch : Watch
        State of the guard.
    lines : Lines
        What they say.
    sample : Sample
        What the stage shows.
    effort : float
        What the law wants, V.

    Returns
    -------
    watch : Watch
        With the fault that was found, which stays.
    held : Held
        New state.
    effort : float
        V: not towards a tripped limit switch.
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
    """`bounded` of a stage without lines.

    Parameters
    ----------
    guard : Limits
        Of the settings.
    p : Wired
        What is allowed.
    s : Held
        State.

    Returns
    -------
    Limits
        The same.
    """
    return guard


@kernel
def bounded(guard: Limits, p: Wired, s: Held) -> Limits:
    """The limits of the guard: off a limit switch it is slow.

    Parameters
    ----------
    guard : Limits
        Of the settings.
    p : Wired
        What is allowed.
    s : Held
        State.

    Returns
    -------
    Limits
        In force now.
    """
    free = p.homing == 1 or (s.low < 0.5 and s.high < 0.5)
    # Built in any case: those of a stage that turns are of another type.
    return slower(guard, math.inf if free else p.leave)


def shown(lines: Lines, there: tuple[str, ...]) -> Lines:
    """Lines as clients and records have them.

    Parameters
    ----------
    lines : Lines
        As a stage says it.
    there : tuple[str, ...]
        Those that there are.

    Returns
    -------
    Lines
        NaN for those that there are not.
    """
    return Lines(
        *(v if n in there else math.nan for n, v in zip(Lines._fields, lines, strict=True))
    )


def read(sample: Any, there: tuple[str, ...]) -> Lines:
    """The lines in a rig's sample.

    Parameters
    ----------
    sample : Any
        Any ``NamedTuple`` with fields of these names.
    there : tuple[str, ...]
        The rig's channels.

    Returns
    -------
    Lines
        Of those that it has not, as `types.QUIET`.
    """
    found = {n: float(getattr(sample, n)) for n in Lines._fields if n in there}
    return QUIET._replace(**found)


def of(channels: tuple[str, ...]) -> tuple[str, ...]:
    """Those of some channels that are lines, and the enable line.

    Parameters
    ----------
    channels : tuple[str, ...]
        Names.

    Returns
    -------
    tuple[str, ...]
        In the order of `Lines`.
    """
    return tuple(n for n in (*Lines._fields, *Enable._fields) if n in channels)
