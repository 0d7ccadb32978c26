"""Belt flexibility: the lightly damped mode that a stopping carriage excites (Section 6.2)."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro import nominal
from macromicro.columns import Meaning
from macromicro.kernel import kernel
from macromicro.plant import VARIANT
from macromicro.schema.par import Par

FASTEST = 0.4 / nominal.PERIOD  # Hz; beyond half the loop's frequency nothing is seen of it


class Belt(NamedTuple):
    """The mode, as a mass on a spring carried along by the carriage.

    The thesis gives neither frequency nor mass, only amplitude and decay time (I2).
    """

    frequency: Annotated[
        float, Par("Hz", "frequency of the mode", "calibrated to I2", positive=True, hi=FASTEST)
    ] = 21.8
    decay: Annotated[
        float, Par("1/s", "decay rate of its amplitude", "calibrated to I2", lo=0.0)
    ] = 1.15
    participation: Annotated[
        float,
        Par(
            "1",
            "share of the mode in the stage's motion and in the mass",
            "calibrated to I2, S13c",
            lo=0.0,
            hi=1.0,
        ),
    ] = 0.0226
    slope: Annotated[
        float,
        Par(
            "1/m",
            "relative rise of the frequency along the rod, from its middle",
            VARIANT,
            lo=-5.0,
            hi=5.0,
        ),
    ] = 0.0


_MIDDLE = 0.5 * nominal.TRAVEL  # m


@kernel
def tensioned(p: Belt, x: float) -> Belt:
    """The mode at the carriage's position, on which the belt's free lengths depend."""
    frequency = p.frequency * (1.0 + p.slope * (x - _MIDDLE))
    return Belt(frequency, p.decay, p.participation, p.slope)


@kernel
def step(
    p: Belt, q: float, speed: float, kick: float, h: float
) -> tuple[Annotated[float, Meaning(name="q")], Annotated[float, Meaning(name="speed")]]:
    """The mode after one step: q'' + 2 d q' + w^2 q = -a by the implicit midpoint rule."""
    w = 2.0 * math.pi * p.frequency
    stiff = 0.25 * h * h * w * w
    damp = h * p.decay
    s0 = speed - kick
    s1 = (s0 * (1.0 - damp - stiff) - h * w * w * q) / (1.0 + damp + stiff)
    return q + 0.5 * h * (s0 + s1), s1


@kernel
def reaction(p: Belt, mass: float, q: float, speed: float) -> float:
    """Force of the mode's spring and damper on the carriage."""
    w = 2.0 * math.pi * p.frequency
    return p.participation * mass * (w * w * q + 2.0 * p.decay * speed)
