"""Profiles through several points."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from macromicro.errors import InputError, ProblemError
from macromicro.motion._shapes import s_curve, trapezoid
from macromicro.motion.profile import Profile, Segment, join, number


def through(
    points: Sequence[float],
    velocity: float,
    acceleration: float,
    jerk: float | None = None,
    *,
    dwell: float = 0.0,
    stop: bool = True,
) -> Profile:
    """The quickest motion through several points within limits.

    Parameters
    ----------
    points : Sequence[float]
        Two or more, m.
    velocity : float
        Largest speed, m/s.
    acceleration : float
        Largest acceleration either way, m/s^2.
    jerk : float | None, optional
        Largest jerk either way, m/s^3; None: no such limit.
    dwell : float, optional
        Duration of each stop on the way, s.
    stop : bool, optional
        Whether it stops at every point; False: only where the direction changes.

    Returns
    -------
    Profile
        One profile for all points.

    Raises
    ------
    InputError
        Fewer than two points, or one that is not a number; a negative dwell; else as for
        `trapezoid`.

    Examples
    --------
    >>> from macromicro.motion import through
    >>> profile = through([0.0, 0.1, 0.05], velocity=0.2, acceleration=1.0, dwell=0.5)
    >>> round(profile.duration, 6), profile.end
    (1.65, 0.05)
    """
    places = [number(p, f"points[{k}]") for k, p in enumerate(points)]
    if len(places) < 2:
        raise ProblemError("points", "there are fewer than two", "Give two or more.")
    accepted = "a finite number, 0 or more [s]"
    pause = number(dwell, "dwell", accepted)
    if pause < 0.0:
        raise InputError("dwell", dwell, accepted)
    if not stop:
        places = _turning(places)
    pieces: list[Segment] = []
    for k, (here, there) in enumerate(itertools.pairwise(places)):
        if k:
            pieces.append(Segment(pause, here, 0.0, 0.0, 0.0))
        way = there - here
        if jerk is None:
            pieces += trapezoid(way, velocity, acceleration, start=here).segments
        else:
            pieces += s_curve(way, velocity, acceleration, jerk, start=here).segments
    return join(places[0], places[-1], pieces)


def _turning(places: list[float]) -> list[float]:
    """The first point, those where the direction changes, and the last."""
    apart = [p for p, before in zip(places[1:], places, strict=False) if p != before]
    apart = [places[0], *apart]
    turns = [
        here
        for before, here, after in zip(apart, apart[1:], apart[2:], strict=False)
        if (here > before) != (after > here)
    ]
    return [places[0], *turns, places[-1]]
