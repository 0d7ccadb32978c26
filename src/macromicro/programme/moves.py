"""What a programme is: a list of moves as columns, and how far the stages may go."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray

from macromicro.errors import InputError
from macromicro.place import LENGTH, Place
from macromicro.units import shown

MACRO, MICRO = 0, 1
MAX_HOLD = 3600.0
CLOCKED = -math.inf  # `start` of a profile's set point in a mixed programme
MAX_MOVES = 1_000_000
# A trajectory has FEWEST targets or more, typically one every LONGEST [s] at the latest.
FEWEST, LONGEST = 20, 0.25
MAX_TITLE = 200  # characters
WHAT = "a motion programme (.toml or .csv)"


class Limits(NamedTuple):
    """How far the stages go.

    Attributes
    ----------
    macro_lo : float
        counts.
    macro_hi : float
        counts.
    micro_lo : float
        m.
    micro_hi : float
        m.
    counts_per_metre : float
        Scales lengths, or angles: counts per rad.
    place : Place
        What the macro-stage's places are given in.
    """

    macro_lo: float
    macro_hi: float
    micro_lo: float
    micro_hi: float
    counts_per_metre: float
    place: Place = LENGTH


class Span(NamedTuple):
    """The part of a programme that is one motion profile.

    Attributes
    ----------
    stage : int
        MACRO or MICRO.
    begin : float
        When it begins, s; NaN: as soon as what is before it is complete.
    finish : float
        When its last target comes, s, or NaN.
    until : float
        When its hold ends, s, or NaN.
    origin : float
        Where it begins, m.
    target : float
        Where it ends, m.
    first : int, optional
        Its first row in the programme.
    behind : int, optional
        The row behind its last one.
    """

    stage: int
    begin: float
    finish: float
    until: float
    origin: float
    target: float
    first: int = 0
    behind: int = 0


_NOTHING = np.empty(0)


class Programme(NamedTuple):
    """A list of moves; all arrays have one element a move.

    Attributes
    ----------
    title : str
        For people.
    start : ndarray, shape (n,)
        Earliest start after the run's beginning, s; NaN: as soon as the move before is complete;
        `CLOCKED`: when the hold of the one before is over, arrived or not.
    stage : ndarray, shape (n,)
        MACRO or MICRO.
    target : ndarray, shape (n,)
        counts for macro, m for micro.
    hold : ndarray, shape (n,)
        How long the target is held after the move's arrival (sequenced), or the time from `start`
        to the next change (scheduled), s.
    end : float
        When the programme ends, s; NaN: after the last hold.
    source : str
        The file.
    profiles : tuple[Span, ...], optional
        The motion profiles: all targets belong to one of a scheduled programme, some of a mixed
        one, none of a programme of moves.
    correction : ndarray, shape (n,) or (0,), optional
        What was learned to give the micro-stage's law beyond each target, m; (0,): nothing.
    """

    title: str
    start: NDArray[np.float64]
    stage: NDArray[np.int64]
    target: NDArray[np.float64]
    hold: NDArray[np.float64]
    end: float
    source: str
    profiles: tuple[Span, ...] = ()
    correction: NDArray[np.float64] = _NOTHING

    @property
    def set_points(self) -> NDArray[np.float64]:
        """What the laws are given: targets with what was learned beyond them, shape (n,)."""
        return self.target + self.correction if len(self.correction) else self.target

    @property
    def scheduled(self) -> bool:
        """True if the moves have absolute times."""
        return not math.isnan(self.end)

    @property
    def mixed(self) -> bool:
        """True if there are moves and profiles, one after the other."""
        return bool(self.profiles) and not self.scheduled

    @property
    def moves(self) -> NDArray[np.bool_]:
        """Which rows are no set points of a profile, shape (n,)."""
        found = np.ones(len(self.target), dtype=bool)
        for span in self.profiles:
            found[span.first : span.behind] = False
        return found

    @property
    def numbers(self) -> NDArray[np.int64]:
        """Number of each row's move or profile as people count them, from 1, shape (n,)."""
        begins = self.moves
        begins[[span.first for span in self.profiles]] = True
        return np.cumsum(begins)

    @property
    def waiting(self) -> NDArray[np.bool_]:
        """Which rows wait for an arrival before the next one begins, shape (n,)."""
        found: NDArray[np.bool_] = np.append(self.start[1:] != CLOCKED, True)
        return found if not self.scheduled else np.zeros_like(found)

    def repeated(self, n: int) -> Programme:
        """The programme several times in a row; a scheduled one is shifted by its end each time.

        Parameters
        ----------
        n : int
            How often.

        Returns
        -------
        Programme
            With n times the moves.

        Raises
        ------
        InputError
            `n` is below 1, or gives more than `MAX_MOVES` moves; or profiles end elsewhere than
            where they begin.
        """
        size = len(self.target)
        most = MAX_MOVES // size
        if not 1 <= n <= most:
            raise InputError("cycles", n, f"a whole number from 1 to {most}")
        if n > 1 and self._away():
            accepted = "1, or profiles that come back to where they begin"
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
                p._replace(
                    begin=p.begin + t,
                    finish=p.finish + t,
                    until=p.until + t,
                    first=p.first + k * size,
                    behind=p.behind + k * size,
                )
                for k, t in enumerate(shift.tolist())
                for p in self.profiles
            ),
        )

    def from_rest(self) -> tuple[Span, ...]:
        """The profiles that begin where their stage stands at the beginning, at 0.

        Returns
        -------
        tuple[Span, ...]
            Those of stages whose first motion is a profile. A macro move before it lets the
            micro-stage go, back to 0.
        """
        coarse = np.flatnonzero(self.stage == MACRO)
        firsts = [int(coarse[0])] if len(coarse) else []
        fine = np.flatnonzero(self.stage == MICRO)
        if len(fine) and not (len(coarse) and coarse[0] < fine[0]):
            firsts.append(int(fine[0]))
        return tuple(p for p in self.profiles if p.first in firsts)

    def _away(self) -> bool:
        """Whether a stage whose first motion is a profile ends elsewhere than where that begins."""
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
    """One move: a row of a `Programme`.

    Attributes
    ----------
    start : float
        s, or NaN.
    stage : int
        MACRO or MICRO.
    target : float
        counts or m.
    hold : float
        s.
    correction : float, optional
        m.
    """

    start: float
    stage: int
    target: float
    hold: float
    correction: float = 0.0


def programme(title: str, moves: Sequence[Move], end: float, path: Path) -> Programme:
    """The columns of some moves.

    Parameters
    ----------
    title : str
        For people.
    moves : Sequence[Move]
        One or more.
    end : float
        When it ends, s; NaN: after the last hold.
    path : Path
        The file.

    Returns
    -------
    Programme
        Arrays of one element a move.
    """
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
    """Whether targets are a trajectory instead of moves: many, all the time.

    Parameters
    ----------
    start : array_like, shape (n,)
        When each is due, s.

    Returns
    -------
    bool
        By their number and the median of their distances.
    """
    times = np.asarray(start, dtype=float)
    return len(times) >= FEWEST and float(np.median(np.diff(times))) <= LONGEST


def admitted(value: float, stage: int, limits: Limits, where: str, text: str) -> float:
    """A target, if the stage can go there.

    Parameters
    ----------
    value : float
        counts or m.
    stage : int
        MACRO or MICRO.
    limits : Limits
        How far the stages go.
    where : str
        File, move and key, for the message.
    text : str
        What the user wrote.

    Returns
    -------
    float
        counts (rounded to whole ones) or m.

    Raises
    ------
    InputError
        It cannot; names the range.
    """
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
