"""How fast the set point of a programme changes, where it follows a trajectory."""

from __future__ import annotations

import numpy as np

from macromicro.arrays import Array
from macromicro.nominal import PERIOD
from macromicro.programme.moves import FEWEST, LONGEST, Programme


def rates(programme: Programme) -> tuple[Array, Array]:
    """Velocity and acceleration of the set point at each target.

    A trajectory is `FEWEST` targets of one stage or more, one every `LONGEST` at the latest; in it
    both are differences of its targets. Elsewhere, and where its last target is held, they are 0.

    Parameters
    ----------
    programme : Programme
        Moves or set points.

    Returns
    -------
    velocity : ndarray, shape (n,)
        counts/s of the macro-stage, m/s of the micro-stage; (0,) without any trajectory.
    acceleration : ndarray, shape (n,)
        The same per second.
    """
    start, n = programme.start, len(programme.start)
    place = programme.set_points
    velocity, acceleration = np.zeros(n), np.zeros(n)
    if programme.mixed:
        for span in programme.profiles:
            some = slice(span.first, span.behind)
            t = PERIOD * np.arange(span.behind - span.first, dtype=float)
            _fill(velocity, acceleration, some, place, t)
    elif n >= FEWEST and programme.scheduled:
        apart = (np.diff(start) > LONGEST) | (np.diff(programme.stage) != 0)
        for rows in np.split(np.arange(n), np.flatnonzero(apart) + 1):
            if len(rows) >= FEWEST:
                some = slice(rows[0], rows[-1] + 1)
                _fill(velocity, acceleration, some, place, start[some])
    if not velocity.any():
        return np.empty(0), np.empty(0)
    return velocity, acceleration


def _fill(velocity: Array, acceleration: Array, rows: slice, target: Array, t: Array) -> None:
    """Differences at some rows; at the last of them the target rests."""
    velocity[rows] = _slope(target[rows], t)
    acceleration[rows] = _slope(velocity[rows], t)
    velocity[rows.stop - 1] = acceleration[rows.stop - 1] = 0.0


def _slope(value: Array, t: Array) -> Array:
    return np.asarray(np.gradient(value, t, edge_order=2))
