"""Programmes of motion profiles and trajectories.

The two-stage machine gets a set point each control period; a machine of one stage, the polynomials.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.motion import Profile, Trajectory, s_curve, trapezoid
from macromicro.nominal import PERIOD, PITCH
from macromicro.place import Place
from macromicro.programme import entries, travel
from macromicro.programme.moves import (
    FEWEST,
    MACRO,
    MAX_HOLD,
    MAX_MOVES,
    MICRO,
    STAGES,
    Limits,
    Programme,
    Span,
)
from macromicro.schema.keys import unknown
from macromicro.schema.text import printable
from macromicro.units import quantity, shown

LONGEST = MAX_MOVES * PERIOD  # s, of all profiles

_UNITS = {
    "velocity": "m/s",
    "acceleration": "m/s^2",
    "deceleration": "m/s^2",
    "jerk": "m/s^3",
}


def keys(limits: Limits) -> tuple[str, ...]:
    """What a table [[profiles]] may have."""
    return (*limits.names, *_UNITS, "hold")


def tables(limits: Limits) -> str:
    """What is accepted for [[profiles]], in words."""
    what = f"each with {limits.either}, velocity and acceleration"
    return f"one table [[profiles]] or more, {what}"


class Leg(NamedTuple):
    span: Span  # from 0 s and row 0 on
    since: Array  # when each of its targets comes after its begin, s
    place: Array  # its targets, m
    hold: float  # how long its end is held, s


def expand(given: list[dict[str, Any]], limits: Limits, path: Path, title: str = "") -> Programme:
    """The programme of tables [[profiles]], one after the other from both stages at 0."""
    file = printable(path, 300)
    for number, table in enumerate(given, 1):  # an unknown key, often a slip, before all others
        unknown(table, keys(limits), f"{file}, profile {number}, ")
    legs: list[Leg] = []
    places = [0.0, 0.0]  # of both stages, m
    seconds = 0.0
    for number, table in enumerate(given, 1):
        where = f"{file}, profile {number}"
        for leg in ways(table, places, limits, where):
            seconds += leg.span.finish
            if seconds > LONGEST:
                accepted = f"Profiles last {LONGEST:g} s at most in total."
                raise ProblemError(where, "too long", accepted)
            legs.append(leg)
    return _programme(title, legs, limits, str(path))


def follow(
    trajectory: Trajectory,
    stage: str = "macro",
    *,
    hold: float = 2.0,
    limits: Limits | None = None,
    title: str = "",
) -> Programme:
    """A programme in which one stage follows a trajectory.

    Parameters
    ----------
    trajectory : Trajectory
        It begins at 0 m, the position at the beginning of a run.
    stage : str, optional
        "macro" or "micro".
    hold : float, optional
        Duration of the hold at its end, s.
    limits : Limits | None, optional
        Travel of the stages; None: that of the nominal machine.
    title : str, optional
        Title of the programme.

    Returns
    -------
    Programme
        With the set points of the trajectory as targets.

    Raises
    ------
    InputError
        No such stage; the trajectory leaves the stage's travel, begins elsewhere than at 0 m, has
        a period below the control period, or too few or too many set points; or the hold is bad.

    Examples
    --------
    >>> from macromicro.motion import Trajectory, trapezoid
    >>> from macromicro.programme import follow
    >>> there = Trajectory.from_profile(trapezoid(0.05, velocity=0.1, acceleration=1.0))
    >>> programme = follow(there, "macro", hold=1.0)
    >>> len(programme.target), programme.profiles[0].until
    (600, 1.6)
    """
    if stage not in STAGES:
        raise InputError("stage", stage, "'macro' or 'micro'")
    if not 0.0 <= hold <= MAX_HOLD:
        raise InputError("hold", hold, f"0 to {MAX_HOLD:g} s")
    count, first = len(trajectory.position) - 1, float(trajectory.position[0])
    if not FEWEST <= count <= MAX_MOVES:
        found = f"it has {count} set points behind its first"
        raise ProblemError("trajectory", found, f"Give {FEWEST} to {MAX_MOVES}.")
    if trajectory.period < PERIOD:
        accepted = f"{PERIOD:g} s, the control period, or more"
        raise InputError("trajectory, period", trajectory.period, accepted)
    limits = travel.limits(travel.Travel(), PITCH) if limits is None else limits
    place = limits.names[stage]
    if place == MACRO:
        lowest, highest = (x / limits.counts_per_metre for x in limits[:2])
    else:
        lowest, highest = limits.micro_lo, limits.micro_hi
    if abs(first) > 1e-9:
        found = f"it begins at {first:g} m, but a run at 0 m"
        raise ProblemError("trajectory", found, "Prepend a motion with `then`.")
    trajectory.check(lowest, highest)
    leg = _sample(place, trajectory, hold, limits.counts_per_metre if place == MACRO else 1.0)
    return _programme(title or f"trajectory of the {stage}-stage", [leg], limits, "")


def ways(table: dict[str, Any], places: list[float], limits: Limits, where: str) -> Iterator[Leg]:
    given = [name for name in limits.names if name in table]
    if not given:
        raise entries.no_target(limits, where)
    if len(given) > 1:
        raise ProblemError(where, "both macro and micro", "Give exactly one of them.")
    stage, key = limits.names[given[0]], f"{where}, {given[0]}"
    texts = entries.texts(table, given[0], where)
    if not texts:
        raise ProblemError(where, "the list is empty", "Give one target or more.")
    most = {name: _limit(table, name, limits.place, where) for name in _UNITS}
    if most["jerk"] is not None and most["deceleration"] is not None:
        accepted = "Give one of them: an S-curve decelerates as it accelerates."
        raise ProblemError(where, "both jerk and deceleration", accepted)
    hold = entries.hold(entries.text(table, "hold", where), f"{where}, hold", zero=True)
    scale = limits.counts_per_metre if stage == MACRO else 1.0
    if stage == MACRO:
        places[MICRO] = 0.0  # a macro move lets the micro-stage go
    for text in texts:
        target = entries.target(text, stage, limits, key) / scale
        profile = _shape(places[stage], target, most)
        _check(profile, limits, key, text)
        places[stage] = target
        if limits.alone:
            ends, end = (profile.start, profile.end), profile.duration
            span = Span(stage, 0.0, end, end + hold, *ends, 0, 1, profile, scale)
            yield Leg(span, np.zeros(1), np.array([profile.end]), hold)
        else:
            yield _sample(stage, Trajectory.from_profile(profile, PERIOD), hold, scale, profile)


def _limit(table: dict[str, Any], name: str, place: Place, where: str) -> float | None:
    """The limit of that name; None for a missing optional one."""
    unit = place.named(_UNITS[name])
    if name in ("jerk", "deceleration") and name not in table:
        return None
    such = f"1 {unit.replace('rad', 'deg')}"
    text = entries.text(table, name, where, such)
    value = quantity(text, unit, f"{where}, {name}")
    if value > 0.0:
        return value
    raise InputError(f"{where}, {name}", text, f"more than 0 {unit}")


def _shape(here: float, there: float, most: dict[str, float | None]) -> Profile:
    v, a, b, j = (most[name] for name in _UNITS)
    assert v is not None and a is not None
    if j is None:
        made = trapezoid(there - here, v, a, b, start=here)
    else:
        made = s_curve(there - here, v, a, j, start=here)
    return made._replace(end=there)


def _check(profile: Profile, limits: Limits, where: str, text: str) -> None:
    """Refuse a profile that goes nowhere, is too short to be followed, or too long."""
    if profile.start == profile.end:
        raise InputError(where, text, "a target other than the present position")
    least = limits.shortest * limits.period
    if profile.duration < least * (1.0 - 1e-9):
        took, lowest, period = (
            shown(x, "s", "ms", 3) for x in (profile.duration, least, limits.period)
        )
        accepted = f"at least {lowest} ({limits.shortest} control periods of {period})"
        raise ProblemError(where, f"profile too short: {took}; {accepted}")
    if profile.duration > LONGEST:
        found = f"profile too long: {profile.duration:.3g} s; at most {LONGEST:g} s"
        raise ProblemError(where, found)


def _sample(
    stage: int, way: Trajectory, hold: float, scale: float, profile: Profile | None = None
) -> Leg:
    """A target each period; the last one needs a period of its own."""
    held = math.ceil(hold / PERIOD - 1e-6) * PERIOD
    ends, end = (float(way.position[0]), float(way.position[-1])), way.duration
    until, rows = end + max(held, PERIOD), len(way.position) - 1
    span = Span(stage, 0.0, end, until, *ends, 0, rows, profile, scale)
    return Leg(span, way.t[1:], way.position[1:], held)


def _programme(title: str, legs: list[Leg], limits: Limits, source: str) -> Programme:
    """The targets of all legs; each begins when the hold of the one before it ends."""
    begin, count = 0.0, 0
    starts: list[Array] = []
    spans: list[Span] = []
    for leg in legs:
        starts.append(begin + leg.since)
        spans.append(leg.span.moved(begin, count))
        begin, count = spans[-1].until, spans[-1].behind
        if not limits.alone:
            begin = round(begin / PERIOD) * PERIOD
    start = np.concatenate(starts)
    stages = [np.full(len(leg.place), leg.span.stage, np.int64) for leg in legs]
    return Programme(
        title=title,
        start=start,
        stage=np.concatenate(stages),
        target=np.concatenate([leg.place * leg.span.scale for leg in legs]),
        hold=np.diff(start, append=begin),
        end=begin,
        source=source,
        profiles=tuple(spans),
    )
