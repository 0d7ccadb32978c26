"""From rest to rest in the least time: trapezoids of velocity, and S-curves."""

from __future__ import annotations

import math

from macromicro.errors import InputError
from macromicro.motion.profile import Profile, Segment, join, number, positive


def trapezoid(
    distance: float,
    velocity: float,
    acceleration: float,
    deceleration: float | None = None,
    *,
    start: float = 0.0,
) -> Profile:
    """The quickest motion within limits of velocity and acceleration.

    A triangle where the distance is too short to reach the velocity. The acceleration jumps.

    Parameters
    ----------
    distance : float
        Distance from `start`, m; negative: backwards.
    velocity : float
        Largest speed, m/s.
    acceleration : float
        Largest acceleration, m/s^2.
    deceleration : float | None, optional
        Largest deceleration, m/s^2; None: as `acceleration`.
    start : float, optional
        Initial position, m.

    Returns
    -------
    Profile
        Of at most three segments.

    Raises
    ------
    InputError
        A limit is not a finite number above 0, or the motion is too small, large, short or long
        for floating-point numbers.

    Examples
    --------
    >>> from macromicro.motion import trapezoid
    >>> profile = trapezoid(0.1, velocity=0.2, acceleration=1.0)
    >>> round(profile.duration, 6)
    0.7
    >>> profile.at([0.1, 0.35]).velocity.round(6).tolist()
    [0.1, 0.2]
    """
    way, sign, origin = _way(distance, start)
    v = positive(velocity, "velocity", "m/s")
    a = positive(acceleration, "acceleration", "m/s^2")
    b = a if deceleration is None else positive(deceleration, "deceleration", "m/s^2")
    if way == 0.0:
        return join(origin, origin, ())
    peak = min(v, math.sqrt(2.0 * way / (1.0 / a + 1.0 / b)))
    rise, fall = peak / a, peak / b
    before, after = peak * rise / 2.0, peak * fall / 2.0
    cruise = max(0.0, (way - before - after) / peak) if peak == v else 0.0
    return _orient(
        origin,
        sign,
        way,
        [
            Segment(rise, 0.0, 0.0, a, 0.0),
            Segment(cruise, before, peak, 0.0, 0.0),
            Segment(fall, way - after, peak, -b, 0.0),
        ],
    )


def s_curve(
    distance: float, velocity: float, acceleration: float, jerk: float, *, start: float = 0.0
) -> Profile:
    """The quickest motion within limits of velocity, acceleration and jerk.

    Seven segments, without those whose limit is not reached.

    Parameters
    ----------
    distance : float
        Distance from `start`, m; negative: backwards.
    velocity : float
        Largest speed, m/s.
    acceleration : float
        Largest acceleration either way, m/s^2.
    jerk : float
        Largest jerk either way, m/s^3.
    start : float, optional
        Initial position, m.

    Returns
    -------
    Profile
        Of at most seven segments.

    Raises
    ------
    InputError
        As for `trapezoid`.

    Examples
    --------
    >>> from macromicro.motion import s_curve
    >>> profile = s_curve(0.1, velocity=0.2, acceleration=1.0, jerk=10.0)
    >>> round(profile.duration, 6), len(profile.segments)
    (0.8, 7)
    """
    way, sign, origin = _way(distance, start)
    v = positive(velocity, "velocity", "m/s")
    a = positive(acceleration, "acceleration", "m/s^2")
    j = positive(jerk, "jerk", "m/s^3")
    if way == 0.0:
        return join(origin, origin, ())
    # How long the jerk acts, how long the acceleration is constant, and the velocity reached.
    reached = v / a >= a / j
    bend, hold = (a / j, v / a - a / j) if reached else (math.sqrt(v / j), 0.0)
    peak, top = v, a if reached else j * bend
    rise = 2.0 * bend + hold
    cruise = way / v - rise
    if cruise < 0.0:  # velocity not reached
        lag = a / j
        peak = a / 2.0 * (math.sqrt(lag * lag + 4.0 * way / a) - lag)
        if reached and peak / a >= a / j:
            bend, hold, top = a / j, peak / a - a / j, a
        else:  # nor acceleration
            bend, hold = math.cbrt(way / (2.0 * j)), 0.0
            top, peak = j * bend, j * bend * bend
        rise, cruise = 2.0 * bend + hold, 0.0
    v1, p1 = top * bend / 2.0, top * bend * bend / 6.0
    v2, p2 = v1 + top * hold, p1 + hold * (v1 + top * hold / 2.0)
    p3 = peak * rise / 2.0
    return _orient(
        origin,
        sign,
        way,
        [
            Segment(bend, 0.0, 0.0, 0.0, j),
            Segment(hold, p1, v1, top, 0.0),
            Segment(bend, p2, v2, top, -j),
            Segment(cruise, p3, peak, 0.0, 0.0),
            Segment(bend, way - p3, peak, 0.0, -j),
            Segment(hold, way - p2, v2, -top, 0.0),
            Segment(bend, way - p1, v1, -top, j),
        ],
    )


def _way(distance: float, start: float) -> tuple[float, float, float]:
    way, origin = number(distance, "distance"), number(start, "start")
    return abs(way), math.copysign(1.0, way), origin


def _orient(start: float, sign: float, way: float, pieces: list[Segment]) -> Profile:
    """The profile of a motion that was computed forward from 0."""
    made = join(
        start,
        start + sign * way,
        (
            Segment(s.duration, start + sign * s.position, *(sign * x + 0.0 for x in s[2:]))
            for s in pieces
        ),
    )
    if not 0.0 < made.duration < math.inf or not all(math.isfinite(x) for s in made[2] for x in s):
        accepted = "a distance whose duration is within the range of floating-point numbers"
        raise InputError("distance", sign * way, accepted)
    return made
