"""Belt flexibility: the lightly damped mode that a stopping carriage leaves behind.

Section 6.2: about 20 um at the micro-stage, gone in about two seconds. The belt pulls
beside the guide rod, so the carriage rocks on the belt's compliance and the stage, off
the rod's axis, sees a fraction of that motion.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.kernel import kernel
from macromicro.parameters import Par


class Belt(NamedTuple):
    """The mode, as a mass on a spring carried along by the carriage."""

    frequency: Annotated[float, Par("Hz", "frequency of the mode", "calibrated to I2", positive=True, hi=400.0)] = 21.8
    decay: Annotated[
        float, Par("1/s", "decay rate of its amplitude", "calibrated to I2", lo=0.0)
    ] = 1.15
    participation: Annotated[
        float,
        Par("1", "share of the mode's motion seen at the stage, and of the carriage's mass "
            "that takes part", "calibrated to I2", lo=0.0, hi=1.0),
    ] = 0.0224


@kernel
def step(p: Belt, q: float, speed: float, kick: float, h: float) -> tuple[float, float]:
    """Mode's deflection `q` [m] and speed [m/s] after `h`, the carriage gaining `kick` [m/s].

    q'' + 2 d q' + w^2 q = -a by the implicit midpoint rule: without a kick the energy
    can only fall, whatever the step.
    """
    w = 2.0 * math.pi * p.frequency
    stiff = 0.25 * h * h * w * w
    damp = h * p.decay
    s0 = speed - kick
    s1 = (s0 * (1.0 - damp - stiff) - h * w * w * q) / (1.0 + damp + stiff)
    return q + 0.5 * h * (s0 + s1), s1


@kernel
def energy(p: Belt, mass: float, q: float, speed: float) -> float:
    """Energy [J] in the mode of a carriage of `mass` [kg]."""
    w = 2.0 * math.pi * p.frequency
    return 0.5 * p.participation * mass * (speed * speed + w * w * q * q)


@kernel
def reaction(p: Belt, mass: float, q: float, speed: float) -> float:
    """Force [N] of the mode on the carriage."""
    w = 2.0 * math.pi * p.frequency
    return p.participation * mass * (w * w * q + 2.0 * p.decay * speed)
