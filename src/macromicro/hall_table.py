"""The Hall sensor's table of a virtual bench: the shipped one, or calibrated on that bench.

Whoever opens a twin takes its table from here, so that no twin with another Hall sensor is
driven by the table of the default one. The laboratory procedure is that of Section 3.2.3:
slow ramps of CTRL, the Hall sensor against the laser.
"""

from __future__ import annotations

import functools
from typing import Protocol

import numpy as np

from macromicro import loop
from macromicro.arrays import Array
from macromicro.control import calibration
from macromicro.control.calibration import Calibration
from macromicro.control.pi import PiAntiWindup
from macromicro.identify.hall import calibrate
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
    def bench(self) -> Bench:
        """The bench."""

    @property
    def sensors(self) -> Sensors:
        """Its sensors."""


def profile(runs: int) -> tuple[Array, list[slice]]:
    """CTRL over all ramps, and where each one-way run lies in it.

    Parameters
    ----------
    runs : int
        How often up and down, `RAMP_S` each way, with a rest behind.

    Returns
    -------
    ctrl : ndarray, shape (n,)
        V, a sample every `DT`.
    parts : list[slice]
        2 x `runs` slices of `ctrl`: up, down, up, ...
    """
    n, rest = round(RAMP_S / DT), round(REST_S / DT)
    up = np.linspace(LOW, HIGH, n)
    one = np.concatenate([up, up[::-1], np.zeros(rest)])
    parts = []
    for k in range(runs):
        start = k * len(one)
        parts += [slice(start, start + n), slice(start + n, start + 2 * n)]
    return np.tile(one, runs), parts


def ramps(plant: Plant, seed: int = 0, runs: int = 3) -> list[tuple[Array, Array]]:
    """Runs of Hall voltage against the laser on a twin, up and down in turn (Section 3.2.3).

    Parameters
    ----------
    plant : Plant
        The bench, prepared.
    seed : int, optional
        Seed of the sensor noise.
    runs : int, optional
        How often up and down.

    Returns
    -------
    list[tuple[Array, Array]]
        Pairs of Hall sensor (V) and laser (m), shape (n,) each, two per run.
    """
    ctrl, parts = profile(runs)
    noise = noise_source(seed).standard_normal((len(ctrl), NOISES))
    out = np.empty((6, len(ctrl)))
    cold = bench.initial(plant)
    compiled(loop.stage)(plant, cold, PiAntiWindup(), False, ctrl, noise, out, 1, DT)
    return [(out[2, part], out[1, part]) for part in parts]


def needed(settings: Described) -> bool:
    """Whether the shipped calibration is void, because sensor or converter were changed.

    A real bench whose sensor was exchanged would have to be calibrated anew as well.

    Parameters
    ----------
    settings : Described
        Whose bench and sensors are compared with the default ones. The sensor's noise and lag do
        not count.

    Returns
    -------
    bool
        True if the table must be measured on that bench.
    """
    default = Sensors()
    hall = settings.sensors.hall._replace(noise=default.hall.noise, lag=default.hall.lag)
    return hall != default.hall or settings.sensors.converter != default.converter


def of_bench(settings: Described) -> Calibration:
    """The table that holds for the virtual bench of these settings.

    Parameters
    ----------
    settings : Described
        Bench and sensors.

    Returns
    -------
    Calibration
        The shipped table, or one measured on that bench (kept, so that it is measured once).

    Raises
    ------
    InputError
        The sensor cannot be calibrated: it does not rise over half of the range.
    """
    if not needed(settings):
        return _shipped()
    return _calibrated(settings.bench, settings.sensors)


_shipped = functools.cache(calibration.shipped)


@functools.lru_cache(maxsize=16)
def _calibrated(described: Bench, sensors: Sensors) -> Calibration:
    return calibrate(ramps(bench.prepare(described, sensors)))
