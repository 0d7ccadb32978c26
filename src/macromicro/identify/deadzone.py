"""Dead zone of an axis under Coulomb friction (Section 4.2.3), from runs at constant voltage."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.identify.notices import DataWarning, notice
from macromicro.identify.runs import Run, as_run
from macromicro.recording import Recording


class Trial(NamedTuple):
    """What became of one run."""

    volts: float  #: V, signed
    start: float  #: counts
    end: float  #: counts
    pause: float  #: the longest time without a new count before the end of the travel, s
    uninterrupted: bool  #: no pause longer than allowed
    arrived: bool  #: the record reached the end of the travel


class DeadZone(NamedTuple):
    """The lowest voltages with uninterrupted motion."""

    positive: float  #: V
    negative: float  #: V, as a magnitude
    width: float  #: the greater of both, V: what a dead-zone inverse adds
    trials: tuple[Trial, ...]  #: every run
    volts: Array  #: V, signed, ascending
    places: Array  #: centres of bins, counts
    #: mean speed there, counts/s (nan: never visited): where friction is greater the speed is
    #: lower, as in Figure 4.8
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

    A voltage passes if all runs at it and at every higher voltage of its direction were
    uninterrupted. The shortest wait for a first count is the rig's delay, and no interruption.
    Warns when the lowest voltage tried already passes.

    Parameters
    ----------
    recordings : Sequence[Recording | tuple[npt.ArrayLike, npt.ArrayLike, npt.ArrayLike]]
        Runs (t (s), u (V), x (counts)), or `Recording`s with the columns t, motor and
        macro_position, each at a constant voltage.
    travel : tuple[float, float] | None, optional
        Range (counts) that is judged, by default that of all runs together.
    pause : float, optional
        Longest time without a new count that is no interruption, s.
    bins : int, optional
        Number of positions in the speed map.

    Returns
    -------
    DeadZone
        Thresholds, and the mean speed by voltage and position.

    Raises
    ------
    InputError
        A direction is missing, a voltage varies, or none passes.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.identify import dead_zone
    >>> t = np.arange(0.0, 2.0, 0.01)
    >>> speeds = {-0.6: -100.0, -0.4: 0.0, 0.5: 0.0, 0.7: 200.0}  # V, counts/s
    >>> runs = [(t, 0.0 * t + volts, np.floor(v * t)) for volts, v in speeds.items()]
    >>> zone = dead_zone(runs)
    >>> zone.positive, zone.negative, zone.trials[2].uninterrupted  # V; at 0.5 V
    (0.7, 0.6, False)
    """
    runs = constant(recordings)
    both_ways(runs)
    low, high = covered_travel(runs, travel)
    ways = [_under_way(r, low, high) for r in runs]
    trials = find_trials(runs, (low, high), pause)
    positive, negative = (_lowest(trials, direction) for direction in (1.0, -1.0))
    volts, places, speeds = _map(runs, ways, np.linspace(low, high, bins + 1))
    width = max(positive, negative)
    return DeadZone(positive, negative, width, trials, volts, places, speeds)


def covered_travel(runs: Sequence[Run], travel: tuple[float, float] | None) -> tuple[float, float]:
    low, high = travel or (min(float(r.x.min()) for r in runs), max(float(r.x.max()) for r in runs))
    if not high > low:
        raise InputError("travel", (low, high), "a range with low < high, or runs that move")
    return low, high


def find_trials(
    runs: Sequence[Run], travel: tuple[float, float], pause: float
) -> tuple[Trial, ...]:
    ways = [_under_way(r, *travel) for r in runs]
    delay = min((_marks(r, way)[1] - 1) * r.dt for r, way in zip(runs, ways, strict=True))
    return tuple(_trial(r, way, pause, travel, delay) for r, way in zip(runs, ways, strict=True))


def constant(recordings: Sequence[Any]) -> list[Run]:
    runs = []
    for i, item in enumerate(recordings):
        run = as_run(item, f"recordings[{i}]")
        if np.ptp(run.u) > 1e-9 * np.abs(run.u).max() or run.u[0] == 0.0:
            found = f"it goes from {run.u.min():g} to {run.u.max():g} V"
            raise ProblemError(f"recordings[{i}].u", found, "Record one constant voltage, not 0.")
        runs.append(run)
    return runs


