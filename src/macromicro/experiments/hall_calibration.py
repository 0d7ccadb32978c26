"""Hall calibration (Section 3.2.3, Figure 3.9): slow ramps of CTRL, Hall against the laser.

``python -m macromicro.experiments.hall_calibration FILE`` runs it on the default twin
and writes the table that the controller uses, as ``hall_V,position_mm``.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import numpy.typing as npt

from macromicro.control.calibration import Calibration
from macromicro.experiments.machine import Machine, idle_law, play
from macromicro.identify.hall import calibrate
from macromicro.kernel import compiled, kernel
from macromicro.nominal import PERIOD
from macromicro.plant import bench
from macromicro.plant.bench import NOISES, Bench, Plant, Sensors, State
from macromicro.rig.session import Fixture
from macromicro.rig.twin import noise_source
from macromicro.settings import Settings
from macromicro.types import Outputs

Array = npt.NDArray[np.float64]

DT = PERIOD
LOW, HIGH = 1.3, 1.72
RAMP_S, REST_S = 60.0, 5.0


@kernel
def _open_loop(p: Plant, s: State, ctrl: Array, noise: Array, out: Array, dt: float) -> State:
    """Open loop on the twin: Hall [V] and laser [m] into `out` (2, periods)."""
    for k in range(len(ctrl)):
        sample = bench.measure(p, s, k * dt, noise[k, 0], noise[k, 1])
        out[0, k] = sample.hall
        out[1, k] = sample.laser
        s = bench.advance(p, s, Outputs(0.0, ctrl[k], 0.0, 0.0), noise[k, 2], dt)
    return s


def profile(runs: int) -> tuple[Array, list[slice]]:
    """CTRL [V] over all ramps, and where each one-way run lies in it."""
    n, rest = round(RAMP_S / DT), round(REST_S / DT)
    up = np.linspace(LOW, HIGH, n)
    one = np.concatenate([up, up[::-1], np.zeros(rest)])
    parts = []
    for k in range(runs):
        start = k * len(one)
        parts += [slice(start, start + n), slice(start + n, start + 2 * n)]
    return np.tile(one, runs), parts


def collect(plant: Machine, seed: int = 0, runs: int = 3) -> list[tuple[Array, Array]]:
    """Runs of (Hall [V], laser [mm]), up and down in turn."""
    ctrl, parts = profile(runs)
    if isinstance(plant, Fixture):
        plant.need("the Hall calibration", "hall", "laser")
        done = play(plant, "Hall calibration", len(ctrl), idle_law(None, ctrl), seed=seed)
        return [(done["hall"][part], done["laser"][part] * 1e3) for part in parts]
    noise = noise_source(seed).standard_normal((len(ctrl), NOISES))
    out = np.empty((2, len(ctrl)))
    compiled(_open_loop)(plant, bench.initial(plant), ctrl, noise, out, DT)
    return [(out[0, part], out[1, part] * 1e3) for part in parts]


def table(plant: Machine | None = None, seed: int = 0) -> Calibration:
    """The calibration of a bench, by default of the twin.

    Raises `InputError` when its CTRL ramps do not move the stage over half of the range.
    """
    return calibrate(collect(plant or bench.prepare(Bench(), Sensors()), seed))


def needed(settings: Settings) -> bool:
    """Is the shipped calibration void, because sensor or converter were changed?

    A real bench whose sensor was exchanged would have to be calibrated anew as well.
    """
    default = Sensors()
    hall = settings.sensors.hall._replace(noise=default.hall.noise, lag=default.hall.lag)
    return hall != default.hall or settings.sensors.converter != default.converter


def for_bench(settings: Settings) -> Calibration | None:
    """The calibration of a bench with another Hall sensor; None where the shipped one holds."""
    if not needed(settings):
        return None
    return table(bench.prepare(settings.bench, settings.sensors))


def as_csv(result: Calibration) -> str:
    """The table as the file that ``macromicro.control.calibration`` reads."""
    lines = ["# Hall calibration of the default bench: Section 3.2.3, three runs up and down"]
    lines.append("hall_V,position_mm")
    lines += [f"{result.low + i * result.step:.4f},{x:.6f}" for i, x in enumerate(result.position)]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(as_csv(table()), encoding="utf-8")
