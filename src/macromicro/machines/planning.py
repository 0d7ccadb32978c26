"""Turns a programme file into a plan of profiles within the machine's limits."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from macromicro import place as places
from macromicro import programme as programmes
from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.machines.sequence import Plan
from macromicro.motion import s_curve
from macromicro.programme import Limits, Programme, Span, dense
from macromicro.schema.text import printable


class Schedule(NamedTuple):
    """A programme of several stages: their plans have the same times and pieces."""

    plans: tuple[Plan, ...]  # of each
    legs: tuple[Any, ...]  # the moves, as the programme has them
    traces: tuple[Any, ...] = ()  # their paths, of a machine that has a plane


Planned = Plan | Schedule


def each(planned: Planned) -> tuple[Plan, ...]:
    """The plan of each stage."""
    return (planned,) if isinstance(planned, Plan) else planned.plans


class Way(NamedTuple):
    """One move of a plan."""

    start: float  # earliest start, s; NaN: as soon as the one before is complete
    target: float  # m
    hold: float  # s
    pieces: Array  # duration (s), then position (m), velocity, acceleration and jerk at the begin


def load(path: Path, tree: Any, period: float | None = None) -> Programme:
    """The programme in a file, within the machine's travel; `period` [s] in place of its own."""
    pitch = tree.encoder.pitch
    low = math.ceil(tree.travel.low / pitch - 1e-6)
    high = math.floor(tree.travel.high / pitch + 1e-6)
    place = places.of(tree)
    reach = float(low), float(high), -math.inf, math.inf
    dt = float(tree.timing.period) if period is None else period
    return programmes.load(path, Limits(*reach, 1.0 / pitch, place, alone=True, period=dt))


def usual(tree: Any) -> Programme:
    """There and back over most of the travel, in three moves and back (counts)."""
    shares = np.array([0.1, 0.5, 0.9, 0.0])
    target = np.floor(shares * tree.travel.high / tree.encoder.pitch)
    n = len(target)
    return Programme(
        "there and back",
        np.full(n, math.nan),
        np.zeros(n, np.int64),
        target,
        np.full(n, 0.3),
        math.nan,
        "the machine's usual moves",
    )


def plan(programme: Programme, tree: Any, *, anywhere: bool = False) -> Plan:
    """Moves and their profiles, from 0 m on (`programme` in counts)."""
    where = printable(programme.source, 300)
    place = programme.target * tree.encoder.pitch
    if programme.scheduled and not programme.profiles and dense(programme.start):
        ways = [track(programme.start, place)]
    else:
        ways = _ways(programme, place, tree, where, float(place[0]) if anywhere else 0.0)
    origin = _first(ways[0]) if anywhere else 0.0
    check(ways, tree, where, origin)
    return join(ways, programme.end, origin)


def _first(way: Way) -> float:
    """Where a way begins."""
    return float(way.pieces[0, 1]) if len(way.pieces) else way.target


def _ways(programme: Programme, place: Array, tree: Any, where: str, before: float) -> list[Way]:
    """The quickest profile to each target of a move; each motion profile as it is."""
    ways: list[Way] = []
    spans = {span.first: span for span in programme.profiles}
    row = 0
    while row < len(place):
        if row in spans:
            span = spans[row]
            ways.append(_profile(span, programme, place))
            row = span.behind
        else:
            ways.append(_move(programme, row, float(place[row]), tree, where, before))
            row += 1
        before = ways[-1].target
    return ways


def stops(ends: Iterable[tuple[float, float]], hold: float, tree: Any, where: str) -> Plan:
    """From 0 m to each end, at a speed at most (m, m/s), with a hold there (s)."""
    most, ways, before = tree.motion, [], 0.0
    for target, speed in ends:
        profile = s_curve(target - before, speed, most.acceleration, most.jerk, start=before)
        pieces = np.array(profile.segments).reshape(-1, 5)
        ways.append(Way(math.nan, target, hold, pieces))
        before = target
    check(ways, tree, where)
    return join(ways, math.nan)


def _profile(span: Span, programme: Programme, place: Array) -> Way:
    rows = slice(span.first, span.behind)
    if span.profile is None:
        t = np.concatenate(([span.begin], programme.start[rows]))
        return track(t, np.concatenate(([span.origin], place[rows])))
    hold = math.inf if programme.scheduled else float(programme.hold[span.behind - 1])
    return Way(span.begin, span.target, hold, np.array(span.profile.segments))


def _move(
    programme: Programme, row: int, target: float, tree: Any, where: str, before: float
) -> Way:
    """The quickest profile to a target."""
    most, hold = tree.motion, float(programme.hold[row])
    profile = s_curve(target - before, most.velocity, most.acceleration, most.jerk, start=before)
    if programme.scheduled:
        if profile.duration > hold:
            found = (
                f"{places.of(tree).told(target - before)} in {hold:.4g} s is beyond "
                "motion.velocity, acceleration or jerk"
            )
            remedy = f"Allow {profile.duration:.4g} s or more."
            raise ProblemError(f"{where}, target {row + 1}", found, remedy)
        hold = math.inf  # the next one's start, or the end, ends it
    pieces = np.array(profile.segments).reshape(-1, 5)
    return Way(float(programme.start[row]), target, hold, pieces)


