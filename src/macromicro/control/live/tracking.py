"""Leads a set point after a moving target, within limits of speed, acceleration, jerk and place.

Each period ends in a state from which a stop within all limits is known; where the law's wish would
leave no such stop, the known one is begun. So the set point keeps the limits whatever the target
does.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from macromicro.control.live.leading import Aim, Piece, at
from macromicro.motion import Segment

PACE = 0.35  # of a radian in a period: how fast an error of the set point decays
EASE = 0.7  # of acceleration and jerk: what an approach over a long way uses
_NEAR = 1e-9  # allowance for rounding: a share of a limit, or s at its speed
_STILL = 1e-6  # of a limit: it rests


class Limits(NamedTuple):
    # velocity, acceleration, jerk: m/s and so on; low, high: m
    velocity: float
    acceleration: float
    jerk: float
    low: float
    high: float


class Track(NamedTuple):
    """The set point at the begin of a period, and a stop from there that keeps all limits."""

    aim: Aim
    stop: tuple[Segment, ...]


def stop(q: Limits, aim: Aim) -> tuple[Segment, ...]:
    """The quickest way to rest from a set point, within acceleration and jerk."""
    p, v, a, _ = aim
    j, most = q.jerk, q.acceleration
    left = v + a * abs(a) / (2.0 * j)  # the speed once the acceleration is ramped to 0
    way = 1.0 if left >= 0.0 else -1.0
    v, a = way * v, way * a
    peak = math.sqrt(max(j * v + 0.5 * a * a, 0.0))
    held = 0.0
    if peak > most:
        peak, held = most, (v + a * a / (2.0 * j) - most * most / j) / most
    pieces, here = [], Aim(p, way * v, way * a, 0.0)
    for duration, jerk in (((a + peak) / j, -j), (held, 0.0), (peak / j, j)):
        if duration > 0.0:
            here = here._replace(jerk=way * jerk)
            pieces.append(Segment(duration, *here))
            here = at(here, duration)
    return tuple(pieces)


def within_limits(q: Limits, pieces: tuple[Segment, ...]) -> bool:
    """Whether place, speed and acceleration stay within the limits on these pieces."""
    low, high = q.low - _NEAR * q.velocity, q.high + _NEAR * q.velocity
    fastest, hardest = q.velocity * (1.0 + _NEAR), q.acceleration * (1.0 + _NEAR)
    for duration, p, v, a, j in pieces:
        times = [duration]
        # Otherwise it is farthest and fastest at its end.
        if v * (v + duration * (a + 0.5 * duration * j)) <= 0.0 or a * (a + duration * j) < 0.0:
            times += _extremes(v, a, j)
        for h in times:
            if 0.0 < h <= duration:
                place = p + h * (v + h * (0.5 * a + h * j / 6.0))
                if not low <= place <= high or abs(v + h * (a + 0.5 * h * j)) > fastest:
                    return False
                if abs(a + h * j) > hardest:
                    return False
    return True


def _extremes(v: float, a: float, j: float) -> list[float]:
    """When a piece may be fastest, and when it may turn."""
    if j == 0.0:
        return [-v / a] if a != 0.0 else []
    under = a * a - 2.0 * j * v
    if under < 0.0:  # it never turns, and is fastest at an end
        return []
    root = math.sqrt(under)
    return [-a / j, (-a - root) / j, (-a + root) / j]


def start(q: Limits, aim: Aim) -> Track:
    """Begin at a set point; one that moves already may need more than the limits to stop."""
    return Track(aim._replace(jerk=0.0), stop(q, aim))


def _approach(q: Limits, way: float, pace: float) -> tuple[float, float]:
    """The speed towards a target at rest, and by how much it falls per metre of the way.

    Proportional near the target; from farther away as fast as acceleration and jerk can brake.
    """
    most, jerk = EASE * q.acceleration, EASE * q.jerk
    close = most / (pace * pace)  # where the proportional speed falls as fast as one brakes
    if way <= close:
        return pace * way, pace
    way -= 0.5 * close
    ramp = most * most / (2.0 * jerk)
    root = math.sqrt(ramp * ramp + 2.0 * most * way)
    if root - ramp > q.velocity:
        return q.velocity, 0.0
    return root - ramp, most / root


def wanted_jerk(q: Limits, aim: Aim, target: Aim, dt: float) -> float:
    """The jerk that a follower would like: linear near the target, less for large errors."""
    pace = PACE / dt
    error = target.position - aim.position
    speed, fall = _approach(q, abs(error), 0.5 * pace)
    wanted = target.velocity + math.copysign(speed, error)
    wanted = min(max(wanted, -q.velocity), q.velocity)
    off = wanted - aim.velocity
    change = math.copysign(min(0.5 * pace * abs(off), math.sqrt(EASE * q.jerk * abs(off))), off)
    change += target.acceleration + fall * (target.velocity - aim.velocity)
    change = min(max(change, -q.acceleration), q.acceleration)
    return min(max(3.0 * pace * (change - aim.acceleration), -q.jerk), q.jerk)


def _there(q: Limits, aim: Aim, target: Aim, dt: float) -> bool:
    """Whether it rests on the target, but for rounding."""
    off = abs(target.position - aim.position)
    return (
        target.velocity == 0.0
        and off <= _STILL * q.velocity * dt
        and abs(aim.velocity) <= _STILL * q.velocity
        and abs(aim.acceleration) <= _STILL * q.acceleration
    )


def step(q: Limits, track: Track, target: Aim, dt: float) -> tuple[Track, Aim, tuple[Piece, ...]]:
    """The set point of this period, where its polynomial changes, and the state behind it."""
    here = track.aim
    if _there(q, here, target, dt):
        rest = Aim(target.position, 0.0, 0.0, 0.0)
        return Track(rest, ()), rest, ()
    ease = min(max(-here.acceleration / dt, -q.jerk), q.jerk)
    for jerk in (wanted_jerk(q, here, target, dt), ease):
        aim = here._replace(jerk=jerk)
        after = at(aim, dt)
        way = stop(q, after)
        if within_limits(q, (Segment(dt, *aim), *way)):
            return Track(after._replace(jerk=0.0), way), aim, ()
    return stopping(track, dt)


def stopping(track: Track, dt: float) -> tuple[Track, Aim, tuple[Piece, ...]]:
    """One period of the known stop."""
    rest = Aim(track.aim.position, 0.0, 0.0, 0.0)
    if not track.stop:
        return track._replace(aim=rest), rest, ()
    first, begin, later = Aim(*track.stop[0][1:]), 0.0, []
    left: list[Segment] = []
    for piece in track.stop:
        end = begin + piece.duration
        if 0.0 < begin < dt:
            later.append((begin, Aim(*piece[1:])))
        if end > dt:
            since = max(dt - begin, 0.0)
            left.append(Segment(end - max(begin, dt), *at(Aim(*piece[1:]), since)))
        begin = end
    last = track.stop[-1]
    over = at(Aim(*last[1:]), last.duration)._replace(velocity=0.0, acceleration=0.0, jerk=0.0)
    if begin < dt:
        later.append((begin, over))
    then = Aim(*left[0][1:]) if left else over
    return Track(then._replace(jerk=0.0), tuple(left)), first, tuple(later)
