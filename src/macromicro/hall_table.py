"""The Hall sensor's table of a virtual bench: the shipped one, or calibrated (Section 3.2.3)."""

from __future__ import annotations

import functools
from typing import Protocol

import numpy as np

from macromicro import loop
from macromicro.arrays import Array
from macromicro.control import calibration
from macromicro.control.calibration import Calibration
from macromicro.control.pi import PiAntiWindup
from macromicro.kernel import compiled
from macromicro.nominal import PERIOD
from macromicro.plant import bench
from macromicro.plant.bench import NOISES, Bench, Plant, Sensors
from macromicro.rig.twin import noise_source

DT = PERIOD
LOW, HIGH = 1.3, 1.72
RAMP_S, REST_S = 60.0, 5.0


class Described(Protocol):
    """Settings that describe a virtual bench."""

    @property
    def bench(self) -> Bench: ...

    @property
    def sensors(self) -> Sensors: ...


def profile(runs: int) -> tuple[Array, list[slice]]:
    """CTRL over all ramps, and the place of each one-way run."""
    n, rest = round(RAMP_S / DT), round(REST_S / DT)
    up = np.linspace(LOW, HIGH, n)
    one = np.concatenate([up, up[::-1], np.zeros(rest)])
    parts = []
    for k in range(runs):
        start = k * len(one)
        parts += [slice(start, start + n), slice(start + n, start + 2 * n)]
    return np.tile(one, runs), parts


def ramps(plant: Plant, seed: int = 0, runs: int = 3) -> list[tuple[Array, Array]]:
    """Hall voltage against laser on a twin, up and down in turn (Section 3.2.3)."""
    ctrl, parts = profile(runs)
    noise = noise_source(seed).standard_normal((len(ctrl), NOISES))
    out = np.empty((len(loop.STAGE), len(ctrl)))
    cold, given = bench.initial(plant), np.stack([np.zeros_like(ctrl), ctrl])
    compiled(loop.stage)(plant, cold, PiAntiWindup(), False, given, noise, out, 1, DT)
    hall, laser = out[loop.STAGE.index("hall")], out[loop.STAGE.index("laser")]
    return [(hall[part], laser[part]) for part in parts]


def is_needed(settings: Described) -> bool:
    """Whether the shipped calibration is void because sensor or converter were changed."""
    default = Sensors()
    hall = settings.sensors.hall._replace(noise=default.hall.noise, lag=default.hall.lag)
    return hall != default.hall or settings.sensors.converter != default.converter


def of_bench(settings: Described) -> Calibration:
    """The table for the virtual bench of these settings."""
    if not is_needed(settings):
        return calibration.default_calibration()
    return _calibrate(settings.bench, settings.sensors)


@functools.lru_cache(maxsize=16)
def _calibrate(described: Bench, sensors: Sensors) -> Calibration:
    from macromicro.identify.hall import calibrate  # scipy, which takes a while

    return calibrate(ramps(bench.prepare(described, sensors)))
