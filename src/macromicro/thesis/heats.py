"""Heatings of the micro-stage in open loop from cold, for `identify actuator`.

Long levels show the slow heat of plates and body, cooled steps and staircases the minor loops,
short pulses of full heat the lags.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from macromicro.arrays import Array
from macromicro.lab.drive import heated
from macromicro.lab.machine import Machine
from macromicro.nominal import PERIOD
from macromicro.recording import Recording

FULL = 2.1  # V: more gives hardly more heat
HELD = (1.5, 1.525, 1.55, 1.575, 1.6)
HELD_S = 200.0
STEPS = (1.4, 1.525, 1.575, 1.65, 1.7, 1.8, 1.9, FULL)
STAIRS = (1.55, 1.7, 1.45, 1.6, 1.3, 1.65, 1.5, 0.0, 1.8, 1.4, 1.575, 0.0)
# Level (V) and how long, s: bursts of full heat out of held places, and pauses.
BURSTS = (
    *((FULL, 0.35), (1.55, 2.0), (FULL, 0.08), (1.5, 2.0), (0.0, 0.3), (1.575, 2.0)),
    *((FULL, 0.05), (0.0, 0.15), (FULL, 0.05), (1.55, 2.0), (0.0, 0.6), (1.9, 0.15), (1.5, 2.0)),
    *((1.8, 0.1), (0.0, 0.2), (FULL, 0.1), (1.525, 2.0), (0.0, 2.0)),
)


def profiles() -> list[Array]:
    held = [_course(((v, HELD_S),)) for v in HELD]
    steps = [_course(((v, 10.0), (0.0, 20.0))) for v in STEPS]
    return [*held, *steps, _course([(v, 3.0) for v in STAIRS]), _course(BURSTS)]


def _course(parts: Iterable[tuple[float, float]]) -> Array:
    """CTRL that stays at each level for its time."""
    return np.concatenate([np.full(round(s / PERIOD), v) for v, s in parts])


def records(machine: Machine, seed: int = 0) -> Iterator[Recording]:
    """The runs, each from cold; long ones at 100 Hz."""
    for k, ctrl in enumerate(profiles()):
        yield heated(machine, ctrl, seed + k, 10 if len(ctrl) > 60_000 else 1)
