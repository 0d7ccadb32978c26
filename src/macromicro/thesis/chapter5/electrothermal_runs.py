"""Open-loop runs of CTRL on the micro-stage (Section 5.2.2, Figures 5.10 and 5.16).

From full extension and room temperature, three trials at each voltage, the laser as the
sensor. Steps below the stop are held 200 s, those that reach it 20 s. Long runs are recorded at
100 Hz, others at 1 kHz.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
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
STAIRS = (1.55, 1.7, 1.45, 1.6, 1.3, 1.65, 1.5, 0.0, 1.8, 1.4, 1.575, 0.0)
FULL = 2.1  # V: more gives hardly more heat
STEPS = (1.4, 1.525, 1.575, 1.65, 1.7, 1.8, 1.9, FULL)
# Level (V) and how long, s: bursts of full heat out of held places, and pauses.
BURSTS = (
    *((FULL, 0.35), (1.55, 2.0), (FULL, 0.08), (1.5, 2.0), (0.0, 0.3), (1.575, 2.0)),
    *((FULL, 0.05), (0.0, 0.15), (FULL, 0.05), (1.55, 2.0), (0.0, 0.6), (1.9, 0.15), (1.5, 2.0)),
    *((1.8, 0.1), (0.0, 0.2), (FULL, 0.1), (1.525, 2.0), (0.0, 2.0)),
)


def step(volts: float, seconds: float) -> Array:
    """CTRL [V] of one step, one value per ms."""
    return np.full(round(seconds / DT), volts)


def course(parts: Iterable[tuple[float, float]]) -> Array:
    """CTRL that stays at each level [V] for its time [s]."""
    return np.concatenate([step(v, s) for v, s in parts])


def cooling(volts: float, hold: float = COOL_AFTER_S) -> Array:
    """CTRL [V] of a step held `hold` [s], then 0 V for 20 s."""
    return course([(volts, hold), (0.0, COOL_S)])


def staircase(levels: Sequence[float], seconds: float = 3.0) -> Array:
    """CTRL [V] that stays `seconds` at each level."""
    return course([(v, seconds) for v in levels])


def record(machine: Machine, ctrl: Array, seed: int) -> Recording:
    """One run from cold."""
    return heated(machine, ctrl, seed, 10 if len(ctrl) > 60_000 else 1)


def record_all(machine: Machine, profiles: Iterable[Array], seed: int) -> list[Recording]:
    return [record(machine, ctrl, seed + k) for k, ctrl in enumerate(profiles)]


class StepData(NamedTuple):
    """Recordings by voltage [V]; `warm`: 1.575 V cooled once more after a few cycles."""

    steps: dict[float, list[Recording]]
    cooled: dict[float, list[Recording]]
    warm: tuple[Recording, ...]


def last_of(recording: Recording, seconds: float) -> Recording:
    rows = slice(-round(seconds / recording.dt), None)
    start = {"t": recording["t"][rows][0]}
    arrays = [recording[c.name][rows] - start.get(c.name, 0.0) for c in recording.columns]
    return Recording.from_arrays(recording.columns, arrays, recording.dt, recording.attributes)


def collect(machine: Machine, seed: int) -> StepData:
    """The whole procedure on a bench; voltages above 1.625 V reach the stop."""
    steps = {
        v: record_all(machine, [step(v, _held(v))] * TRIALS, seed + 100 * i)
        for i, v in enumerate(BELOW_STOP + ABOVE_STOP)
    }
    down = {
        v: record_all(machine, [cooling(v)] * TRIALS, seed + 5000 + 100 * i)
        for i, v in enumerate(COOLED)
    }
    again = np.tile(cooling(WARM), CYCLES_BEFORE + 1)
    cycled = [heated(machine, again, seed + 9000 + k, 1) for k in range(TRIALS)]
    warm = tuple(last_of(r, COOL_AFTER_S + COOL_S) for r in cycled)
    return StepData(steps, down, warm)


def _held(volts: float) -> float:
    return HELD_S if volts < 1.625 else HELD_AT_STOP_S


def for_fit(machine: Machine, seed: int) -> list[Recording]:
    """Runs for the better model's fit: long steps below the stop, with cooling, and a staircase."""
    profiles = [step(v, HELD_S) for v in BELOW_STOP]
    profiles += [cooling(v) for v in (1.4, 1.525, 1.575, *ABOVE_STOP, 1.9)]
    return record_all(machine, [*profiles, staircase(STAIRS)], seed)


def actuator_profiles() -> list[Array]:
    """CTRL for `identify actuator`.

    Long levels show the slow heat of plates and body, cooled steps and staircases the minor loops,
    short pulses of full heat the lags.
    """
    held = [step(v, HELD_S) for v in BELOW_STOP]
    return [*held, *(cooling(v) for v in STEPS), staircase(STAIRS), course(BURSTS)]


def for_actuator(machine: Machine, seed: int = 0) -> list[Recording]:
    """The runs for `identify actuator`."""
    return record_all(machine, actuator_profiles(), seed)


def for_judgement(machine: Machine, seed: int) -> dict[str, Recording]:
    volts = (1.575, *ABOVE_STOP, *UNSEEN)
    profiles = {f"{v:g} V": cooling(v, HELD_AT_STOP_S) for v in volts}
    up = (1.4, 1.5, 1.55, 1.575, 1.6, 1.65, 1.6, 1.55, 1.5, 1.4, 0.0)
    wild = (1.8, 1.35, 1.62, 0.0, 1.7, 1.5, 1.58, 1.45, 1.66, 1.2, 1.56, 0.0)
    profiles["staircase"] = staircase(up, 4.0)
    profiles["minor loops"] = staircase(wild, 2.0)
    return {name: heated(machine, c, seed + k) for k, (name, c) in enumerate(profiles.items())}
