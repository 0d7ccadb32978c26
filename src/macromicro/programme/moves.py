"""A programme as columns of moves, and the travel of the stages."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray

from macromicro.errors import InputError
from macromicro.motion.profile import Profile
from macromicro.nominal import PERIOD
from macromicro.place import LENGTH, Place
from macromicro.units import shown

MACRO, MICRO = 0, 1
STAGES = {"macro": MACRO, "micro": MICRO}
TO = "to"  # key of the only stage of a machine
MAX_HOLD = 3600.0
CLOCKED = -math.inf  # `start` of a profile's set point in a mixed programme
MAX_MOVES = 1_000_000
# A trajectory has FEWEST targets or more, typically one every LONGEST [s] at the latest.
FEWEST, LONGEST = 20, 0.25
_SHORTEST = 5  # control periods of a profile whose set points are computed in each of them
MAX_TITLE = 200  # characters
WHAT = "a motion programme (.toml or .csv)"


class Limits(NamedTuple):
    """Travel of the stages.

    Examples
    --------
    >>> from macromicro.programme import Limits
    >>> limits = Limits(0.0, 40_000.0, 0.0, 4e-3, counts_per_metre=2e5)
    >>> limits.macro_hi / limits.counts_per_metre  # m
    0.2
    """

    macro_lo: float  #: counts
    macro_hi: float  #: counts
    micro_lo: float  #: m
    micro_hi: float  #: m
    counts_per_metre: float  #: scales lengths, or angles: counts per rad
    place: Place = LENGTH  #: what the macro-stage's places are given in
    #: whether the macro-stage is the only stage, which needs no name and follows polynomials
    alone: bool = False
    period: float = PERIOD  #: control period, s

    @property
    def names(self) -> dict[str, int]:
        """Keys of the stages in a programme."""
        return {TO: MACRO} if self.alone else STAGES

    @property
    def either(self) -> str:
        """These keys in words."""
        return " or ".join(self.names)

    @property
    def shortest(self) -> int:
        """Control periods that a profile has at least."""
        return _SHORTEST if self.alone else FEWEST


class Span(NamedTuple):
    """The part of a programme that is one motion profile."""

    stage: int  #: MACRO or MICRO
    begin: float  #: when it begins, s; NaN: as soon as what is before it is complete
    finish: float  #: when its last target comes, s, or NaN
    until: float  #: when its hold ends, s, or NaN
    origin: float  #: where it begins, m
    target: float  #: where it ends, m
    first: int = 0  #: its first row in the programme
    behind: int = 0  #: the row behind its last one
    #: its polynomials, m; None: a trajectory, of which the rows are all that is known
    profile: Profile | None = None
    scale: float = 1.0  #: units of its rows' targets per m

    def moved(self, t: float, rows: int) -> Span:
        """The same part of a programme, later and behind other rows.

        Parameters
        ----------
        t : float
            s; NaN: at no known time.
        rows : int
            Number of rows before it.

        Returns
        -------
        Span
            A copy.
        """
        return self._replace(
            begin=self.begin + t,
            finish=self.finish + t,
            until=self.until + t,
            first=self.first + rows,
            behind=self.behind + rows,
        )


_NOTHING = np.empty(0)


class Programme(NamedTuple):
    """A list of moves; all arrays have one element a move."""

    title: str  #: for people
    #: earliest start after the run's beginning, s; NaN: as soon as the move before is complete;
    #: `CLOCKED`: when the hold of the one before is over, arrived or not
    start: NDArray[np.float64]
    stage: NDArray[np.int64]  #: MACRO or MICRO
    target: NDArray[np.float64]  #: counts for macro, m for micro
    #: how long the target is held after the move's arrival (sequenced), or the time from `start` to
    #: the next change (scheduled), s
    hold: NDArray[np.float64]
    end: float  #: when the programme ends, s; NaN: after the last hold
    source: str  #: the file
    #: the motion profiles: all targets belong to one of a scheduled programme, some of a mixed one,
    #: none of a programme of moves
    profiles: tuple[Span, ...] = ()
    #: what was learned to give the micro-stage's law beyond each target, m; (0,): nothing
    correction: NDArray[np.float64] = _NOTHING

    @property
    def set_points(self) -> NDArray[np.float64]:
        """Set points for the laws: targets with learned corrections, shape (n,)."""
        return self.target + self.correction if len(self.correction) else self.target

    @property
    def scheduled(self) -> bool:
        """Whether the moves have absolute times."""
        return not math.isnan(self.end)

    @property
    def mixed(self) -> bool:
        """Whether moves and profiles follow each other."""
        return bool(self.profiles) and not self.scheduled

    @property
    def moves(self) -> NDArray[np.bool_]:
        """Rows that are not set points of a profile, shape (n,)."""
        found = np.ones(len(self.target), dtype=bool)
        for span in self.profiles:
            found[span.first : span.behind] = False
        return found

    @property
    def numbers(self) -> NDArray[np.int64]:
        """Number of each row's move or profile, from 1, shape (n,)."""
        begins = self.moves
        begins[[span.first for span in self.profiles]] = True
        return np.cumsum(begins)

    @property
    def waiting(self) -> NDArray[np.bool_]:
        """Rows that wait for an arrival before the next one begins, shape (n,)."""
        found: NDArray[np.bool_] = np.append(self.start[1:] != CLOCKED, True)
        return found if not self.scheduled else np.zeros_like(found)

    def repeated(self, n: int) -> Programme:
        """The programme several times in a row; a scheduled one is shifted by its end each time.

        Parameters
        ----------
        n : int
            Number of repetitions.

        Returns
        -------
        Programme
            With n times the moves.

        Raises
        ------
        InputError
            `n` is below 1 or gives more than `MAX_MOVES` moves, or profiles do not return to
            their start.
        """
        size = len(self.target)
        most = MAX_MOVES // size
        if not 1 <= n <= most:
            raise InputError("cycles", n, f"a whole number from 1 to {most}")
        if n > 1 and self._away():
            accepted = "1, or profiles that return to their start"
            raise InputError("cycles", n, accepted)
        shift = np.arange(n) * (self.end if self.scheduled else 0.0)
        return self._replace(
            start=np.tile(self.start, n) + np.repeat(shift, size),
            stage=np.tile(self.stage, n),
            target=np.tile(self.target, n),
            hold=np.tile(self.hold, n),
            end=self.end * n,
            correction=np.tile(self.correction, n),
            profiles=tuple(
                p.moved(t, k * size) for k, t in enumerate(shift.tolist()) for p in self.profiles
            ),
        )

    def from_rest(self) -> tuple[Span, ...]:
        """The profiles that begin at rest at 0.

        Returns
        -------
        tuple[Span, ...]
            Those of stages whose first motion is a profile. A macro move before it resets the
            micro-stage to 0.
        """
        coarse = np.flatnonzero(self.stage == MACRO)
        firsts = [int(coarse[0])] if len(coarse) else []
        fine = np.flatnonzero(self.stage == MICRO)
        if len(fine) and not (len(coarse) and coarse[0] < fine[0]):
            firsts.append(int(fine[0]))
        return tuple(p for p in self.profiles if p.first in firsts)

    def _away(self) -> bool:
        """Whether a stage that begins with a profile ends elsewhere than it began."""
        for first in self.from_rest():
            last = int(np.flatnonzero(self.stage == first.stage)[-1])
            place = float(self.target[last])
            place = next((p.target for p in self.profiles if p.behind == last + 1), place)
            if first.stage == MICRO and (self.stage[last:] == MACRO).any():
                place = 0.0
            if place != first.origin:
                return True
        return False


