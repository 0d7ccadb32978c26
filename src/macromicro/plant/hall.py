"""Hall sensor sliding by two magnets of opposite poles (Section 3.2.3, Figures 3.7-3.9)."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro import nominal
from macromicro.kernel import kernel
from macromicro.plant import VARIANT
from macromicro.schema.par import Par


class Hall(NamedTuple):
    """Sensor and magnets. Each magnet's field falls off like a dipole's.

    The magnets stand 4 mm apart in the thesis; poles 5.8 mm apart are what gives (D6) the
    calibrated 0.8 um/mV within 0-5 V.
    """

    null: Annotated[float, Par("V", "output without field", "Section 3.2.3")] = 2.5
    gain: Annotated[
        float,
        Par("V", "output per unit of the two magnets' profile", "calibrated to D6", positive=True),
    ] = 3.322
    spacing: Annotated[
        float,
        Par(
            "m",
            "half the distance of the magnets' poles",
            "calibrated to D6",
            shown="mm",
            positive=True,
        ),
    ] = 2.9e-3
    width: Annotated[
        float,
        Par("m", "width of one magnet's profile", "calibrated to D6", shown="mm", positive=True),
    ] = 2.8e-3
    centre: Annotated[
        float,
        Par("m", "contraction with the sensor midway between them", "Section 3.2.3", shown="mm"),
    ] = 1.99e-3
    lag: Annotated[
        float, Par("s", "sensor's and filter's lag", "calibrated to S11, S13c", shown="ms", lo=0.0)
    ] = 3.0e-3
    noise: Annotated[
        float, Par("V", "noise before the converter (standard deviation)", shown="mV", lo=0.0)
    ] = 0.8e-3
    supply: Annotated[
        float, Par("V", "supply; the output stays between 0 and it", "Figure 3.8", positive=True)
    ] = nominal.HALL_SUPPLY
    null_drift: Annotated[
        float, Par("V/K", "temperature drift of the output without field", VARIANT, shown="mV/K")
    ] = 0.0
    gain_drift: Annotated[
        float, Par("1/K", "relative temperature drift of the gain", VARIANT, lo=-0.01, hi=0.01)
    ] = 0.0


@kernel
def profile(s: float) -> float:
    """Field of one magnet."""
    r = 1.0 + s * s
    return 1.0 / (r * math.sqrt(r))


@kernel
def volts(p: Hall, x: float, warm: float) -> float:
    """Output before lag and noise; saturates at 0 and the supply."""
    s = x - p.centre
    field = profile((s - p.spacing) / p.width) - profile((s + p.spacing) / p.width)
    level = p.null + p.null_drift * warm + p.gain * (1.0 + p.gain_drift * warm) * field
    return min(max(level, 0.0), p.supply)


@kernel
def lagged(p: Hall, level: float, x: float, warm: float, dt: float) -> float:
    """Output after one step: a first-order lag."""
    goal = volts(p, x, warm)
    if p.lag <= 0.0:
        return goal
    return goal + (level - goal) * math.exp(-dt / p.lag)
