"""Dead zone of the macro-stage (Section 4.2.3, Figure 4.8): low voltages from many places.

Only what a rig shows is used: commanded volts and encoder counts.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from macromicro.errors import InputError
from macromicro.identify.deadzone import DeadZone, dead_zone
from macromicro.recording import Recording
from macromicro.runs.drives import DT, open_loop
from macromicro.runs.machine import Machine

Array = npt.NDArray[np.float64]

TRAVEL = (0.0, 2800.0)
VOLTAGES = tuple(float(v) for v in np.round(np.arange(2.6, 3.301, 0.05), 2))
STARTS = tuple(float(x) for x in range(0, 2601, 200))
SECONDS = 2.5
HIGHEST, STEP, MORE = 4.5, 0.05, 6  # V, V, further voltages at a time


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
    4.5 V. Raises `InputError` where it stops there, too.
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
    """Dead zone of a bench by the whole procedure (M1)."""
    return probed(plant)[1]
