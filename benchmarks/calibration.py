"""How much some claims hang on what the bench assumes: their procedures on other benches.

    python benchmarks/calibration.py

prints one line a bench. `docs/make_bench.py` puts the same into
docs/validation/bench.md. Takes about a minute and a half.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from macromicro.runs import sequence
from macromicro.runs.programmed import on_twin
from macromicro.runs.sequence import micro_steps
from macromicro.schema.par import replaced
from macromicro.settings import Settings
from macromicro.thesis.chapter5 import electrothermal, micro_runs
from macromicro.thesis.chapter5.actuator_models import Models
from macromicro.thesis.chapter6 import integrated_runs
from macromicro.thesis.procedure import Lab

BELTS = (20.0, 21.0, 21.4, 21.8, 22.0, 22.2, 22.6, 23.0, 24.0)
BODIES = (0.0517, 0.065, 0.08, 0.1)
HEATS = (1.0, 1.1, 1.25, 1.5)


class BeltLine(NamedTuple):
    """Vibration over a belt frequency [Hz]: least, greatest [um]; slowest decay [s] (I2)."""

    frequency: float
    least: float
    greatest: float
    slowest: float


def belt_sensitivity(frequencies: tuple[float, ...] = BELTS) -> list[BeltLine]:
    """The default programme with other belt frequencies."""
    lines = []
    for frequency in frequencies:
        settings = replaced(Settings(), "bench.belt.frequency", frequency)
        single = integrated_runs.thesis_input(settings)
        found = integrated_runs.vibrations(on_twin(single, settings), single, settings)
        size = [v.amplitude_um for v in found]
        decay = [np.nan if v.decay_s is None else v.decay_s for v in found]
        lines.append(BeltLine(frequency, min(size), max(size), float(np.nanmax(decay))))
    return lines


class BodyLine(NamedTuple):
    """Body resistance (units of (5.6)): NRMSE of (5.6) [%] (S7); growth of the return to zero
    over ten cycles [%] and mean error of cycle 10 [um] (I3)."""

    resistance: float
    fit: float
    growth: float
    bias: float


def body_sensitivity(resistances: tuple[float, ...] = BODIES) -> list[BodyLine]:
    """Both procedures with other resistances from body to air, in units of 150 K/W."""
    lines = []
    for value in resistances:
        settings = replaced(Settings(), "bench.thermal.body_resistance", 150.0 * value)
        models = electrothermal.collect(Lab(settings))
        fit = np.nan
        if isinstance(models, Models):
            fit = electrothermal.against_5_6(models.thesis.heating.modes)
        single = integrated_runs.thesis_input(settings)
        warm = on_twin(single.repeated(integrated_runs.CYCLES), settings)
        found = integrated_runs.IntegratedRuns(settings, single, warm, warm, warm)
        cycles = integrated_runs.cycle_bias(found, warm).cycles
        first, last = cycles[0].extension_s or np.nan, cycles[-1].extension_s or np.nan
        growth, bias = 100.0 * (last / first - 1.0), cycles[-1].bias_um or np.nan
        lines.append(BodyLine(value, fit, growth, bias))
    return lines


class HeatLine(NamedTuple):
    """Heat at a CTRL of 5 V [W], and the error [um] that the wind-up of PI control leaves 1 s
    after the step from 3 to 2 mm (S12)."""

    heat: float
    error: float


def heat_sensitivity(factors: tuple[float, ...] = HEATS) -> list[HeatLine]:
    """PI control with more heat at the map's end, the rest of the map kept."""
    lines = []
    for factor in factors:
        base = Settings()
        *others, top = base.bench.driver.map_heat
        settings = replaced(base, "bench.driver.map_heat", (*others, factor * top))
        steps = micro_steps(sequence.LEVELS, 2.0, sequence.TIMES)
        run = on_twin(steps, micro_runs.with_law(settings, "pi"))
        lines.append(HeatLine(factor * top, micro_runs.error_after(run, sequence.TIMES[2])))
    return lines


if __name__ == "__main__":
    for line in (*belt_sensitivity(), *body_sensitivity(), *heat_sensitivity()):
        print(line)
