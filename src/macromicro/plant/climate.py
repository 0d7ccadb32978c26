"""Temperature of an axis, and the growth of its drive with it."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.kernel import kernel
from macromicro.schema.par import Par

REFERENCE = 20.0  # degC, at which lengths are defined (ISO 1)
_MEASURED = "data sheet or measurement"


class Climate(NamedTuple):
    start: Annotated[float, Par("degC", "temperature of the drive at the start")] = REFERENCE
    rise: Annotated[float, Par("K", "how far it warms")] = 0.0
    time: Annotated[float, Par("s", "time constant of that", positive=True)] = 600.0
    expansion: Annotated[
        float,
        Par("1/K", "growth of the drive with temperature, from the place 0", _MEASURED),
    ] = 0.0
    sensor: Annotated[
        int, Par("", "1: the drive has a temperature sensor", "data sheet or drawing", lo=0, hi=1)
    ] = 0
    resolution: Annotated[
        float, Par("K", "step of that sensor", "data sheet or drawing", positive=True)
    ] = 0.0625


@kernel
def advanced(p: Climate, degrees: float, dt: float) -> float:
    """The temperature a time later."""
    if p.rise == 0.0:
        return degrees
    return degrees + (p.start + p.rise - degrees) * (1.0 - math.exp(-dt / p.time))


@kernel
def growth(p: Climate, degrees: float) -> float:
    """Relative growth of the drive."""
    return p.expansion * (degrees - REFERENCE)


@kernel
def shown(p: Climate, degrees: float) -> float:
    """What its sensor says; NaN without one."""
    if p.sensor == 0:
        return math.nan
    return p.resolution * math.floor(degrees / p.resolution + 0.5)