def both_ways(runs: Sequence[Run]) -> None:
    for sign, name in ((1.0, "positive"), (-1.0, "negative")):
        if not any(r.u[0] * sign > 0.0 for r in runs):
            remedy = "Record runs in both directions."
            raise ProblemError("recordings", f"there is no run at a {name} voltage", remedy)


def _under_way(run: Run, low: float, high: float) -> int:
    """Number of samples up to the end of the travel."""
    there = run.x >= high if run.u[0] > 0.0 else run.x <= low
    return int(there.argmax()) + 1 if there.any() else len(run.x)


def _marks(run: Run, way: int) -> npt.NDArray[np.intp]:
    """Samples with a new count in the direction, between the first and the last."""
    ahead = np.maximum.accumulate(np.sign(run.u[0]) * run.x[:way])
    return np.concatenate([[0], np.flatnonzero(np.diff(ahead) > 0.0) + 1, [way - 1]])


def _trial(
    run: Run, way: int, pause: float, travel: tuple[float, float], delay: float = 0.0
) -> Trial:
    """Outcome of a run; `delay` is the start-up wait of the quickest run, s."""
    direction, marks = np.sign(run.u[0]), _marks(run, way)
    waits = np.diff(marks) * run.dt
    waits[0] -= delay
    longest = max(float(waits.max()), 0.0)
    start, end = float(run.x[0]), float(run.x[way - 1])
    arrived = end >= travel[1] if direction > 0.0 else end <= travel[0]
    return Trial(float(run.u[0]), start, end, longest, longest <= pause, arrived)


def _lowest(trials: Sequence[Trial], direction: float) -> float:
    """The lowest voltage above which all trials of a direction were uninterrupted."""
    mine = [t for t in trials if t.volts * direction > 0.0]
    levels = sorted({abs(t.volts) for t in mine}, reverse=True)
    passed = np.nan
    for level in levels:
        if not all(t.uninterrupted for t in mine if abs(t.volts) == level):
            break
        passed = level
    if np.isnan(passed):
        problem = f"the motion is interrupted even at {levels[0] * direction:g} V"
        raise ProblemError("recordings", problem, "Record runs at higher voltages as well.")
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
            "assumed to be uninterrupted",
        )
    return passed


def _map(runs: list[Run], ways: list[int], edges: Array) -> tuple[Array, Array, Array]:
    """Voltages, bin centres and mean speeds [voltages, bins]: net travel over time."""
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


class Side(NamedTuple):
    """(4.5) for one direction."""

    a0: float  #: V
    delta: float  #: dimensionless
    a0_std: float  #: standard error, V; nan for two points
    delta_std: float  #: standard error; nan for two points
    volts: Array  #: voltages that it was fitted to, beyond the dead zone, as magnitudes, V
    speeds: Array  #: steady speeds, as magnitudes, counts/s


class DiscontinuousDeadZone(NamedTuple):
    """(4.5), Vout = (a0 + delta |V|) sgn V, per direction and for both together.

    V is the voltage before the dead-zone inverse, which adds `width`.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.identify import DiscontinuousDeadZone, Side
    >>> side = Side(0.1, 0.5, 0.01, 0.01, np.array([0.5, 1.0]), np.array([350.0, 600.0]))
    >>> DiscontinuousDeadZone(side, side, side, width=0.5, gain=1000.0).speed(0.5)  # counts/s
    350.0
    """

    positive: Side  #: forwards
    negative: Side  #: backwards
    both: Side  #: both directions together
    width: float  #: V
    gain: float  #: static gain b / (1 + a) of the linear model, counts/s/V

    def output(self, volts: float) -> float:
        """Vout of (4.5), by the side of its sign.

        Parameters
        ----------
        volts : float
            V before the dead-zone inverse, V.

        Returns
        -------
        float
            V.
        """
        side = self.positive if volts > 0.0 else self.negative
        return float(np.sign(volts)) * (side.a0 + side.delta * abs(volts))

    def speed(self, volts: float) -> float:
        """Steady speed (4.6).

        Parameters
        ----------
        volts : float
            V before the dead-zone inverse, V.

        Returns
        -------
        float
            counts/s.
        """
        return self.gain * self.output(volts)


