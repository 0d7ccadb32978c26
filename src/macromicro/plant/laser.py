"""Laser interferometer: measures from its last reset, with the air's noise (Section 6.4.1)."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.kernel import kernel
from macromicro.plant import VARIANT
from macromicro.schema.par import Par


class Laser(NamedTuple):
    """Noise in two parts: fast (vibration, electronics) and slow (air).

    The thesis gives their sum only, 2 um half peak-to-peak (Figure 6.6).
    """

    noise: Annotated[
        float, Par("m", "fast noise (standard deviation)", "calibrated to I5", shown="um", lo=0.0)
    ] = 0.43e-6
    drift: Annotated[
        float, Par("m", "slow noise (standard deviation)", "calibrated to I5", shown="um", lo=0.0)
    ] = 0.15e-6
    drift_time: Annotated[float, Par("s", "correlation time of the slow noise", positive=True)] = (
        0.3
    )
    resolution: Annotated[
        float, Par("m", "smallest step of the reading", "Section 7.1", shown="nm", positive=True)
    ] = 5e-9
    tilt: Annotated[
        float,
        Par(
            "rad",
            "angle between beam and way: the cosine error",
            VARIANT,
            shown="mrad",
            lo=0.0,
            hi=0.1,
        ),
    ] = 0.0


@kernel
def drifted(p: Laser, drift: float, draw: float, dt: float) -> float:
    """Slow noise after one step."""
    keep = math.exp(-dt / p.drift_time)
    return keep * drift + p.drift * math.sqrt(1.0 - keep * keep) * draw


@kernel
def reading(p: Laser, path: float, draw: float, drift: float) -> float:
    """Reading of the laser: the way's share along its beam, rounded to its resolution."""
    shown = path * math.cos(p.tilt) + p.noise * draw + drift
    return math.floor(shown / p.resolution + 0.5) * p.resolution
