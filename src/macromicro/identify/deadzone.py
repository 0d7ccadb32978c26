"""Dead zone of an axis under Coulomb friction (Section 4.2.3).

From runs in open loop, each with one constant voltage, of both directions.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify.notices import DataWarning, notice
from macromicro.identify.runs import Run, as_run
from macromicro.recording import Recording


class Trial(NamedTuple):
    """What became of one run.

    Attributes
    ----------
    volts : float
        V, signed.
    start : float
        counts.
    end : float
        counts.
    pause : float
        The longest time without a new count before the end of the travel, s.
    uninterrupted : bool
        Whether it never paused for longer than was allowed.
    arrived : bool
        Whether the record lasted until the end of the travel.
    """

    volts: float
    start: float
    end: float
    pause: float
    uninterrupted: bool
    arrived: bool


class DeadZone(NamedTuple):
    """The lowest voltages with uninterrupted motion.

    Attributes
    ----------
    positive : float
        V.
    negative : float
        V, as a magnitude.
    width : float
        The greater of both, V: what a dead-zone inverse adds.
    trials : tuple[Trial, ...]
        Every run.
    volts : ndarray, shape (k,)
        V, signed, ascending.
    places : ndarray, shape (m,)
        Centres of bins, counts.
    speeds : ndarray, shape (k, m)
        Mean speed there, counts/s (nan: never visited): where friction is greater the speed is
        lower, as in Figure 4.8.
    """

    positive: float
    negative: float
    width: float
    trials: tuple[Trial, ...]
    volts: Array
    places: Array
    speeds: Array

    def thresholds(self, direction: int) -> tuple[Array, Array]:
        """Starts and the lowest voltage that moved on from there to the end.

        Parameters
        ----------
        direction : int
            1 or -1.

        Returns
        -------
        starts : ndarray, shape (k,)
            counts.
        lowest : ndarray, shape (k,)
            V, as a magnitude; nan where no voltage did.
        """
        mine = [t for t in self.trials if t.volts * direction > 0.0]
        starts = np.unique([t.start for t in mine])
        lowest = [
            min((abs(t.volts) for t in mine if t.start == s and t.uninterrupted), default=np.nan)
            for s in starts
        ]
        return starts, np.array(lowest)


def dead_zone(
    recordings: Sequence[Recording | tuple[npt.ArrayLike, npt.ArrayLike, npt.ArrayLike]],
    *,
    travel: tuple[float, float] | None = None,
    pause: float = 0.05,
    bins: int = 28,
) -> DeadZone:
    """Lowest voltage that gives uninterrupted motion from every start (Section 4.2.3, Figure 4.8).

    A voltage passes when all runs at it and at every higher voltage of its direction were
    uninterrupted. What even the run that starts soonest waits for its first count is the rig's
    delay, and no interruption. Warns when the lowest one tried already passes.

    Parameters
    ----------
    recordings : Sequence[Recording | tuple[npt.ArrayLike, npt.ArrayLike, npt.ArrayLike]]
        Runs (t (s), u (V), x (counts)), or `Recording`s with the columns t, motor and
        macro_position, each at a constant voltage, from one or several starts.
    travel : tuple[float, float] | None, optional
        Range (counts) over which motion counts, by default what all runs cover together.
    pause : float, optional
        A longer time without a new count is an interruption, s.
    bins : int, optional
        Number of places of the speed map.

    Returns
    -------
    DeadZone
        Thresholds, and the mean speed by voltage and place.

    Raises
    ------
    InputError
        A direction is missing, a voltage varies, or none passes.
    """
    runs = constant(recordings)
    both_ways(runs)
    low, high = covered(runs, travel)
    ways = [_under_way(r, low, high) for r in runs]
    trials = tried(runs, (low, high), pause)
    positive, negative = (_lowest(trials, direction) for direction in (1.0, -1.0))
    volts, places, speeds = _map(runs, ways, np.linspace(low, high, bins + 1))
    width = max(positive, negative)
    return DeadZone(positive, negative, width, trials, volts, places, speeds)


def covered(runs: Sequence[Run], travel: tuple[float, float] | None) -> tuple[float, float]:
    """The range over which motion counts.

    Parameters
    ----------
    runs : Sequence[Run]
        Runs.
    travel : tuple[float, float] | None
        As asked for; None: what all runs cover together.

    Returns
    -------
    tuple[float, float]
        Lowest and highest place.

    Raises
    ------
    InputError
        It is none.
    """
    low, high = travel or (min(float(r.x.min()) for r in runs), max(float(r.x.max()) for r in runs))
    if not high > low:
        raise InputError("travel", (low, high), "low below high: runs that move")
    return low, high


def tried(runs: Sequence[Run], travel: tuple[float, float], pause: float) -> tuple[Trial, ...]:
    """What became of each run of one constant voltage.

    Parameters
    ----------
    runs : Sequence[Run]
        Runs; what even the one that starts soonest waits for its first count is the rig's delay.
    travel : tuple[float, float]
        Range over which motion counts.
    pause : float
        A longer time without a new count is an interruption, s.

    Returns
    -------
    tuple[Trial, ...]
        One each.
    """
    ways = [_under_way(r, *travel) for r in runs]
    delay = min((_marks(r, way)[1] - 1) * r.dt for r, way in zip(runs, ways, strict=True))
    return tuple(_trial(r, way, pause, travel, delay) for r, way in zip(runs, ways, strict=True))


def constant(recordings: Sequence[Any]) -> list[Run]:
    """Checked runs with one voltage each, other than zero.

    Parameters
    ----------
    recordings : Sequence[Any]
        As for `dead_zone`.

    Returns
    -------
    list[Run]
        As many.

    Raises
    ------
    InputError
        A voltage varies, or is 0.
    """
    runs = []
    for i, item in enumerate(recordings):
        run = as_run(item, f"recordings[{i}]")
        if np.ptp(run.u) > 1e-9 * np.abs(run.u).max() or run.u[0] == 0.0:
            found = f"{run.u.min():g} to {run.u.max():g} V"
            raise InputError(f"recordings[{i}].u", found, "one constant voltage other than 0")
        runs.append(run)
    return runs


def both_ways(runs: Sequence[Run]) -> None:
    """Refuse runs of one direction alone.

    Parameters
    ----------
    runs : Sequence[Run]
        Runs of one voltage each.

    Raises
    ------
    InputError
        A direction is missing.
    """
    for sign, name in ((1.0, "positive"), (-1.0, "negative")):
        if not any(r.u[0] * sign > 0.0 for r in runs):
            raise InputError("recordings", f"no {name} voltage", "runs in both directions")


def _under_way(run: Run, low: float, high: float) -> int:
    """Number of samples up to the first at the end of the travel."""
    there = run.x >= high if run.u[0] > 0.0 else run.x <= low
    return int(there.argmax()) + 1 if there.any() else len(run.x)


def _marks(run: Run, way: int) -> npt.NDArray[np.intp]:
    """Samples with a new count on the way, between the first and the last."""
    ahead = np.maximum.accumulate(np.sign(run.u[0]) * run.x[:way])
    return np.concatenate([[0], np.flatnonzero(np.diff(ahead) > 0.0) + 1, [way - 1]])


def _trial(
    run: Run, way: int, pause: float, travel: tuple[float, float], delay: float = 0.0
) -> Trial:
    """`delay`: what even the quickest run waits at its start, s; no pause of this one."""
    direction, marks = np.sign(run.u[0]), _marks(run, way)
    waits = np.diff(marks) * run.dt
    waits[0] -= delay
    longest = max(float(waits.max()), 0.0)
    start, end = float(run.x[0]), float(run.x[way - 1])
    arrived = end >= travel[1] if direction > 0.0 else end <= travel[0]
    return Trial(float(run.u[0]), start, end, longest, longest <= pause, arrived)


def _lowest(trials: Sequence[Trial], direction: float) -> float:
    """The lowest voltage from which on all trials of a direction were uninterrupted."""
    mine = [t for t in trials if t.volts * direction > 0.0]
    levels = sorted({abs(t.volts) for t in mine}, reverse=True)
    passed = np.nan
    for level in levels:
        if not all(t.uninterrupted for t in mine if abs(t.volts) == level):
            break
        passed = level
    if np.isnan(passed):
        found = f"motion interrupted even at {levels[0] * direction:g} V"
        raise InputError("recordings", found, "runs at higher voltages too")
    if passed == levels[-1]:
        notice(
            DataWarning,
            f"the lowest voltage tried, {passed * direction:g} V, already gives uninterrupted "
            "motion; the dead zone is at most this",
        )
    short = sum(not t.arrived for t in mine if abs(t.volts) == passed)
    if short:
        notice(
            DataWarning,
            f"{short} runs at {passed * direction:g} V ended before the end of the travel; "
            "taken as uninterrupted all the way",
        )
    return passed


def _map(runs: list[Run], ways: list[int], edges: Array) -> tuple[Array, Array, Array]:
    """Voltages, bin centres and mean speeds [voltages, bins], net travel over time spent."""
    volts = np.unique([r.u[0] for r in runs])
    count = len(edges) - 1
    time, gone = np.zeros((2, len(volts), count))
    for run, way in zip(runs, ways, strict=True):
        row = int(np.searchsorted(volts, run.u[0]))
        place = np.clip(np.searchsorted(edges, run.x[: way - 1], side="right") - 1, 0, count - 1)
        np.add.at(time[row], place, run.dt)
        np.add.at(gone[row], place, np.diff(run.x[:way]))
    with np.errstate(invalid="ignore", divide="ignore"):
        speeds = np.where(time > 0.0, gone / time, np.nan)
    return volts, 0.5 * (edges[1:] + edges[:-1]), speeds
