"""Open-loop steps of CTRL on the micro-stage (Section 5.2.2, Figures 5.10 and 5.16).

From full extension and room temperature, three trials at each voltage, the laser as the
sensor. Steps below the stop are held 200 s, those that reach it 20 s.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.lab.drive import DT, heated
from macromicro.lab.machine import Machine
from macromicro.recording import Recording

BELOW_STOP = (1.5, 1.525, 1.55, 1.575, 1.6)
ABOVE_STOP = (1.65, 1.7, 1.8)
UNSEEN = (1.625, 1.675, 1.75)
TRIALS = 3
HELD_S = 200.0
HELD_AT_STOP_S = 20.0
COOLED = (1.525, 1.55, 1.575, 1.6)
COOL_AFTER_S, COOL_S = 10.0, 20.0
WARM, CYCLES_BEFORE = 1.575, 4  # V; "cycled a few times"


def step(volts: float, seconds: float) -> Array:
    """CTRL [V] of one step, one value per ms."""
    return np.full(round(seconds / DT), volts)


def cooling(volts: float, hold: float = COOL_AFTER_S, rest: float = COOL_S) -> Array:
    """CTRL [V] of a step held `hold` [s], then 0 V for `rest` [s]."""
    return np.concatenate([step(volts, hold), step(0.0, rest)])


def staircase(levels: Sequence[float], seconds: float = 3.0) -> Array:
    """CTRL [V] that stays `seconds` at each level."""
    return np.concatenate([step(v, seconds) for v in levels])


class StepData(NamedTuple):
    """Recordings by voltage [V]; `warm`: 1.575 V cooled once more after a few cycles."""

    steps: dict[float, list[Recording]]
    cooled: dict[float, list[Recording]]
    warm: tuple[Recording, ...]


def last_of(recording: Recording, seconds: float) -> Recording:
    rows = slice(-round(seconds / recording.dt), None)
    arrays = [
        recording[c.name][rows] - (recording[c.name][rows][0] if c.name == "t" else 0.0)
        for c in recording.columns
    ]
    return Recording.from_arrays(recording.columns, arrays, recording.dt, recording.attributes)


def collect(machine: Machine, seed: int) -> StepData:
    """The whole procedure on a bench.

    Long runs are recorded at 100 Hz, others at 1 kHz. Voltages above 1.625 V reach the stop.
    """

    def runs(ctrl: Array, first: int) -> list[Recording]:
        every = 10 if len(ctrl) > 60_000 else 1
        return [heated(machine, ctrl, first + k, every) for k in range(TRIALS)]

    steps = {
        v: runs(step(v, HELD_S if v < 1.625 else HELD_AT_STOP_S), seed + 100 * i)
        for i, v in enumerate(BELOW_STOP + ABOVE_STOP)
    }
    down = {v: runs(cooling(v), seed + 5000 + 100 * i) for i, v in enumerate(COOLED)}
    again = np.tile(cooling(WARM), CYCLES_BEFORE + 1)
    cycled = [heated(machine, again, seed + 9000 + k, 1) for k in range(TRIALS)]
    warm = tuple(last_of(r, COOL_AFTER_S + COOL_S) for r in cycled)
    return StepData(steps, down, warm)


def for_fit(machine: Machine, seed: int) -> list[Recording]:
    """Runs for the better model's fit: long steps below the stop, with cooling, and a staircase."""
    profiles = [step(v, HELD_S) for v in BELOW_STOP]
    profiles += [cooling(v, 10.0, 20.0) for v in (1.4, 1.525, 1.575, *ABOVE_STOP, 1.9)]
    levels = (1.55, 1.7, 1.45, 1.6, 1.3, 1.65, 1.5, 0.0, 1.8, 1.4, 1.575, 0.0)
    profiles.append(staircase(levels))
    return [
        heated(machine, ctrl, seed + k, 10 if len(ctrl) > 60_000 else 1)
        for k, ctrl in enumerate(profiles)
    ]


def for_judgement(machine: Machine, seed: int) -> dict[str, Recording]:
    volts = (1.575, *ABOVE_STOP, *UNSEEN)
    profiles = {f"{v:g} V": cooling(v, HELD_AT_STOP_S, 20.0) for v in volts}
    up = (1.4, 1.5, 1.55, 1.575, 1.6, 1.65, 1.6, 1.55, 1.5, 1.4, 0.0)
    wild = (1.8, 1.35, 1.62, 0.0, 1.7, 1.5, 1.58, 1.45, 1.66, 1.2, 1.56, 0.0)
    profiles["staircase"] = staircase(up, 4.0)
    profiles["minor loops"] = staircase(wild, 2.0)
    return {name: heated(machine, c, seed + k) for k, (name, c) in enumerate(profiles.items())}
