"""What a motion profile is: pieces of constant jerk, one after the other."""

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

    Attributes
    ----------
    position : ndarray
        m.
    velocity : ndarray
        m/s.
    acceleration : ndarray
        m/s^2.
    jerk : ndarray
        m/s^3; the impulses where the acceleration jumps are not in it.
    """

    position: Array
    velocity: Array
    acceleration: Array
    jerk: Array


class Segment(NamedTuple):
    """A piece of constant jerk: position is a cubic polynomial of the time since its beginning.

    Attributes
    ----------
    duration : float
        s.
    position : float
        At its beginning, m.
    velocity : float
        At its beginning, m/s.
    acceleration : float
        At its beginning, m/s^2.
    jerk : float
        m/s^3.
    """

    duration: float
    position: float
    velocity: float
    acceleration: float
    jerk: float


class Profile(NamedTuple):
    """A motion from rest to rest.

    Attributes
    ----------
    start : float
        Where it begins, m.
    end : float
        Where it ends, m.
    segments : tuple[Segment, ...]
        One after the other from 0 s on; none for a motion that goes nowhere. Within each the
        position goes one way only.
    """

    start: float
    end: float
    segments: tuple[Segment, ...]

    @property
    def borders(self) -> Array:
        """Where the segments begin, and the end of the last, s, shape (segments + 1,)."""
        return np.cumsum([0.0, *(s.duration for s in self.segments)])

    @property
    def duration(self) -> float:
        """How long it takes, s."""
        return float(self.borders[-1])

    def at(self, t: ArrayLike) -> Motion:
        """The state at some times.

        Parameters
        ----------
        t : ArrayLike
            Times since the beginning, s: any shape. Before 0 the axis stands at `start`, from
            `duration` on at `end`.

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


def joined(start: float, end: float, pieces: Iterable[Segment]) -> Profile:
    """A profile of some segments; those of no duration are left out.

    Parameters
    ----------
    start : float
        Where it begins, m.
    end : float
        Where it ends, m.
    pieces : Iterable[Segment]
        In order.

    Returns
    -------
    Profile
        From rest to rest.
    """
    return Profile(start, end, tuple(s for s in pieces if s.duration > 0.0))


def number(value: object, name: str, accepted: str = "a finite number") -> float:
    """An argument that is a finite number.

    Parameters
    ----------
    value : object
        What was given.
    name : str
        The argument, for the message.
    accepted : str, optional
        What it may be, for the message.

    Returns
    -------
    float
        The number.

    Raises
    ------
    InputError
        It is none.
    """
    if not isinstance(value, bool) and isinstance(value, Real):
        try:
            found = float(value)
        except OverflowError:  # a whole number of hundreds of digits
            found = math.inf
        if math.isfinite(found):
            return found
    raise InputError(name, value, accepted)


def positive(value: object, name: str, unit: str) -> float:
    """An argument that is a finite number above 0.

    Parameters
    ----------
    value : object
        What was given.
    name : str
        The argument, for the message.
    unit : str
        Its unit, for the message.

    Returns
    -------
    float
        The number.

    Raises
    ------
    InputError
        It is not.
    """
    accepted = f"a finite number above 0 [{unit}]"
    found = number(value, name, accepted)
    if found > 0.0:
        return found
    raise InputError(name, value, accepted)
