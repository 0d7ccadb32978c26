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
    """The sensor and its electronics; beyond its range it shows the end of the range."""

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


@kernel
def reading(p: Gauge, x: float, draw: float) -> float:
    """What the sensor shows: noise added, limited to the range, rounded to a step.

    Parameters
    ----------
    p : Gauge
        Parameters of the sensor.
    x : float
        Position, m.
    draw : float
        Standard normal number.

    Returns
    -------
    float
        m.
    """
    shown = min(max(x + p.noise * draw, p.low), p.high)
    return math.floor(shown / p.pitch + 0.5) * p.pitch


def repeats(p: Gauge, period: float) -> float:
    """How long a sensor that lives may show one and the same value at rest.

    A reading equals the one before it with at most the probability that the noise stays within one
    step. The time is twice that in which a run of equal readings has a chance of 1e-12.

    Parameters
    ----------
    p : Gauge
        Parameters of the sensor.
    period : float
        Control period, s.

    Returns
    -------
    float
        s, `SHORTEST` or more; 0 where the noise is too small beside a step to tell.
    """
    if p.noise <= 0.0:
        return 0.0
    same = math.erf(p.pitch / (2.0 * math.sqrt(2.0) * p.noise))
    if same >= LIVES:
        return 0.0
    return max(2.0 * period * math.log(1e-12) / math.log(same), SHORTEST)
