"""What the virtual bench shows against what the thesis prints: the procedures, run anew.

    python benchmarks/calibration.py

prints one line a figure: claim, what it is, printed, accepted, measured, within or not.
Nothing is asserted here; the tests do that. Takes about half a minute.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from procedures import appendix_d, closed_loop, macro, micro
from procedures.figure import Figure

from macromicro.parameters import replaced
from macromicro.plant import bench
from macromicro.plant.bench import Sensors
from macromicro.settings import Settings


def figures(settings: Settings | None = None) -> list[Figure]:
    """Every figure above, in the order of the thesis."""
    settings = Settings() if settings is None else settings
    plant = bench.prepare(settings.bench, settings.sensors)
    return [
        *macro.figures(plant),
        *micro.figures(plant),
        *closed_loop.figures(settings),
        *micro.laser_at_rest(plant),
        *appendix_d.figures(),
    ]


class BeltLine(NamedTuple):
    """Vibration over a belt frequency [Hz]: least, greatest [um]; slowest decay [s]."""

    frequency: float
    least: float
    greatest: float
    slowest: float


def belt_sensitivity(frequencies: tuple[float, ...]) -> list[BeltLine]:
    """The default programme with other belt frequencies."""
    lines = []
    for frequency in frequencies:
        peak, decay = closed_loop.shaking(replaced(Settings(), "bench.belt.frequency", frequency))
        lines.append(
            BeltLine(frequency, float(peak.min()), float(peak.max()), float(np.nanmax(decay)))
        )
    return lines


class BodyLine(NamedTuple):
    """Body resistance (units of (5.6)): NRMSE of (5.6) [%], growth of the return to zero
    over ten cycles [%], largest bias in cycle 10 [um]."""

    resistance: float
    fit: float
    growth: float
    bias: float


def body_sensitivity(resistances: tuple[float, ...]) -> list[BodyLine]:
    """Ten cycles with other resistances from body to air, in units of 150 K/W."""
    lines = []
    for value in resistances:
        settings = replaced(Settings(), "bench.thermal.body_resistance", 150.0 * value)
        fit = micro.ladder_error(bench.prepare(settings.bench, Sensors()))
        warm = closed_loop.cycled(settings)
        lines.append(BodyLine(value, fit, 100.0 * (warm.last / warm.first - 1.0), warm.bias_last))
    return lines


def printed() -> str:
    """The table as text."""
    rows = figures()
    width = max(len(row.what) for row in rows)
    head = f"{'claim':6}{'figure':{width + 2}}{'printed':15}{'accepted':20}{'measured':>22}"
    lines = [head]
    for row in rows:
        value = f"{row.measured:.4g} {row.unit}".strip()
        mark = "" if row.within else "   OUTSIDE"
        text = f"{row.claim:6}{row.what:{width + 2}}{row.printed:15}{row.accepted:20}"
        lines.append(f"{text}{value:>22}{mark}")
    inside = sum(row.within for row in rows)
    lines.append(f"{inside} of {len(rows)} within what is accepted")
    return "\n".join(lines)


if __name__ == "__main__":
    print(printed())
