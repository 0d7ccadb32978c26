"""A motion profile: pieces of constant jerk, one after the other."""

from __future__ import annotations

import math
from collections.abc import Iterable
from numbers import Real
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from macromicro.arrays import Array
from macromicro.errors import InputError


class Motion(NamedTuple):
    """The state of an axis at some times.

    Examples
    --------
    >>> from macromicro.motion import trapezoid
    >>> state = trapezoid(0.1, velocity=0.2, acceleration=1.0).at([0.1, 0.35])
    >>> state.position.round(6).tolist(), state.velocity.round(6).tolist()  # m, m/s
    ([0.005, 0.05], [0.1, 0.2])
    """

    position: Array  #: m
    velocity: Array  #: m/s
    acceleration: Array  #: m/s^2
    jerk: Array  #: m/s^3; the impulses where the acceleration jumps are not in it


class Segment(NamedTuple):
    """A piece of constant jerk: position is a cubic polynomial of the time since its beginning.

    Examples
    --------
    >>> from macromicro.motion import Profile, Segment
    >>> coast = Segment(0.5, position=0.0, velocity=0.2, acceleration=0.0, jerk=0.0)
    >>> float(Profile(0.0, 0.1, (coast,)).at(0.25).position)  # m
    0.05
    """

    duration: float  #: s
    position: float  #: at its beginning, m
    velocity: float  #: at its beginning, m/s
    acceleration: float  #: at its beginning, m/s^2
    jerk: float  #: m/s^3


class Profile(NamedTuple):
    """A motion from rest to rest.

    Examples
    --------
    >>> from macromicro.motion import trapezoid
    >>> trapezoid(0.1, velocity=0.2, acceleration=1.0).borders.round(6).tolist()  # s
    [0.0, 0.2, 0.5, 0.7]
    """

    start: float  #: where it begins, m
    end: float  #: where it ends, m
    #: one after the other from 0 s on; none for a motion that goes nowhere. Within each the
    #: position goes one way only
    segments: tuple[Segment, ...]

    @property
    def borders(self) -> Array:
        """Beginnings of the segments, and the end of the last, s, shape (segments + 1,)."""
        return np.cumsum([0.0, *(s.duration for s in self.segments)])

    @property
    def duration(self) -> float:
        """Duration, s."""
        return float(self.borders[-1])

    def at(self, t: ArrayLike) -> Motion:
        """The state at some times.

        Parameters
        ----------
        t : ArrayLike
            Times since the beginning, s. The axis rests at `start` before 0, and at `end` from
            `duration` on.

        Returns
        -------
        Motion
            Arrays of the shape of `t`; where segments meet, the later one's values; NaN for NaN.
        """
        times = np.asarray(t, dtype=np.float64)
        rest = (0.0, 0.0, 0.0)
        pieces = np.array([(0.0, self.start, *rest), *self.segments, (math.inf, self.end, *rest)])
        k = np.searchsorted(self.borders, times, side="right")  # 0: before it, last: after it
        moving = (k > 0) & (k < len(pieces) - 1)
        since = np.where(moving, times - np.concatenate(([0.0], self.borders))[k], 0.0)
        since = np.where(np.isnan(times), np.nan, since)
        p, v, a, j = np.moveaxis(pieces[k, 1:], -1, 0)
        # Rounding may not carry a segment beyond the place where the next one begins.
        following = pieces[np.minimum(k + 1, len(pieces) - 1), 1]
        place = p + since * (v + since * (a / 2.0 + since * j / 6.0))
        return Motion(
            np.clip(place, np.minimum(p, following), np.maximum(p, following))[()],
            (v + since * (a + since * j / 2.0))[()],
            (a + since * j)[()],
            (j + 0.0 * since)[()],
        )


def join(start: float, end: float, pieces: Iterable[Segment]) -> Profile:
    """A profile of segments, without those of no duration."""
    return Profile(start, end, tuple(s for s in pieces if s.duration > 0.0))


def number(value: object, name: str, accepted: str = "a finite number") -> float:
    if not isinstance(value, bool) and isinstance(value, Real):
        try:
            found = float(value)
        except OverflowError:  # a whole number of hundreds of digits
            found = math.inf
        if math.isfinite(found):
            return found
    raise InputError(name, value, accepted)


def positive(value: object, name: str, unit: str) -> float:
    accepted = f"a finite number above 0 [{unit}]"
    found = number(value, name, accepted)
    if found > 0.0:
        return found
    raise InputError(name, value, accepted)