def discontinuous_dead_zone(
    recordings: Sequence[Recording | tuple[npt.ArrayLike, npt.ArrayLike, npt.ArrayLike]],
    gain: float,
    width: float,
    *,
    steady: float = 0.5,
) -> DiscontinuousDeadZone:
    """a0 and delta of (4.5) from steady speeds, per direction (Section 4.2.5, (4.6)-(4.8)).

    speed / gain = a0 + delta V by least squares, with the slope of the last part of each run,
    averaged over runs of one voltage. The thesis has a0 0.364 V and delta 0.636 from 0.1 V and 1 V.

    Parameters
    ----------
    recordings : Sequence[Recording | tuple[npt.ArrayLike, npt.ArrayLike, npt.ArrayLike]]
        As for `dead_zone`, each at a constant voltage u beyond `width`, V = |u| - width; two
        voltages or more per direction.
    gain : float
        Static gain of the linear model, `LinearFit.gain`, counts/s/V.
    width : float
        Width of the dead-zone inverse, V.
    steady : float, optional
        Last part of a run, 0 to 1, in which its speed is steady.

    Returns
    -------
    DiscontinuousDeadZone
        Each direction, and both together.

    Raises
    ------
    InputError
        An option is not accepted, or the data are unusable.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.identify import discontinuous_dead_zone
    >>> t = np.arange(0.0, 2.0, 0.01)
    >>> speeds = {-1.0: -600.0, -0.5: -350.0, 0.5: 350.0, 1.0: 600.0}  # V beyond 0.5 V
    >>> runs = [(t, 0.0 * t + volts + 0.5 * np.sign(volts), v * t) for volts, v in speeds.items()]
    >>> zone = discontinuous_dead_zone(runs, gain=1000.0, width=0.5)  # counts/s/V, V
    >>> round(zone.both.a0, 3), round(zone.both.delta, 3)  # V, 1
    (0.1, 0.5)
    """
    if not (np.isfinite(gain) and gain > 0.0):
        raise InputError("gain", gain, "a finite number above zero")
    if not 0.0 < steady <= 1.0:
        raise InputError("steady", steady, "above 0, at most 1")
    runs = constant(recordings)
    both_ways(runs)
    points: dict[float, list[tuple[float, float]]] = {1.0: [], -1.0: []}
    for i, run in enumerate(runs):
        beyond = abs(float(run.u[0])) - width
        if beyond <= 0.0:
            raise InputError(f"recordings[{i}].u", float(run.u[0]), f"beyond +-{width:g} V")
        sign = float(np.sign(run.u[0]))
        first = int(len(run.t) * (1.0 - steady))
        slope = np.polyfit(run.t[first:] - run.t[first], run.x[first:], 1)[0]
        points[sign].append((round(beyond, 9), sign * float(slope)))
    forth, back = (_side(points[sign], gain, name) for sign, name in ((1.0, "+"), (-1.0, "-")))
    return DiscontinuousDeadZone(
        forth, back, _side(points[1.0] + points[-1.0], gain, "+-"), width, gain
    )


def _side(points: list[tuple[float, float]], gain: float, name: str) -> Side:
    """The line through (V, speed / gain), runs of one voltage averaged."""
    volts = np.unique([v for v, _ in points])
    if len(volts) < 2:
        found = f"{len(volts)} of at least two voltages were found in direction {name}"
        raise ProblemError("recordings", found, "Record more of them.")
    speeds = np.array([np.mean([s for v, s in points if v == level]) for level in volts])
    matrix = np.column_stack([np.ones_like(volts), volts])
    (a0, delta), *_ = np.linalg.lstsq(matrix, speeds / gain, rcond=None)
    errors = np.full(2, np.nan)
    if (free := len(volts) - 2) > 0:
        missed = speeds / gain - matrix @ np.array([a0, delta])
        spread = float(missed @ missed) / free * np.linalg.inv(matrix.T @ matrix)
        errors = np.sqrt(np.diag(spread))
    return Side(float(a0), float(delta), float(errors[0]), float(errors[1]), volts, speeds)
