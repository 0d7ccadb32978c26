"""Open-loop runs of the macro-stage for dead zone, Coulomb level and drive (Section 4.2.3).

They use only what a rig shows: commanded volts and encoder counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.identify.deadzone import DeadZone, dead_zone
from macromicro.lab.drive import DT, open_loop
from macromicro.lab.machine import Machine
from macromicro.recording import Recording

TRAVEL = (0.0, 2800.0)
VOLTAGES = tuple(float(v) for v in np.round(np.arange(2.6, 3.301, 0.05), 2))
STARTS = tuple(float(x) for x in range(0, 2601, 200))
SECONDS = 2.5
HIGHEST, STEP, MORE = 4.5, 0.05, 6  # V, V, further voltages at a time

# Volts, and seconds in which the carriage stays within its travel at the thesis' speeds.
PUSHES = {3.1: 1.3, 3.25: 1.0, 3.5: 0.8, 4.0: 0.6, 4.5: 0.5, 5.0: 0.4}
START = 20.0  # counts, from the end it leaves
BEGUN = 0.15  # s, six time constants of the drive
PULSES = (3.3, 3.6, 4.0, 4.4, 4.8, 5.0)  # V
REST_MS = 100
# What a pulse may take the carriage, about: a quarter of its travel [counts] at the thesis'
# speeds, 1700 counts/s at 3.1 V and 3977 counts/s at 4 V.
_WAY = 700.0
_GAIN, _ZONE = 2530.0, 2.43


def collect(
    plant: Machine, voltages: Sequence[float] = VOLTAGES, starts: Sequence[float] = STARTS
) -> list[Recording]:
    """A run at each voltage [V], in both directions, from each start [counts, from its own end]."""
    runs = []
    n = round(SECONDS / DT)
    for v in voltages:
        for x in starts:
            # Half a count in, so that the encoder does not stand on an edge.
            runs.append(open_loop(plant, np.full(n, v), x + 0.5))
            runs.append(open_loop(plant, np.full(n, -v), TRAVEL[1] - x + 0.5))
    return runs


def probed(plant: Machine) -> tuple[list[Recording], DeadZone]:
    """The whole procedure (M1): its runs and the dead zone from them.

    Where the carriage still stops at the highest of `VOLTAGES`, higher ones are tried, up to
    4.5 V. If it stops there, too, the dead zone is an `InputError`.
    """
    runs, top = collect(plant), VOLTAGES[-1]
    while True:
        try:
            return runs, dead_zone(runs, travel=TRAVEL)
        except InputError:
            if top >= HIGHEST:
                raise
        further = [round(top + STEP * (k + 1), 2) for k in range(MORE)]
        runs += collect(plant, further)
        top = further[-1]


def measured(plant: Machine) -> DeadZone:
    return probed(plant)[1]


class Coulomb(NamedTuple):
    """Coulomb level and gain of both directions."""

    level: float  # F [V]
    gain: float  # G [counts/s/V]
    volts: Array  # signed steady states [V]
    speeds: Array  # signed steady states [counts/s]

    @property
    def taken(self) -> Array:
        """Friction [V] in each steady state: V - v / G."""
        return self.volts - self.speeds / self.gain


def pushed(plant: Machine) -> list[Recording]:
    """A run at each voltage of `PUSHES` in both directions, each from its own end."""
    runs = []
    for volts, seconds in PUSHES.items():
        n = round(seconds / DT)
        runs.append(open_loop(plant, np.full(n, volts), START + 0.5))
        runs.append(open_loop(plant, np.full(n, -volts), TRAVEL[1] - START + 0.5))
    return runs


def steady(run: Recording) -> tuple[float, float]:
    """Volts and steady speed [counts/s] of a run: the slope after `BEGUN`, within the travel."""
    x = run["macro_position"]
    # From the first sample beyond the travel on, the end stop has the carriage.
    gone = np.flatnonzero((x < TRAVEL[0]) | (x > TRAVEL[1]))
    rows = slice(round(BEGUN / run.dt), int(gone[0]) if len(gone) else len(x))
    if len(x[rows]) < 2:
        found = f"{run['motor'][0]:g} V, at the end of the travel within {BEGUN} s"
        raise ProblemError("steady speed", f"{found}", "Lengthen the travel.")
    return float(run["motor"][0]), float(np.polyfit(run["t"][rows], x[rows], 1)[0])


def fitted(runs: Sequence[Recording]) -> Coulomb:
    """F and G by least squares over the runs' steady states, |V| = F + |v| / G."""
    volts, speeds = np.array([steady(r) for r in runs]).T
    slope, level = np.polyfit(np.abs(speeds), np.abs(volts), 1)
    return Coulomb(float(level), 1.0 / float(slope), volts, speeds)


def at_rest(runs: Sequence[Recording], seconds: float = 0.5) -> Array:
    """Ascending volts [V] at which some run stood still for its last `seconds`."""
    held = set()
    for r in runs:
        x = r["macro_position"][-round(seconds / r.dt) :]
        if not np.ptp(x) and TRAVEL[0] < x[-1] < TRAVEL[1]:
            held.add(float(r["motor"][-1]))
    return np.array(sorted(held))


def pulses(repeats: int = 2) -> Array:
    """Volts [one value per ms]: each level forth and back, with rests between."""
    rest = np.zeros(REST_MS)
    parts = [rest]
    for volts in PULSES * repeats:
        held = round(min(1e3 * _WAY / (_GAIN * (volts - _ZONE)), 250.0))
        parts += [np.full(held, volts), rest, np.full(held, -volts), rest]
    return np.concatenate(parts)


def pulsed(plant: Machine, start: float = 0.5 * sum(TRAVEL)) -> Recording:
    """One record from rest at `start` [counts]: columns t, macro_position and motor."""
    return open_loop(plant, pulses(), start + 0.5)
