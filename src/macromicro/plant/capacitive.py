"""Capacitive position sensor of a piezo stage: noise, range, resolution."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.kernel import kernel
from macromicro.schema.par import Par


class Capacitive(NamedTuple):
    """The sensor and its electronics; beyond its range it shows the end of the range."""

    noise: Annotated[
        float,
        Par(
            "m",
            "noise (standard deviation), at the control period",
            "PI P-621.1CD: 0.4 nm resolution",
            shown="nm",
            lo=0.0,
        ),
    ] = 0.4e-9
    low: Annotated[
        float, Par("m", "lowest position that it shows", "bench assumption", shown="um", hi=0.0)
    ] = -25e-6
    high: Annotated[
        float, Par("m", "highest position that it shows", "bench assumption", shown="um", lo=0.0)
    ] = 125e-6
    pitch: Annotated[
        float,
        Par("m", "smallest step of the reading", "bench assumption", shown="nm", positive=True),
    ] = 0.1e-9


@kernel
def reading(p: Capacitive, x: float, draw: float) -> float:
    """What the sensor shows: noise added, limited to the range, rounded to a step.

    Parameters
    ----------
    p : Capacitive
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
