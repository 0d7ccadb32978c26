"""References: instruments that measure where a stage truly is."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array


class Instrument(NamedTuple):
    """A simulated reference; it was set to the machine's position at the start."""

    title: str
    noise: float  # standard deviation of a reading at rest, m or rad
    drift: float  # standard deviation of what it drifts in a minute, m or rad
    step: float = 0.0  # of its display, m or rad

    def read(self, t: Array, true: Array, random: np.random.Generator) -> Array:
        """Readings of true positions at some times (s)."""
        gone = np.diff(t, prepend=0.0) / 60.0
        shape = (len(t), *([1] * (true.ndim - 1)))
        walk = np.cumsum(random.standard_normal(true.shape) * np.sqrt(gone).reshape(shape), axis=0)
        return self.shown(true, walk, random)

    def shown(self, true: Array | float, walk: Array | float, random: np.random.Generator) -> Array:
        """Readings of true positions, after a random walk of unit variance in a minute."""
        found = true + self.drift * walk + self.noise * random.standard_normal(np.shape(true))
        return np.asarray(np.round(found / self.step) * self.step if self.step > 0.0 else found)


# A laser interferometer in still air, an incremental glass scale, a dial gauge, a camera over a
# grid plate; for stages that turn an autocollimator with a polygon.
INSTRUMENTS: Mapping[str, Instrument] = {
    "laser": Instrument("laser interferometer", 0.1e-6, 0.2e-6),
    "scale": Instrument("glass scale", 0.2e-6, 0.05e-6, 0.1e-6),
    "camera": Instrument("camera over a grid plate", 0.5e-6, 0.1e-6),
    "capacitive": Instrument("capacitive sensor", 0.5e-9, 0.2e-9),
    "dial": Instrument("dial gauge", 1e-6, 0.5e-6, 1e-6),
    "autocollimator": Instrument(
        "autocollimator", math.radians(0.1 / 3600.0), math.radians(0.05 / 3600.0)
    ),
}
LENGTHS, ANGLES = ("laser", "scale", "camera", "capacitive", "dial"), ("autocollimator",)