class Move(NamedTuple):
    start: float  # s, or NaN
    stage: int  # MACRO or MICRO
    target: float  # counts or m
    hold: float  # s
    correction: float = 0.0  # m


def programme(title: str, moves: Sequence[Move], end: float, path: Path) -> Programme:
    start, stage, target, hold, learned = zip(*moves, strict=True)
    correction = np.array(learned, dtype=np.float64)
    return Programme(
        title=title,
        start=np.array(start, dtype=np.float64),
        stage=np.array(stage, dtype=np.int64),
        target=np.array(target, dtype=np.float64),
        hold=np.array(hold, dtype=np.float64),
        end=end,
        source=str(path),
        correction=correction if correction.any() else _NOTHING,
    )


def dense(start: npt.ArrayLike) -> bool:
    """Whether targets are so many and so close that they are a trajectory instead of moves.

    Parameters
    ----------
    start : array_like, shape (n,)
        Time of each, s.

    Returns
    -------
    bool
        By their number and the median of their distances.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.programme import dense
    >>> dense(np.arange(0.0, 10.0, 0.1)), dense([0.0, 2.0, 6.0])
    (True, False)
    """
    times = np.asarray(start, dtype=float)
    return len(times) >= FEWEST and float(np.median(np.diff(times))) <= LONGEST


def check_target(value: float, stage: int, limits: Limits, where: str, text: str) -> float:
    if stage == MICRO:
        if limits.micro_lo <= value <= limits.micro_hi:
            return value
        lo, hi = (shown(x, "m", "mm", 6) for x in (limits.micro_lo, limits.micro_hi))
        raise InputError(where, text, f"{lo} to {hi}")
    counts = float(math.floor(value + 0.5)) if math.isfinite(value) else value
    if limits.macro_lo <= counts <= limits.macro_hi:
        return counts
    ends = (limits.macro_lo, limits.macro_hi)
    lo, hi = (limits.place.told(x / limits.counts_per_metre) for x in ends)
    raise InputError(where, text, f"{lo} to {hi} ({ends[0]:.0f} to {ends[1]:.0f} counts)")
