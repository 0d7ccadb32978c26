"""Coulomb friction of the macro-stage read off steady speeds (Section 4.2.1, Figure 4.4).

Under viscous and Coulomb friction alone the steady speed v of a constant voltage V obeys
V = F sgn v + v / G. With G from a line through all steady states, V - v / G is what the
friction takes at each speed. Only what a rig shows is used: volts and encoder counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.errors import InputError
from macromicro.experiments.macro_friction import TRAVEL
from macromicro.recording import Recording
from macromicro.runs.drives import DT, open_loop
from macromicro.runs.machine import Machine

Array = npt.NDArray[np.float64]

# Volts, and seconds in which the carriage stays within its travel at the thesis' speeds.
LEVELS = {3.1: 1.3, 3.25: 1.0, 3.5: 0.8, 4.0: 0.6, 4.5: 0.5, 5.0: 0.4}
START = 20.0  # counts, from the end it leaves
BEGUN = 0.15  # s, six time constants of the drive


class Coulomb(NamedTuple):
    """`level` F [V] and `gain` G [counts/s/V], both directions together; `volts` [V] and
    `speeds` [counts/s] are the steady states, signed."""

    level: float
    gain: float
    volts: Array
    speeds: Array

    @property
    def taken(self) -> Array:
        """What the friction takes [V] in each steady state: V - v / G."""
        return self.volts - self.speeds / self.gain


def collect(plant: Machine) -> list[Recording]:
    """A run at each voltage of `LEVELS` in both directions, each from its own end."""
    runs = []
    for volts, seconds in LEVELS.items():
        n = round(seconds / DT)
        runs.append(open_loop(plant, np.full(n, volts), START + 0.5))
        runs.append(open_loop(plant, np.full(n, -volts), TRAVEL[1] - START + 0.5))
    return runs


def steady(run: Recording) -> tuple[float, float]:
    """Volts and steady speed [counts/s] of a run: the slope after `BEGUN`, within the travel.

    Raises `InputError` for a run that is over by then.
    """
    x = run["macro_position"]
    # From the first sample beyond the travel on, the end stop has the carriage.
    gone = np.flatnonzero((x < TRAVEL[0]) | (x > TRAVEL[1]))
    rows = slice(round(BEGUN / run.dt), int(gone[0]) if len(gone) else len(x))
    if len(x[rows]) < 2:
        found = f"{run['motor'][0]:g} V, at the end of the travel within {BEGUN} s"
        raise InputError("steady speed", found, "a longer way")
    return float(run["motor"][0]), float(np.polyfit(run["t"][rows], x[rows], 1)[0])


def fitted(runs: Sequence[Recording]) -> Coulomb:
    """F and G by least squares over the runs' steady states, |V| = F + |v| / G."""
    volts, speeds = np.array([steady(r) for r in runs]).T
    slope, level = np.polyfit(np.abs(speeds), np.abs(volts), 1)
    return Coulomb(float(level), 1.0 / float(slope), volts, speeds)


def at_rest(runs: Sequence[Recording], seconds: float = 0.5) -> Array:
    """Volts [V], ascending, under which some run stood still for its last `seconds` within
    the travel: there the friction took all of them."""
    held = set()
    for r in runs:
        x = r["macro_position"][-round(seconds / r.dt) :]
        if not np.ptp(x) and TRAVEL[0] < x[-1] < TRAVEL[1]:
            held.add(float(r["motor"][-1]))
    return np.array(sorted(held))
