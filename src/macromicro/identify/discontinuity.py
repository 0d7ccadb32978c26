"""Voltage beyond the dead zone of an axis, (4.5) to (4.8) (Section 4.2.5)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.identify.deadzone import both_ways, constant
from macromicro.recording import Recording


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