def track(t: Array, place: Array) -> Way:
    """A trajectory through some places, at rest at either end, by cubics.

    They are a spline, but stay between two places where these go on one way or rest.
    """
    from scipy.interpolate import CubicSpline

    c = CubicSpline(t, place, bc_type="clamped").c
    duration = np.diff(t)
    pieces = np.stack((duration, c[3], c[2], 2.0 * c[1], 6.0 * c[0]), axis=1)
    speed = np.append(c[2], 0.0)
    calm = _monotone(speed, np.diff(place) / duration)
    changed = np.abs(calm - speed) > 1e-9 * np.abs(speed)
    bent = changed[:-1] | changed[1:]
    cubics = np.stack((duration, *hermite(duration, place, calm)), axis=1)
    return Way(float(t[0]), float(place[-1]), math.inf, np.where(bent[:, None], cubics, pieces))


def _monotone(speed: Array, mean: Array) -> Array:
    """Speeds at the places of a trajectory, reduced where cubics would swing beyond two places.

    A cubic is monotone if the speeds at its ends have the direction of its mean speed and are at
    most three times as high (Fritsch and Carlson 1980). A place at which the trajectory turns back
    keeps its speed: there the extremum may lie between two places.
    """
    before, after = np.append(0.0, mean[:-1]), np.append(mean[1:], 0.0)
    around = np.stack((before, mean, after))
    one_way = (around.min(axis=0) >= 0.0) | (around.max(axis=0) <= 0.0)
    low = np.where(one_way, np.minimum(3.0 * mean, 0.0), -math.inf)
    high = np.where(one_way, np.maximum(3.0 * mean, 0.0), math.inf)
    lowest = np.maximum(np.append(-math.inf, low), np.append(low, -math.inf))
    highest = np.minimum(np.append(math.inf, high), np.append(high, math.inf))
    return np.asarray(np.clip(speed, lowest, highest))


def hermite(h: Array | float, place: Array, speed: Array) -> tuple[Array, Array, Array, Array]:
    """Cubics through places with speeds: place, speed, acceleration, jerk."""
    far, p, v, w = np.diff(place), place[:-1], speed[:-1], speed[1:]
    a = (6.0 * far - h * (4.0 * v + 2.0 * w)) / h**2
    return p, v, a, (6.0 * h * (v + w) - 12.0 * far) / h**3


def check(ways: Sequence[Way], tree: Any, where: str, before: float = 0.0) -> None:
    """Refuse jumps of the set point, paths beyond the travel and speeds beyond the guard's."""
    place = places.of(tree)
    for number, way in enumerate(ways, 1):
        if not len(way.pieces):
            continue
        first = float(way.pieces[0, 1])
        if abs(first - before) > tree.arrival.tolerance:
            found, accepted = place.told(first), place.told(before)
            raise InputError(
                f"{where}, trajectory {number}, first position",
                found,
                f"{accepted}, where the stage stands then, to within arrival.tolerance",
            )
        _check_travel(way, tree, f"{where}, move {number}")
        h, _, v, a, j = way.pieces.T
        # The speed is a parabola in each piece: at its ends, or where the acceleration is 0.
        turn = np.clip(np.divide(-a, j, out=np.zeros_like(a), where=j != 0.0), 0.0, h)
        fastest = max(
            float(np.max(np.abs(v + at * (a + 0.5 * at * j)))) for at in (0.0 * h, turn, h)
        )
        if fastest > tree.guard.speed:
            raise InputError(
                f"{where}, move {number}",
                place.told(fastest, "m/s", 4),
                f"at most {place.told(tree.guard.speed, 'm/s', 4)} (guard.speed)",
            )
        before = way.target


def _check_travel(way: Way, tree: Any, where: str) -> None:
    h, p, v, a, j = way.pieces.T
    # A cubic is farthest at its ends, or where its speed v + a t + j t^2 / 2 is 0.
    root = np.sqrt(np.maximum(a * a - 2.0 * j * v, 0.0))
    stands = -(a + np.copysign(root, a))
    turns = [
        np.divide(stands, j, out=np.zeros_like(h), where=j != 0.0),
        np.divide(2.0 * v, stands, out=np.zeros_like(h), where=stands != 0.0),
    ]
    t = np.array([0.0 * h, h, *(np.clip(turn, 0.0, h) for turn in turns)])
    reached = p + t * (v + t * (0.5 * a + t * j / 6.0))
    place, low, high = places.of(tree), tree.travel.low, tree.travel.high
    beyond = np.maximum(reached - high, low - reached)
    worst = np.unravel_index(int(np.argmax(beyond)), beyond.shape)
    if beyond[worst] > tree.arrival.tolerance:
        begin = float(np.sum(h[: worst[1]]))
        found = (
            f"{begin + float(t[worst]):.4g} s after it begins the curve is at "
            f"{place.told(float(reached[worst]))}, {place.told(float(beyond[worst]), digits=3)} "
            f"outside the travel from {place.told(low)} to {place.told(high)}"
        )
        raise ProblemError(where, found, "It can swing out between points: move them inwards.")


def join(ways: Sequence[Way], end: float, origin: float = 0.0) -> Plan:
    pieces, first, length = [], [0], []
    for way in ways:
        own = way.pieces
        begins = np.cumsum(own[:, 0]) - own[:, 0]
        length.append(float(own[:, 0].sum()))
        pieces.append(np.column_stack((begins, own[:, 1:5])))
        first.append(first[-1] + len(own))
    return Plan(
        start=np.array([w.start for w in ways]),
        target=np.array([w.target for w in ways]),
        hold=np.array([w.hold for w in ways]),
        length=np.array(length),
        first=np.array(first, np.int64),
        pieces=np.ascontiguousarray(np.concatenate(pieces)).reshape(-1, 5),
        origin=origin,
        end=float(end),
    )
