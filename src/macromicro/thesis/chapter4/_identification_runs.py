"""Open-loop identification of the macro-stage (Section 4.2.5): steps beyond the dead zone.

Ten steps of 1 V after the dead-zone inverse, alternately in both directions, averaged and
differentiated, give (4.3) by MLS; steady speeds at 0.1 V and 1 V give (4.5).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.identify.deadzone import DiscontinuousDeadZone, discontinuous_dead_zone
from macromicro.identify.linear import LinearFit, mls
from macromicro.identify.records import average_runs, differentiated
from macromicro.lab.drive import DT, open_loop
from macromicro.lab.machine import Machine
from macromicro.recording import Recording
from macromicro.rig.twin import noise_source
from macromicro.thesis.chapter4 import _friction_runs
from macromicro.thesis.chapter4._friction_runs import TRAVEL

WIDTH = 3.0  # Section 4.2.3: the thesis' width of the dead-zone inverse [V]
RUNS = 10
SECONDS = {0.1: 1.45, 1.0: 0.65, 2.0: 0.4}  # of Figure 4.13; 2 V reaches the end of travel


class MacroModel(NamedTuple):
    linear: LinearFit  # (4.3), speed [counts/s] for V [V] beyond the dead zone
    zone: DiscontinuousDeadZone  # a0 and delta of (4.5) from 0.1 V and 1 V
    speeds: dict[float, float]  # steady [counts/s] by V [V], mean of both directions


def collect(
    plant: Machine, seed: int = 0, width: float = WIDTH, runs: int = RUNS
) -> dict[float, list[Recording]]:
    """`runs` steps for each V [V], in alternating directions, from places near each end."""
    draw = noise_source(seed)
    found: dict[float, list[Recording]] = {}
    for volts, seconds in SECONDS.items():
        found[volts] = []
        for k in range(runs):
            sign = 1.0 if k % 2 == 0 else -1.0
            place = 20.0 + 60.0 * float(draw.random())
            start = place if sign > 0.0 else TRAVEL[1] - place
            steps = np.full(round(seconds / DT), sign * (width + volts))
            found[volts].append(open_loop(plant, steps, start))
    return found


def identified(recordings: Mapping[float, Sequence[Recording]], width: float = WIDTH) -> MacroModel:
    averaged = {
        volts: average_runs([_before_inverse(r, width) for r in runs])
        for volts, runs in recordings.items()
    }
    u, y = differentiated(*averaged[1.0], DT)
    linear = mls(u, y, na=1, nb=1, dt=DT)
    both = [r for volts in (0.1, 1.0) for r in recordings[volts]]
    zone = discontinuous_dead_zone(both, linear.gain, width)
    return MacroModel(linear, zone, {v: _steady(x) for v, (_, x) in averaged.items()})


def _before_inverse(recording: Recording, width: float) -> tuple[Array, Array]:
    """V and position, with the dead-zone inverse removed from the recorded volts."""
    motor = recording["motor"]
    return motor - width * np.sign(motor), recording["macro_position"]


def _steady(x: Array) -> float:
    """Speed over the second half [counts/s]."""
    half = x[len(x) // 2 :]
    return float(half[-1] - half[0]) / ((len(half) - 1) * DT)


def measured(plant: Machine, seed: int = 0) -> MacroModel:
    """The whole procedure on a bench (M2 to M6), with the dead zone by M1."""
    width = _friction_runs.measured(plant).width
    return identified(collect(plant, seed, width), width)
