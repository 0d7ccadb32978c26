"""Absolute position sensor, such as a capacitive one: noise, range, resolution."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.kernel import kernel
from macromicro.schema.par import Par

_SHEET = "data sheet"
SHORTEST = 0.15  # s
LIVES = 0.97  # chance of an equal reading beyond which a sensor at rest may well repeat itself


class Gauge(NamedTuple):
    """Sensor and electronics; clamps beyond its range."""

    noise: Annotated[
        float,
        Par("m", "noise (standard deviation), at the control period", _SHEET, shown="nm", lo=0.0),
    ] = 0.4e-9
    low: Annotated[
        float, Par("m", "lowest position that it shows", _SHEET, shown="um", hi=0.0)
    ] = -25e-6
    high: Annotated[
        float, Par("m", "highest position that it shows", _SHEET, shown="um", lo=0.0)
    ] = 125e-6
    pitch: Annotated[
        float, Par("m", "smallest step of the reading", _SHEET, shown="nm", positive=True)
    ] = 0.1e-9
    linearity: Annotated[
        float,
        Par("1", "greatest bow of the reading, as a share of the range", _SHEET, lo=-0.1, hi=0.1),
    ] = 0.0


@kernel
def reading(p: Gauge, x: float, draw: float) -> float:
    """Bow and noise added, limited to the range, rounded to a step."""
    if p.linearity != 0.0:
        share = (x - p.low) / (p.high - p.low)
        x += p.linearity * (p.high - p.low) * 4.0 * share * (1.0 - share)
    shown = min(max(x + p.noise * draw, p.low), p.high)
    return math.floor(shown / p.pitch + 0.5) * p.pitch


def repeats(p: Gauge, period: float) -> float:
    """Time after which a noisy sensor that repeats one value must be faulty.

    Twice the time in which a run of equal readings has a chance of 1e-12.
    """
    if p.noise <= 0.0:
        return 0.0
    same = math.erf(p.pitch / (2.0 * math.sqrt(2.0) * p.noise))
    if same >= LIVES:
        return 0.0
    return max(2.0 * period * math.log(1e-12) / math.log(same), SHORTEST)
