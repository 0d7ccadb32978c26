"""Velocity and acceleration of a programme's set point where it follows a trajectory."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from macromicro.arrays import Array
from macromicro.nominal import PERIOD
from macromicro.programme.moves import FEWEST, LONGEST, Programme

BACK = 1e-3  # of a trajectory's range: less is noise of its targets, and no turn


def rates(programme: Programme) -> tuple[Array, Array]:
    """Velocity and acceleration of the set point at each target.

    Those of a profile are its polynomials'. A trajectory consists of at least `FEWEST` targets of
    one stage, `LONGEST` apart at most; its rates are differences of targets. Elsewhere, and while
    its last target is held, they are 0.
    """
    n = len(programme.start)
    velocity, acceleration = np.zeros(n), np.zeros(n)
    known = [span for span in programme.profiles if span.profile is not None]
    for span in known:
        assert span.profile is not None
        rows = slice(span.first, span.behind - 1)
        motion = span.profile.at(PERIOD * np.arange(1, span.behind - span.first))
        velocity[rows] = span.scale * motion.velocity
        acceleration[rows] = span.scale * motion.acceleration
    for rows, t in () if known else _trajectories(programme):
        velocity[rows] = _slope(programme.set_points[rows], t)
        acceleration[rows] = _slope(velocity[rows], t)
        velocity[rows.stop - 1] = acceleration[rows.stop - 1] = 0.0  # the last target rests
    if not velocity.any():
        return np.empty(0), np.empty(0)
    return velocity, acceleration


def turns(programme: Programme) -> Array:
    """Time from each target to the next reversal of its trajectory.

    A reversal is an extremum after which the set point returns by more than `BACK` of the
    trajectory's range; one with a rest counts at the middle of the rest.
    """
    found, some = np.full(len(programme.start), math.inf), False
    for rows, t in _trajectories(programme):
        some = True
        place = programme.set_points[rows]
        back = BACK * max(float(np.ptp(place)), np.finfo(float).tiny)
        at = np.sort(np.concatenate([_peaks(side, back) for side in (place, -place)]))
        following = np.searchsorted(t[at], t, side="right")
        until = np.append(t[at], math.inf)[following] - t
        found[rows] = until
    return found if some else np.empty(0)


def _peaks(place: Array, back: float) -> Array:
    """Maxima that exceed both sides by more than `back`; the middle of a flat one."""
    from scipy.signal import find_peaks

    at, _ = find_peaks(place, prominence=back)
    return np.asarray(at)


def _trajectories(programme: Programme) -> Iterator[tuple[slice, Array]]:
    """Rows of each trajectory by time, and the times (s) of its targets."""
    start, n = programme.start, len(programme.start)
    if n >= FEWEST and programme.scheduled:
        apart = (np.diff(start) > LONGEST) | (np.diff(programme.stage) != 0)
        for rows in np.split(np.arange(n), np.flatnonzero(apart) + 1):
            if len(rows) >= FEWEST:
                some = slice(int(rows[0]), int(rows[-1]) + 1)
                yield some, start[some]


def _slope(value: Array, t: Array) -> Array:
    return np.asarray(np.gradient(value, t, edge_order=2))
