"""A record for the drive's parameters: pulses beyond the dead zone, both ways, in open loop."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from macromicro.experiments.macro_friction import TRAVEL
from macromicro.recording import Recording
from macromicro.runs.drives import open_loop
from macromicro.runs.machine import Machine

Array = npt.NDArray[np.float64]

LEVELS = (3.3, 3.6, 4.0, 4.4, 4.8, 5.0)  # V
REST_MS = 100
# What a pulse may take the carriage, about: a quarter of its travel [counts] at the thesis'
# speeds, 1700 counts/s at 3.1 V and 3977 counts/s at 4 V.
_WAY = 700.0
_GAIN, _ZONE = 2530.0, 2.43


def pulses(repeats: int = 2) -> Array:
    """Volts [a value each ms]: each level forth and back, with rests between."""
    rest = np.zeros(REST_MS)
    parts = [rest]
    for volts in LEVELS * repeats:
        held = round(min(1e3 * _WAY / (_GAIN * (volts - _ZONE)), 250.0))
        parts += [np.full(held, volts), rest, np.full(held, -volts), rest]
    return np.concatenate(parts)


def collect(plant: Machine, start: float = 0.5 * sum(TRAVEL)) -> Recording:
    """One record from rest at `start` [counts]: columns t, macro_position and motor."""
    return open_loop(plant, pulses(), start + 0.5)
