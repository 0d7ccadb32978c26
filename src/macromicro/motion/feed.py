"""Feed along a path: speeds within the limits of each of its pieces, with look-ahead.

Within a piece the speed follows S-curves; the acceleration along the path is 0 where pieces meet.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

from macromicro.motion._shapes import s_curve
from macromicro.motion.profile import Segment

_HALVINGS = 60


class Limits(NamedTuple):
    speed: float  # m/s
    acceleration: float  # along the path, m/s^2
    jerk: float  # along the path, m/s^3


def _times(change: float, limits: Limits) -> tuple[float, float]:
    """Durations of the jerk and of the constant acceleration, for a change of speed."""
    bend = limits.acceleration / limits.jerk
    if change >= limits.acceleration * bend:
        return bend, change / limits.acceleration - bend
    return math.sqrt(change / limits.jerk), 0.0


def _way(slow: float, fast: float, limits: Limits) -> float:
    """Distance of an S-curve between two speeds."""
    bend, hold = _times(abs(fast - slow), limits)
    return 0.5 * (slow + fast) * (2.0 * bend + hold)


def _greatest(low: float, high: float, fits: Callable[[float], bool]) -> float:
    """The largest speed that fits, from `low`, which does, to `high`."""
    if fits(high):
        return high
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if fits(middle) else (low, middle)
    return low


def _borders(lengths: Sequence[float], limits: Sequence[Limits]) -> list[float]:
    n = len(lengths)
    most = [min(a.speed, b.speed) for a, b in itertools.pairwise(limits)]
    speed = [0.0, *most, 0.0]

    def reached(slow: float, fast: float, k: int) -> float:
        if fast <= slow:
            return fast
        return _greatest(slow, fast, lambda v: _way(slow, v, limits[k]) <= lengths[k])

    for k in range(n):  # what can be reached from before
        speed[k + 1] = reached(speed[k], speed[k + 1], k)
    for k in reversed(range(n)):  # and what can be braked from
        speed[k] = reached(speed[k + 1], speed[k], k)
    return speed


def _peak(first: float, last: float, length: float, most: Limits) -> float:
    def fits(v: float) -> bool:
        return _way(first, v, most) + _way(last, v, most) <= length

    return _greatest(max(first, last), most.speed, fits)


def _ramp(place: float, v: float, to: float, limits: Limits) -> list[Segment]:
    bend, hold = _times(abs(to - v), limits)
    jerk = math.copysign(limits.jerk, to - v)
    made, a = [], 0.0
    for duration, j in ((bend, jerk), (hold, 0.0), (bend, -jerk)):
        made.append(Segment(duration, place, v, a, j))
        place += duration * (v + duration * (0.5 * a + duration * j / 6.0))
        v += duration * (a + 0.5 * duration * j)
        a += duration * j
    return made


def feed(lengths: Sequence[float], limits: Sequence[Limits]) -> list[list[Segment]]:
    if len(lengths) == 1:
        only = limits[0]
        return [list(s_curve(lengths[0], only.speed, only.acceleration, only.jerk).segments)]
    speed, found = _borders(lengths, limits), []
    for k, (length, most) in enumerate(zip(lengths, limits, strict=True)):
        first, last = speed[k], speed[k + 1]
        peak = _peak(first, last, length, most)
        rising, falling = _way(first, peak, most), _way(last, peak, most)
        cruise = max(length - rising - falling, 0.0)
        made = _ramp(0.0, first, peak, most)
        if peak > 0.0:
            made.append(Segment(cruise / peak, rising, peak, 0.0, 0.0))
        made += _ramp(rising + cruise, peak, last, most)
        found.append([s for s in made if s.duration > 0.0])
    return found
