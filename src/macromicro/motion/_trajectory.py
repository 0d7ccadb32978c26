"""Position over time as a controller gets it: a set point each control period."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.motion.profile import Profile, number, positive
from macromicro.nominal import PERIOD
from macromicro.schema import csv_rows
from macromicro.schema.text import printable, read_text

MOST = 10_000_000  # set points
_SLACK = 1e-9  # of a limit, for rounding
_MEET = 1e-9  # m
_TIMES = {"t_s": 1.0, "t_ms": 1e3}
_PLACES = {"m": 1.0, "mm": 1e3, "um": 1e6}
_HEADER = "t_s or t_ms, and columns of positions whose names end with _m, _mm or _um"
_WHAT = "a trajectory (.csv)"


class Trajectory(NamedTuple):
    """Set points at equal intervals, from a stage at rest to a stage at rest.

    Examples
    --------
    >>> from macromicro.motion import Trajectory, trapezoid
    >>> profile = trapezoid(0.1, velocity=0.2, acceleration=1.0)
    >>> there = Trajectory.from_profile(profile, period=0.1)
    >>> there.position.round(3).tolist()  # m, every 0.1 s
    [0.0, 0.005, 0.02, 0.04, 0.06, 0.08, 0.095, 0.1]
    """

    period: float  #: time from one to the next, s
    position: Array  #: m, from 0 s on

    @property
    def t(self) -> Array:
        """Times of the set points, s, shape (n,)."""
        return np.arange(len(self.position), dtype=np.float64) * self.period

    @property
    def duration(self) -> float:
        """Time of the last set point, s."""
        return (len(self.position) - 1) * self.period

    @property
    def velocity(self) -> Array:
        """Mean velocity of the period before each set point, m/s, shape (n,); first 0."""
        return np.diff(self.position, prepend=self.position[:1]) / self.period

    @property
    def acceleration(self) -> Array:
        """Change of the velocity at each set point over a period, m/s^2, shape (n,).

        The stage is at rest before the first and after the last set point: an initial or final
        velocity appears there as an acceleration.
        """
        return np.diff(self.velocity, append=0.0) / self.period

    @classmethod
    def from_profile(cls, profile: Profile, period: float = PERIOD) -> Trajectory:
        """Sample a profile; the last set point is its end, less than a period after its duration.

        Parameters
        ----------
        profile : Profile
            From rest to rest.
        period : float, optional
            Interval of the set points, s.

        Returns
        -------
        Trajectory
            Set points.

        Raises
        ------
        InputError
            The period is not above 0, or gives more than `MOST` set points.
        """
        t = _times(profile.duration, period)
        position = profile.at(t).position
        position[-1] = profile.end  # a duration may be a whole number of periods but for rounding
        return cls(float(period), position)

    @classmethod
    def from_function(
        cls, place: Callable[[Array], Array], duration: float, period: float = PERIOD
    ) -> Trajectory:
        """Sample a function of time.

        Parameters
        ----------
        place : Callable[[Array], Array]
            Position in m at an array of times in s from 0 on.
        duration : float
            s.
        period : float, optional
            Interval of the set points, s.

        Returns
        -------
        Trajectory
            Set points up to the duration, or less than a period beyond.

        Raises
        ------
        InputError
            Duration or period is not above 0, there are more than `MOST` set points, or a value
            of the function is not finite.
        """
        t = _times(positive(duration, "duration", "s"), period)
        found = np.asarray(place(t), dtype=np.float64)
        if found.shape != t.shape:
            remedy = f"Return one position for each time, of shape {t.shape}."
            raise ProblemError("place", f"it gives an array of shape {found.shape}", remedy)
        if not np.isfinite(found).all():
            worst = int(np.argmin(np.isfinite(found)))
            problem = f"it gives {found[worst]} at {t[worst]:.6g} s"
            raise ProblemError("place", problem, "Return finite positions.")
        return cls(float(period), found)

    @classmethod
    def from_csv(cls, path: str | Path, column: str = "", period: float = PERIOD) -> Trajectory:
        """Sample a column of a CSV file, interpolated linearly between its rows.

        The format is that of a CSV programme: commas, points, `#` for comments, named units.

        Parameters
        ----------
        path : str | Path
            With t_s or t_ms, and positions such as x_mm, macro_mm or micro_um.
        column : str, optional
            Name of the column, if there are several.
        period : float, optional
            Interval of the set points, s.

        Returns
        -------
        Trajectory
            The first row's time becomes 0.

        Raises
        ------
        InputError
            Names the file and the line, or the column.
        """
        file = printable(path, 300)
        time, rows = "", list(csv_rows.table(read_text(Path(path), _WHAT), file, _header, _HEADER))
        if len(rows) < 2:
            raise ProblemError(file, "the file has fewer than two rows", "Give two or more.")
        names = list(rows[0].cells)
        time = next(name for name in names if name in _TIMES)
        places = [name for name in names if name != time]
        if column not in places and (column or len(places) > 1):
            raise InputError(
                f"{file}, column", column or "not given", f"one of {', '.join(places)}"
            )
        chosen = column or places[0]
        per = _PLACES[chosen.rpartition("_")[2]]
        t, x = np.empty(len(rows)), np.empty(len(rows))
        for k, row in enumerate(rows):
            t[k] = csv_rows.number(row.cells[time], f"{row.where}, {time}") / _TIMES[time]
            x[k] = csv_rows.number(row.cells[chosen], f"{row.where}, {chosen}") / per
            csv_rows.increasing(t[k], t[k - 1] if k else -math.inf, row.where)
        return cls(float(period), np.interp(_times(t[-1] - t[0], period), t - t[0], x))

    def then(self, following: Trajectory) -> Trajectory:
        """Append another trajectory.

        Parameters
        ----------
        following : Trajectory
            Of the same period; it begins where this one ends.

        Returns
        -------
        Trajectory
            Set points of both.

        Raises
        ------
        InputError
            The periods differ, or they do not meet.
        """
        if following.period != self.period:
            accepted = f"{self.period:g} s, that of the trajectory before it"
            raise InputError("following, period", following.period, accepted)
        here, there = float(self.position[-1]), float(following.position[0])
        if abs(here - there) > _MEET:
            found = f"it begins at {there:g} m, but the trajectory before it ends at {here:g} m"
            raise ProblemError("following", found, "Begin it there.")
        return Trajectory(self.period, np.concatenate((self.position, following.position[1:])))

    def check(
        self,
        lowest: float = -math.inf,
        highest: float = math.inf,
        *,
        velocity: float = math.inf,
        acceleration: float = math.inf,
    ) -> Trajectory:
        """Refuse a trajectory beyond some limits.

        Parameters
        ----------
        lowest : float, optional
            Bound of the positions, m.
        highest : float, optional
            Bound of the positions, m.
        velocity : float, optional
            Largest speed, m/s.
        acceleration : float, optional
            Largest acceleration either way, m/s^2.

        Returns
        -------
        Trajectory
            This one.

        Raises
        ------
        InputError
            A limit is exceeded; names the worst value and instant, and the limit.
        """
        beyond = np.maximum(self.position - highest, lowest - self.position)
        worst = int(np.argmax(beyond))
        if beyond[worst] > _SLACK * float(np.max(np.abs(self.position))):
            accepted = f"{lowest:g} to {highest:g} m"
            self._refuse("position", self.position, worst, "m", accepted)
        noise = 4.0 * np.finfo(float).eps * float(np.max(np.abs(self.position))) / self.period
        most = {"velocity": velocity, "acceleration": acceleration}
        units = {"velocity": "m/s", "acceleration": "m/s^2"}
        for name, values in (("velocity", self.velocity), ("acceleration", self.acceleration)):
            size = np.abs(values)
            worst = int(np.argmax(size >= size.max() * (1.0 - _SLACK)))  # of equals the first
            if size[worst] > most[name] * (1.0 + _SLACK) + noise:
                self._refuse(
                    name, values, worst, units[name], f"at most {most[name]:g} {units[name]}"
                )
            noise /= self.period
        return self

    def _refuse(self, name: str, values: Array, worst: int, unit: str, accepted: str) -> None:
        found = f"it is {values[worst]:.6g} {unit} at {worst * self.period:.6g} s"
        raise ProblemError(f"trajectory, {name}", found, f"Accepted: {accepted}.")


def _times(duration: float, period: float) -> Array:
    """From 0 in steps of the period up to the duration, or less than one period beyond."""
    step = positive(period, "period", "s")
    count = number(duration, "duration") / step
    if not count < MOST:
        raise InputError("period", period, f"a period with at most {MOST} set points")
    return np.arange(math.ceil(count * (1.0 - 1e-12)) + 1, dtype=np.float64) * step


def _header(cells: list[str], where: str) -> None:
    """Check that there is one time and at least one position."""
    times = [name for name in cells if name in _TIMES]
    places = [name for name in cells if name.rpartition("_")[2] in _PLACES and name not in times]
    if (
        len(times) != 1
        or not places
        or len(set(cells)) < len(times + places)
        or len(cells) > len(times + places)
    ):
        raise ProblemError(where, f"columns {printable(', '.join(cells), 80)}", f"Give {_HEADER}.")
