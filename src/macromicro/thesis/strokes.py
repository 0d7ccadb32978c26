"""Strokes of the carriage in open loop, from rest to rest, for `identify carriage`.

Pulses of many lengths and efforts, in alternating directions, show drag, friction, delay and
swing.
"""

from __future__ import annotations

import numpy as np

from macromicro.arrays import Array
from macromicro.columns import Column
from macromicro.lab.drive import drive, recorded
from macromicro.lab.machine import Machine
from macromicro.recorded import columns_named
from macromicro.recording import Recording

COLUMNS: tuple[Column, ...] = columns_named("t", "macro_position", "motor", "laser")
WHAT = "strokes of the macro-stage"
# Share of the full effort, and its length in ms.
PULSES = (
    *((1.0, 20), (1.0, 40), (1.0, 80), (1.0, 160), (0.9, 60), (0.9, 150), (0.8, 80), (0.8, 200)),
    *((0.72, 120), (0.72, 250), (1.0, 240), (1.0, 3), (1.0, 5), (0.9, 5), (0.66, 250), (1.0, 8)),
    *((0.8, 8), (1.0, 12), (0.66, 120), (0.9, 20), (1.0, 30), (0.8, 30)),
)
REST = 300  # ms after each
# Share of the full effort, far below breakaway, and lengths in ms that keep no step with a swing.
NUDGE, LENGTHS, TIMES = 0.05, (23, 41, 31, 59, 37, 29, 53), 8


def efforts(full: float) -> Array:
    rest = np.zeros(REST)
    parts = [rest]
    for share, length in PULSES:
        for way in (1.0, -1.0):
            parts += [np.full(length, way * share * full), rest]
    return np.concatenate(parts)


def nudges(full: float) -> Array:
    """Alternating efforts below breakaway, which show the compliance."""
    rest, low = np.zeros(REST), NUDGE * full
    lengths = LENGTHS * TIMES
    parts = [np.full(n, low if k % 2 == 0 else -low) for k, n in enumerate(lengths)]
    return np.concatenate([rest, *parts, rest])


def stroke(machine: Machine, volts: Array, start: float, seed: int = 0) -> Recording:
    """The carriage in open loop from `start` [counts], with the laser where there is one."""
    cold = np.zeros_like(volts)
    found = drive(machine, WHAT, ("encoder",), cold, motor=volts, start=start, seed=seed)
    return recorded(machine, COLUMNS, found, about={"seed": seed})
